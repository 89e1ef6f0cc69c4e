"""``unconstrain look`` and ``play``: pages that run by themselves; or the same for rerun, or live."""

from __future__ import annotations

import shlex
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import click

import unconstrain as uc

from ..base.display import counted, listed
from ..base.errors import ModelFileError, ReadError, SettingError, UnconstrainError
from ..base.files import write
from .constraining import arm_of, said_elsewhere
from .informing import OF, TOLD, constraints, learnt_from
from .printing import option_for_json, refuse_warnings, say_judged, say_verdict, say_written
from .reading import as_options, as_pattern, options_for_reading, prepared, reading_of, typed
from .speaking import as_typed
from .writing import check_outputs, option_for_force

MOST_QUICK = 20_000
"""Samples, at most, that are learnt from only to colour them: a second."""


@click.command(epilog="\b\nExample:\n  unconstrain play -o play.html")
@click.option(
    "-o", "--output", type=click.Path(dir_okay=False), default="play.html", show_default=True, help="HTML file."
)
@option_for_force
@option_for_json
def play(output: str, force: bool, as_json: bool) -> None:
    """Write a page to draw on, to see what it is about.

    Strokes on a plate, a rail that takes away what points into it, and three learners beside each other.
    """
    from ..pages.play import play_page

    check_outputs((output,), (), force)
    write(output, play_page())
    verdicts = uc.evaluation.verdicts
    verdict = verdicts.Verdict(verdicts.Mark.GOOD, "A page to draw on, by itself.", next="Open it in a browser.")
    say_judged(verdict, {"page": output}, as_json)


@click.command(epilog="\b\nExample:\n  unconstrain look wipe_*.csv wipe.npz --state x,y,z -o look.html")
@options_for_reading
@click.option(
    "-o", "--output", type=click.Path(dir_okay=False), default="look.html", show_default=True, help="HTML file."
)
@click.option("--rrd", type=click.Path(dir_okay=False), help="Also write a recording for the viewer rerun there.")
@click.option("--live", is_flag=True, help="In place of a page, show all in the browser until Ctrl-C.")
@click.option("--port", type=click.IntRange(0, 65535), help="With --live: where to listen, or the next that is free.")
@click.option("--robot", metavar="URDF", help="With --live or --rrd: states are joint angles of this robot; show it.")
@click.option("--tip", help="With --robot: the link that is its hand.")
@option_for_force
@option_for_json
def look(
    files: Sequence[str],
    output: str,
    rrd: str | None,
    live: bool,
    port: int | None,
    robot: str | None,
    tip: str | None,
    force: bool,
    as_json: bool,
    **reading: Any,
) -> None:
    """Write a page that shows demonstrations.

    Those in each FILE are seen in space and in time. A FILE may also be a policy (.npz), which is rolled out there, or
    a learnt constraint (.npz), which is drawn. Recordings are then prepared as those of the policy were.
    """
    paths = uc.readers.expand(files)
    _check_asked(live, rrd, robot, tip)
    if port is not None and not live:
        raise SettingError("--port: belongs to --live; a page needs none.")
    check_outputs((None if live else output, rrd), (*paths, robot), force)
    seen = _seen(paths, reading)
    scene: Any = None if rrd is None and not live else _scene(seen, robot, tip)
    surveys = _surveyed(seen)
    verdict, about = _judged(seen, surveys, live), [*_about(seen)]
    counts = {"demonstrations": len(seen.demonstrations), "samples": sum(map(len, seen.demonstrations))}
    if not as_json:
        say_verdict(verdict)
        numbers = (counted(count, name[:-1]) for name, count in counts.items())
        click.echo("\n".join([*about, ", ".join(numbers)]))
    written = {} if live else {"page": output}
    if not live:
        write(output, _page(seen, surveys, verdict))
    if rrd is not None:
        from ..pages.look import recorded

        write(rrd, recorded(scene))
        written["rerun"] = rrd
    say_written(written, {"verdict": verdict.to_json(), "about": about, **counts} if as_json else None)
    if live:
        from ..pages.look import serve

        serve(scene, robot, lambda address: click.echo(f"live: {address} (Ctrl-C ends it)", err=as_json), port)


class Seen(NamedTuple):
    """What there is to look at, and what it was read from."""

    paths: Sequence[str | Path]
    demonstrations: Sequence[uc.Demonstration]
    recipe: uc.Recipe
    recordings: Sequence[uc.Recording]
    policy: uc.Policy | uc.Guided | None
    constraint: Any
    roles: Mapping[str, Any]
    """How files are read, as the policy or constraint remembers it."""
    notes: Mapping[str, Any]

    @property
    def held(self) -> Sequence[uc.Demonstration]:
        """Those that the constraint is of."""
        of = self.notes.get(OF)
        return [one for one in self.demonstrations if of is None or one.name in of]


def _seen(paths: Sequence[str | Path], reading: dict[str, Any]) -> Seen:
    models = {path: found for path in paths if (found := _model(path)) is not None}
    recorded = [path for path in paths if path not in models]
    if not recorded:
        found = ", ".join(map(str, paths))
        raise ReadError(f"{found}: holds no recording to look at; add some: unconstrain look {found} wipe_*.csv")
    held = [one for one in models.values() if isinstance(one, constraints())]
    policies = [one for one in models.values() if not isinstance(one, constraints())]
    ordered = sorted(models, key=lambda path: models[path] in policies)  # a policy's notes last: they hold
    own = {path: uc.storage.load_notes(path) for path in ordered}
    columns = {uc.Recipe.from_dict(one.get("recipe", {})).states for one in own.values()} - {None}
    if max(len(policies), len(held), len(columns)) > 1:
        raise SettingError(
            f"{', '.join(map(str, paths))}: a page draws one policy and one constraint, of the same columns. Look at "
            "the others one after the other."
        )
    notes = {name: note for one in own.values() for name, note in one.items()}
    found = prepared(recorded, reading, notes)
    refuse_warnings(reading["strict"])
    return Seen(recorded, *found, next(iter(policies), None), next(iter(held), None), reading_of(**notes).roles, notes)


def _surveyed(seen: Seen) -> Sequence[Any]:
    """What is odd about the recordings; beside a policy, which was learnt from others, not how few they are."""
    found = uc.preparation.survey_set(seen.recordings, seen.recipe)
    few = "few-demonstrations" * (seen.policy is not None)
    return [replace(one, warnings=tuple(odd for odd in one.warnings if odd.code != few)) for one in found]


def _judged(seen: Seen, surveys: Sequence[Any], live: bool) -> uc.evaluation.verdicts.Verdict:
    """How recordings look, how a policy that is there moves, and what is left to others to judge."""
    verdicts = uc.evaluation.verdicts
    found = verdicts.of_surveys(surveys)
    if seen.policy is not None:
        from ..pages.fit import replayed

        of = seen.policy, seen.demonstrations, seen.recipe, None, seen.recordings[0].units
        found = replayed(verdicts.of_told(found, seen.notes.get(TOLD)), *of, free=False).verdict
        said = found.said.replace(": ready to learn from", "").replace(" starts, it ", " starts, the policy ")
        found = found._replace(said=said)
    across = uc.evaluation.diagnosis.about_recordings(found, seen.demonstrations, seen.recipe)
    odd = "; what it marks says what cures it" * any(one.warnings for one in surveys)
    return verdicts.of_look(found, across)._replace(next="" if live else f"Open the page{odd}.")


def _page(seen: Seen, surveys: Sequence[Any], verdict: uc.evaluation.verdicts.Verdict) -> str:
    from ..pages.look import look_page, marks_of

    found, more = zip(seen.recordings, surveys, seen.demonstrations, strict=True), len(seen.paths) - 1
    return look_page(
        seen.demonstrations,
        seen.recipe.states or (),
        f"A look at {Path(seen.paths[0]).name}{f' and {more} more' if more else ''}",
        units=seen.recipe.units(seen.recordings[0].units),
        marks=[[one._replace(message=as_typed(one.message)) for one in marks_of(*each)] for each in found],
        command=_to_fit(seen),
        policy=seen.policy,
        constraint=seen.constraint if seen.held else None,
        held=seen.held,
        free=_free(seen),
        verdict=verdict,
    )


def _about(seen: Seen) -> Iterator[str]:
    """What the policy and the constraint that are drawn are of."""
    count = len(seen.demonstrations)
    if seen.policy is not None:
        known = learnt_from(seen.policy, seen.notes, seen.recordings, seen.recipe)
        if known is not None and len(known) < count:
            named = f", {listed(known, 4)}" if known else ""
            yield f"policy: learnt from {len(known) or 'none'} of these {counted(count, 'demonstration')}{named}."
        told = seen.notes.get(TOLD)
        open_ = "where recordings tell it is not known" if told is None else uc.evaluation.verdicts.of_untold(1 - told)
        yield f"policy: {open_} ('unconstrain diagnose' says more)."
    if seen.constraint is not None and len(seen.held) < count:
        of = listed(seen.notes[OF], 4)
        drawn = "drawn there alone" if seen.held else "not drawn, as it is of none of these"
        yield f"constraint: of {of}, and {drawn}; others may have been held in other ways."
    if said := said_elsewhere(seen.notes, uc.stack(seen.demonstrations).states):
        yield f"constraint: {said}"


def _free(seen: Seen) -> Any:
    """Probability that each sample was free, where a quick fit tells it and there is no policy."""
    demos, space = seen.demonstrations, uc.spaces.Euclidean(len(seen.recipe.states or ()))
    enough = len(demos) >= uc.evaluation.diagnosis.ENOUGH and sum(map(len, demos)) <= MOST_QUICK
    if seen.policy is not None or not enough or seen.recipe.space != space:
        return None
    try:
        with warnings.catch_warnings(action="ignore"):
            return uc.LocallyLinearPolicy(None, learner=uc.NoiseCorrected()).fit_demonstrations(demos).solution_.free
    except UnconstrainError:  # a look needs no more than what can be seen
        return None


def _check_asked(live: bool, rrd: str | None, robot: str | None, tip: str | None) -> None:
    if (robot is None) != (tip is None):
        raise SettingError("--robot and --tip belong together: a URDF file, and the link that is its hand.")
    if robot is not None and not live and rrd is None:
        raise SettingError("--robot: belongs to --live and --rrd; the page shows the states as they are.")
    if live:
        from ..base.arrays import require_extra

        require_extra("viser", "live")


def _scene(seen: Seen, robot: str | None, tip: str | None) -> Any:
    """The same in space; of joint angles, where the hand is."""
    from ..pages.look import Scene

    states = seen.recipe.states or ()
    arm = None if robot is None else arm_of(robot, tip)
    if arm is not None and arm.joints != len(states):
        raise SettingError(f"--robot: has {arm.joints} joints on the way to {tip!r}, got {len(states)} states.")
    directions = seen.recipe.actions or seen.recipe.directions
    return Scene(seen.demonstrations, states, directions, seen.policy, seen.constraint, arm)


def _model(path: str | Path) -> Any:
    """The policy or constraint in a file; None where it holds a recording."""
    if Path(path).suffix.lower() == ".npz":
        with suppress(ModelFileError):
            return uc.load(path, uc.Policy | uc.Guided | constraints())
    return None


def _to_fit(seen: Seen) -> tuple[str, str]:
    """What to type to learn from these files as they were read, before and after what is left out."""
    given, known = typed("files", "output", "force", "leave_out", "rrd", "robot", "tip"), list[str]()
    if seen.notes or "--state" not in given:
        acting = ("--by", "--action") if {"--by", "--action", "--differentiate"} & {*given} else ()
        known = as_options(seen.recipe, uc.readers.Reading(**seen.roles), [*given, *acting])
    return f"unconstrain fit {as_pattern(seen.paths)} {shlex.join([*known, *given])}".rstrip(), "-o policy.npz"
