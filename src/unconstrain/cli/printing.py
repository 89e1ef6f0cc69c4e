"""Output on the terminal: tables, notes, and errors in one sentence."""

from __future__ import annotations

import errno
import json
import re
import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import isfinite, radians, tau
from typing import TYPE_CHECKING, Any, NamedTuple

import click

import unconstrain as uc

from ..base.display import counted, innermost, listed, percent, unit_of
from ..base.errors import InvalidDataError, ModelFileError, ReadError, SettingError, WriteError
from .endings import REFUSED, ending
from .reading import next_command, said_recipe, say_left, to_copy
from .speaking import as_typed, meant_of, options_in
from .terminal import plain_output

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

CODES = "unconstrain.codes"
"""Where the codes of warnings are kept in the context of a command."""

OTHER_UNITS = {"unit-differs", "clock-differs"}
"""Codes of recordings in another unit than others."""

SPOILING = {*OTHER_UNITS, "missing", "refused", "same-recording", "rolled-out"}
"""Codes of recordings that spoil what is learnt with others, or end it."""

MEANINGS = {
    "fast samples": "of ten times their noise or more, where known, of all: what 'explains' is of; in --json 'fast'",
    "explains": "weighted share of the squared motion, along the recorded directions, that the policy explains; go by "
    "this, as the verdict does: of the fast samples the slower count less",
    "normalised inconsistency": "the paper's squared error along the motion, over the variance of the actions; slow "
    "samples and noise count as much as fast ones, so it may look worse; 0 is perfect",
    "nUPE": "squared error of the whole policy, over the variance of the actions; 0 is perfect",
    "nCPE": "squared error along what the constraint leaves free, over the variance of the actions; 0 is perfect",
    "nPOE": "recorded motion that the constraint would forbid, over the variance of the actions; 0 is perfect",
}
"""What the heads of tables stand for."""

OF_FILES = ModelFileError, OSError, ReadError, WriteError
"""Errors that begin with the name of a file or folder."""

TITLES = "unconstrain.titles"
"""Where it is kept which recordings each code was said of."""


class Group(click.Group):
    """Ends in one sentence and the right exit code, whatever happens; what cannot be printed stops no command."""

    def main(self, *args: Any, **extra: Any) -> Any:
        """Parse and run the command line; ends with ``SystemExit``."""
        with plain_output() as printed:
            try:
                return super().main(*args, **extra)
            except SystemExit as end:
                # Who closes a pipe has seen enough.
                if end.code or printed.trouble is None or printed.trouble.errno == errno.EPIPE:
                    raise
                click.echo(f"Error: standard output: cannot be written ({printed.trouble.strerror}).", err=True)
                raise SystemExit(REFUSED) from None

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("default", UserWarning)
                warnings.filterwarnings("ignore", "The policy explains next to nothing|One model fits")  # verdicts do
                warnings.showwarning = show_warning  # type: ignore[assignment]
                try:
                    return super().invoke(ctx)
                finally:
                    say_others()
        except click.BadParameter as error:
            known: Sequence[str] = getattr(getattr(error.param, "type", None), "choices", ())
            refused = re.match(r"'(.*)' is not one of", error.message or "")
            meant = meant_of(refused[1], known) if refused else ""
            raise type(error)(f"{error.message}{meant}", error.ctx, error.param) if meant else error from None
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - the last clause
            said, code = ending(error)
            click.echo(f"Error: {as_typed(said, isinstance(error, OF_FILES))}", err=True)
            ctx.exit(code)


@contextmanager
def of_option(name: str) -> Iterator[None]:
    """Let settings that cannot be begin with the option that they came from."""
    try:
        yield
    except (SettingError, InvalidDataError) as error:
        said, alone = re.sub(r"^[a-z_]+: ", "", str(error)), options_in(str(error)).get("--episodes")
        more = ["--episodes", alone or "", name, "auto", "-o", click.get_current_context().params.get("output", "")]
        said += f" These alone: {next_command('fit', *more, without=['to', 'episodes'])}" if alone else ""
        raise type(error)(f"{name}: {said}") from None


def say_surveys(surveys: Sequence[Any]) -> None:
    """Print what was found in recordings: a line for each, columns, what is not as it seems."""
    rows = [
        [
            found.name,
            str(found.samples) if found.left is None else f"{found.left} of {found.samples}",
            number(found.duration_s, "{:.2f} s" + doubted),
            number(found.rate_hz, "{:.1f} Hz" + doubted),
            number(found.jitter, "{:.1%}"),
            "; ".join(f"{gap.length:.2f} s at {gap.start:.2f} s" for gap in found.gaps[:3])
            + (f" and {len(found.gaps) - 3} more" if len(found.gaps) > 3 else "")
            or "none",
            ", ".join(f"{name}: {count}" for name, count in found.missing.items()) or "none",
            number(found.zero_actions, "{}"),
        ]
        for found in surveys
        for doubted in ["?" * bool({"clock-unit", "clock-differs"} & {one.code for one in found.warnings})]
    ]
    samples = "samples" if surveys[0].left is None else "left by --still"
    print_table(["demonstration", samples, "length", "rate", "jitter", "gaps", "missing", "zero actions"], rows)
    for columns in dict.fromkeys(found.columns for found in surveys):
        click.echo(f"columns: {', '.join(columns)}")
    for words in dict.fromkeys(found.words for found in surveys if found.words):
        click.echo(f"columns of words, which --group can take demonstrations apart by: {', '.join(words)}")
    for found in surveys:
        if found.non_increasing and not any(one.row == found.non_increasing[0] for one in found.warnings):
            click.echo(f"{found.title}: time does not increase at row {found.non_increasing[0]}.")
    each = [(found.title, remark) for found in surveys for remark in (*found.warnings, *found.notes)]
    several = {title for title, remark in each if remark.code == "several-in-one"}
    same = uc.evaluation.verdicts.SAME_CAUSE
    each = [(title, one) for title, one in each if title not in several or one.code not in same]
    for kind in dict.fromkeys(_kind(remark) for _, remark in sorted(each, key=lambda one: not one[1].warns)):
        titles = {title: remark for title, remark in reversed(each) if _kind(remark) == kind}
        *others, first = titles
        click.echo(as_typed(titles[first].about(first)))
        if others:
            click.echo(f"  the same of {listed(others[::-1], 8)}, {len(titles)} in all")


option_for_json = click.option("--json", "as_json", is_flag=True, help="Print JSON.")


def say_written(places: dict[str, str], told: dict[str, Any] | None) -> None:
    """Print where files were written, or, with what else is told, all as JSON."""
    if told is not None:
        click.echo(json.dumps(told | places, indent=2))
        return
    for what, place in places.items():
        click.echo(f"{what}: {place}")


def say_judged(verdict: uc.evaluation.verdicts.Verdict, written: dict[str, str], as_json: bool, **told: Any) -> None:
    """Print a verdict and where files were written; or these, and what else is told, as JSON."""
    if not as_json:
        say_verdict(verdict)
    say_written(written, {"verdict": verdict.to_json(), **told} if as_json else None)


class Judged(NamedTuple):
    """How much of the motion a policy explains."""

    verdict: uc.evaluation.verdicts.Verdict
    replayed: Mapping[str, Any] | None
    ran: str
    moves: str
    demonstrations: int
    samples: int
    training: float
    held_out: float
    lost: float | None = None
    noise_alone: float | None = None
    guides: str | None = None

    def to_json(self) -> dict[str, Any]:
        """With None for what is not known."""
        plain = self._asdict() | {"verdict": self.verdict.to_json()}
        return {name: None if value != value else value for name, value in plain.items()}


def judge_fit(moving: uc.Policy | uc.Guided, stream: uc.Stream, told: float | None, scheduler: str | None) -> Judged:
    """Walk through the demonstrations once more; on a cluster only the sums are there.

    ``told`` is the share of the recorded states at which recordings tell the policy, None where not known.
    """
    from ..pages.fit import guides, retraced

    policy = innermost(moving)
    demos = stream.beginning() if scheduler is None or moving is not policy else []
    alone, lost = policy.held_out_score(), uc.evaluation.diagnosis.lost_by_guiding(moving, demos)
    held_out = alone - (lost or 0.0)
    if scheduler is not None:
        count = len(stream.paths)
        found = uc.evaluation.verdicts.of_explained(alone, count, told, lost=lost)
        return Judged(found, None, "", "", count, 0, float("nan"), held_out, lost)
    say_left(demos, stream.recipe)
    usual = float((uc.stack(demos).actions ** 2).sum(axis=1).mean() ** 0.5)
    count, samples, missed = _walked(moving, stream, usual)
    open_ = told is not None and told < uc.evaluation.verdicts.MOSTLY
    there = _least_known(policy, demos, stream.recipe) if open_ and count >= uc.evaluation.diagnosis.ENOUGH else ""
    noise = uc.evaluation.metrics.missed_for_noise(policy, demos)
    more = 1.0 - missed, lost, noise, policy.solution_.left_out
    found = uc.evaluation.verdicts.of_explained(alone, count, told, there, *more)
    ran = retraced(found, moving, demos, stream.recipe, None, stream.first.units, False)
    cured = ran.verdict._replace(next=there) if there and found.next == there else ran.verdict
    to = guides(policy, demos) if moving is policy else None
    verdict = uc.evaluation.diagnosis.about_recordings(cured, demos, stream.recipe, moving)
    states = stream.recipe.labels(stream.first.units)[0]
    verdict = to_copy(as_noted(verdict, count), click.get_current_context().params["output"], None, states)
    return Judged(verdict, ran.medians, *ran[3:], count, samples, 1.0 - missed, held_out, lost, noise, to)


def as_noted(verdict: uc.evaluation.verdicts.Verdict, count: int) -> uc.evaluation.verdicts.Verdict:
    """The same with what was noted: stands in one recording alone; and, at best doubtful, glitches and units."""
    told, name = click.get_current_context().meta, click.get_current_context().info_name or ""
    if count == 1 and "pause" in told.get(TITLES, {}):
        then = next_command(name, "--pauses", "cut", *["-o", "policy.npz"] * (name == "fit"), without=["pauses"])
        verdict = verdict._replace(next=f"If demonstrations are between where it stands still, cut it there:\n{then}")
    if jumps := [title for title, one in told.get(TITLES, {}).get("glitch", {}).items() if not one.cured]:
        verdict = uc.evaluation.verdicts.of_glitches(verdict, listed(jumps, 4))
    if "rolled-out" in told.get(CODES, ()):
        return uc.evaluation.verdicts.of_units_apart(verdict, "a movement that was rolled out is learnt from")
    if "not-velocities" in told.get(CODES, ()):
        return uc.evaluation.verdicts.of_units_apart(verdict, "actions are not the velocities of the states")
    return uc.evaluation.verdicts.of_units_apart(verdict) if OTHER_UNITS & {*told.get(CODES, ())} else verdict


def _least_known(policy: uc.Policy, demonstrations: Sequence[uc.Demonstration], recipe: uc.Recipe) -> str:
    """Where more demonstrations tell most, the first place of a diagnosis, and the command that lists all."""
    worst, *_ = uc.evaluation.verdicts.ranked(uc.evaluation.diagnose(policy, demonstrations))
    place = uc.evaluation.diagnosis.named(worst.state, recipe.states or ())
    passed = f"near {place}, where '{worst.demonstration}' passed"
    least = f"Record more where least is known, held in other ways: {passed}."
    large = click.get_current_context().params.get("model") in ("rbf", "cubic")
    least += " Or fit a model of fewer weights, which needs less, as without --model." * large
    return f"{least} All such places:\n{next_command('diagnose')}"


def say_fit(moving: uc.Policy | uc.Guided, stream: uc.Stream, judged: Judged, learner: str, verbose: bool) -> None:
    """Print a verdict, what a policy was learnt from and explains, and what the data determined."""
    say_verdict(judged.verdict)
    click.echo(f"Learnt from {said_recipe(stream.recipe, stream.first)}.")
    policy = innermost(moving)
    say_scale(policy, stream.recipe)
    if moving is not policy:
        click.echo(f"Guided: {moving.aim_.promise}")
    solution, known = policy.solution_, isfinite(judged.training)
    models = uc.evaluation.diagnosis.models_of(policy) if hasattr(policy, "fields_") else ""
    counts = f"{counted(judged.demonstrations, 'demonstration')}, {counted(judged.samples, 'sample')}" if known else ""
    if counts or models:
        click.echo(f"{', '.join(filter(None, (counts, models)))}.")
    if getattr(policy, "features", None) == "auto":
        click.echo(f"Features of least estimated error: {uc.evaluation.diagnosis.models_of(policy)}.")
    if solution.belief is not None:
        unit = "" if policy.scale_ else unit_of(stream.recipe.labels(stream.first.units)[1])
        where = f"{unit} on each action" if unit else "on each action, in its unit"
        risks = {name: one.risk for name, one in solution.candidates.items()}
        said = f"Noise and misfit are about {solution.noise:.3g} {where}; 'unconstrain diagnose' says what looks free."
        click.echo(f"{uc.evaluation.diagnosis.about_choice(solution.method, risks)} {said}")
        if known:
            _say_suspects(solution.belief.suspects, stream)
    elif learner != "direct":
        _say_determined(solution, learner)
    click.echo("".join(f"{note}\n" for note in solution.notes), nl=False)
    seen = f"{judged.training:.4g} on the training data, " if known else ""
    where = "as expected of new motion" if solution.left_out else "where held out"
    rest = f"{judged.held_out:.4g} {where}." if isfinite(judged.held_out) else "nothing could be held out."
    click.echo(f"Share of the motion explained, where slow samples count less, as in the verdict: {seen}{rest}")
    if judged.ran:
        click.echo(f"Run from the same starts: {judged.ran}.")
    of, to = len(stream.recipe.directions), len(stream.recipe.actions or stream.recipe.directions)
    if of not in (to, 2 * to):
        said = f"Note: {counted(to, 'action')} for {counted(of, 'state')}: no velocities, which 'rollout' and a ROS 2 "
        click.echo(f"{said}node need; for these, name others with --state and --action.", err=True)
    if verbose and solution.belief is not None:
        rows = sorted((one.risk, name) for name, one in solution.candidates.items())
        told = [[name, f"{risk:.4g}", uc.evaluation.diagnosis.in_words(name)] for risk, name in rows]
        print_table(["candidate", "estimated squared error", "what it is"], told)
    if known:
        say(uc.preparation.doubts(judged.demonstrations, 1.0 - judged.training - (judged.lost or 0.0)))


def _say_determined(solution: uc.Solution, learner: str) -> None:
    said = f"{percent(solution.determined_share)} of {solution.directions} weight directions"
    said += " of each model" * (len(solution.weights) > 1)
    if learner == "hybrid" and solution.determined_share < 1:
        said += "; along the others the policy is as close to the recorded actions as can be"
    click.echo(f"The inconsistency determined {said}.")
    if solution.determined_share == 0.0:
        click.echo("Note: nothing was determined, so this is the same as --learner direct.", err=True)


def say_scale(policy: uc.Policy, recipe: uc.Recipe) -> None:
    """Print what counts as one of each state and action, where that is not their own unit."""
    if policy.scale is not None and (recipe.angles or recipe.quaternions):
        click.echo("Note: --scale auto: angles and orientations have none; give positions in metres.", err=True)
    if policy.scale_ is None:
        return
    names = *(recipe.states or ()), *(recipe.actions or ())
    sizes = [*policy.scale_.states, *policy.scale_.actions]
    told = ", ".join(f"{size:.4g} of {name}" for name, size in zip(names, sizes, strict=False))
    click.echo(f"As one count {told} (--scale); noise and features are in these units, predictions as in the files.")


def _say_suspects(rows: NDArray[np.intp], stream: uc.Stream | None) -> None:
    """Name the samples that look wrong, in a further walk if there are any."""
    if len(rows) and stream is not None:
        named = ((name.partition("/")[2], demo) for name, demo in stream.named_demonstrations())
        for line in uc.evaluation.diagnosis.about_suspects(uc.evaluation.diagnosis.places_of(rows, named)):
            click.echo(f"Note: {line}", err=True)


def explained(policy: Any, demonstrations: Sequence[uc.Demonstration]) -> float:
    """Share of the motion that a policy explains along it; none where nothing moves."""
    missed, motion = uc.evaluation.metrics.along_motion(policy, demonstrations)
    return 1.0 - missed / motion if motion > 0 else 0.0


def _walked(policy: uc.Policy | uc.Guided, stream: uc.Stream, usual: float) -> tuple[int, int, float]:
    """Numbers of demonstrations and samples, and the unexplained share of their motion, without sample weights."""
    names, samples, unexplained, energy = set(), 0, 0.0, 0.0
    for name, demonstration in stream.named_demonstrations():
        names.add(name)
        samples += len(demonstration)
        missed, motion = uc.evaluation.metrics.along_motion(policy, demonstration, usual)
        unexplained, energy = unexplained + missed, energy + motion
    return len(names), samples, unexplained / energy if energy > 0 else 1.0


def say_verdict(verdict: uc.evaluation.verdicts.Verdict, err: bool = False) -> None:
    """Print a verdict, and a line below it."""
    click.echo("\n".join([*verdict.lines(), ""]), err=err)


def number(value: Any, form: str) -> str:
    """A value as text, or a dash."""
    return "-" if value is None else form.format(value)


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]], piped: int = 10_000) -> None:
    """Print a table that fits the terminal, or so many columns where output is piped."""
    from rich.console import Console
    from rich.table import Table

    table = Table(*head, box=None, pad_edge=False, show_header=any(head))
    for row in rows:
        table.add_row(*row)
    # Piped output is for programs and files: rows of numbers are not wrapped there.
    width = None if sys.stdout.isatty() else piped
    Console(width=width, markup=False, emoji=False, highlight=False, color_system=None).print(table)
    for name, meaning in MEANINGS.items():
        if any(name in title for title in head):
            click.echo(f"{name}: {meaning}.")


def show_warning(message: Warning | str, *_: Any) -> None:
    """Print a warning as a note, without where it came from, and keep its code for :func:`refuse_warnings`.

    Of what is said of several recordings the first is printed, and the others are counted (:func:`say_others`).
    """
    keep_codes([getattr(message, "code", "")])
    remark, context = getattr(message, "remark", None), click.get_current_context(silent=True)
    if remark is not None and context is not None:
        titles = context.meta.setdefault(TITLES, {}).setdefault(_kind(remark), {})
        titles[message.title] = remark  # type: ignore[union-attr]
        if len(titles) > 1:
            return
    click.echo(f"Note: {as_typed(str(message))}", err=True)


def _kind(remark: Any) -> str:
    """Its code, and of what is at ends, at which."""
    return f"{remark.code} {' and '.join(re.findall('before it starts|at its end', remark.message))}".rstrip()


def doubt_degrees(option: str, states: Sequence[float], recipe: uc.Recipe) -> None:
    """Note angles of an option that look like degrees, where a policy takes radians of columns recorded in degrees."""
    for name, angle in zip(recipe.states or (), states, strict=False):
        if name in (recipe.degrees or ()) and abs(angle) > tau:
            said = f"{option}: {angle:.4g} is far outside radians, which the policy takes for {name}; if it is in "
            show_warning(f"{said}degrees, as recorded, that is {radians(angle):.4g}.")


def say_others() -> None:
    """Say of which other recordings the notes hold too."""
    for kind, (_, *others) in click.get_current_context().meta.pop(TITLES, {}).items():
        if others:
            click.echo(f"Note: {kind}: the same of {listed(others, 8)}, {len(others) + 1} in all.", err=True)


def say(remarks: Iterable[Any]) -> None:
    """Print remarks about all demonstrations together as notes."""
    for remark in remarks:
        show_warning(uc.preparation.PreparationWarning(remark))


def keep_codes(codes: Iterable[str]) -> None:
    """Keep the codes of warnings for the end of the command."""
    context = click.get_current_context(silent=True)
    if context is not None:
        context.meta.setdefault(CODES, []).extend(filter(None, codes))


def refuse_warnings(strict: bool) -> None:
    """With ``--strict``, end with an error where there was a warning.

    Raises
    ------
    InvalidDataError
        With the codes of the warnings.
    """
    codes = click.get_current_context().meta.get(CODES, [])
    if strict and codes:
        raise InvalidDataError(f"--strict: not as it seems ({', '.join(dict.fromkeys(codes))}); nothing was written.")
