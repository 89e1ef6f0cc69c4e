"""``unconstrain constraint``: what held the recordings; and where the other commands take it."""

from __future__ import annotations

import contextlib
import math
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import click

import unconstrain as uc

from ..base.display import bare, listed, unit_of
from ..base.errors import InvalidDataError, SettingError
from ..base.files import write
from .informing import OF, PASSING, SHOWN, WHERE, constraints, provenance, verdict_of
from .printing import of_option, option_for_json, print_table, refuse_warnings, say_verdict, say_written
from .progress import shown
from .reading import loaded, numbers, of_words, options_for_reading, prepared, said_recipe, with_options
from .writing import check_name, check_outputs, option_for_force

RESTS = 0.1
"""Samples slower than this share of the root mean square speed are at rest."""

MOST_POSITIONS = 4000
"""Positions, at most, by which a mechanism is named; more are thinned evenly."""

LENGTHS = ("", "m", "mm", "cm", "um", "km", "in", "ft")
"""Units of positions, and none."""

FEATURES = ("auto", "constant", "affine", "quadratic", "rbf")


options_for_arm = with_options(
    click.option("--jacobian", metavar="URDF", help="States are joint angles of this robot: what is held is its hand."),
    click.option("--tip", help="With --jacobian: the link that is its hand."),
)


def hand_of(urdf: str | None, tip: str | None) -> Any:
    """The chain of a robot up to its hand, by the options; None where there are none."""
    if (urdf is None) != (tip is None):
        raise SettingError("--jacobian and --tip belong together: a URDF file, and the link that is held.")
    return None if urdf is None else arm_of(urdf, tip)


def jacobian_of(urdf: str | None, tip: str | None) -> Any:
    """Joint angles (N, n) to the Jacobian (N, 6, n) of a robot's hand, by the options; None where there are none."""
    arm = hand_of(urdf, tip)
    return None if arm is None else arm.jacobian


@click.command(epilog="\b\nExample:\n  unconstrain constraint wipe_*.csv --state x,y,z --differentiate -o plate.npz")
@options_for_reading
@click.option(
    "-o", "--output", required=True, type=click.Path(dir_okay=False), help="File (.npz), or the stem of one for each."
)
@of_words("--features", " ".join(FEATURES), "How the held directions may vary with the state.", "auto")
@options_for_arm
@click.option(
    "--with-task", is_flag=True, help="What is held also moves by itself: learn how, as a function of the state."
)
@click.option("--surface", is_flag=True, help="Learn from the positions alone: they lie on a surface.")
@click.option("--report", type=click.Path(dir_okay=False), help="Also write an HTML page there.")
@option_for_force
@option_for_json
def constraint(
    files: Sequence[str],
    output: str,
    features: str,
    jacobian: str | None,
    tip: str | None,
    with_task: bool,
    surface: bool,
    report: str | None,
    force: bool,
    as_json: bool,
    **reading: Any,
) -> None:
    """Learn what held the demonstrations in each FILE.

    Says its rank, form and noise, and what the data does not tell.
    """
    paths = uc.readers.expand(files)
    check_outputs((output, report), (*paths, jacobian), force)
    check_name(output)
    asked = _asked(features, jacobian, tip, surface, with_task)
    with shown("reading, learning"):
        demonstrations, recipe, (first, *_) = prepared(paths, reading)
        named = mechanism_of(demonstrations, recipe, first) if jacobian is None else None
        learnt = _agreeing(asked, named, demonstrations, surface)
    refuse_warnings(reading["strict"])
    if recipe.angles:
        click.echo(f"Note: {', '.join(recipe.angles)} as unwrapped: a turn more is another state to it.", err=True)
    outputs = {name: _of_demonstration(output, name) for name in learnt}
    check_outputs([place for name, place in outputs.items() if name], (*paths, jacobian), force)
    verdict = _judged(learnt, named, demonstrations)
    if not as_json:
        say_verdict(verdict)
        alone = f"{', '.join(recipe.labels(first.units)[0])} alone, as positions on a surface"
        click.echo(f"Learnt from {alone if surface else said_recipe(recipe, first)}.")
        _say(learnt, surface, recipe.labels(first.units), named)
    notes = provenance(paths, recipe, first, **reading)
    for name, place in outputs.items():
        uc.save(learnt[name], place, notes | _of(name, learnt[name], named, demonstrations))
    written = {f"constraint of {name}" if name else "constraint": place for name, place in outputs.items()}
    if report is not None:
        _report(report, learnt, demonstrations, recipe.labels(first.units)[0], named, verdict)
        written["report"] = report
    say_written(written, _told(learnt, verdict, named) if as_json else None)


def _asked(features: str, jacobian: str | None, tip: str | None, surface: bool, task: bool) -> uc.LearntConstraint:
    """What is to be learnt, by the options."""
    if surface and (task or jacobian is not None):
        raise SettingError("--surface: got --with-task or --jacobian too; positions alone show neither.")
    return uc.LearntConstraint(features, jacobian_of(jacobian, tip), task=task)


def _of(
    name: str, learnt: uc.LearntConstraint, named: Named | None, demonstrations: Sequence[uc.Demonstration]
) -> dict[str, Any]:
    """What a file notes of the demonstration that it is of, of where that was, and of the mechanism."""
    states = uc.stack([one for one in demonstrations if name in ("", one.name)]).states
    told: dict[str, Any] = {WHERE: [states.min(axis=0).tolist(), states.max(axis=0).tolist()]}
    told[OF] = [name] if name else [one.name for one in demonstrations]
    if named is None:
        return told
    told[PASSING] = named.passing({name: learnt}, demonstrations), named.found.mechanism.title
    return told | {SHOWN: named.shown({name: learnt}), "mechanism": dict(named.each).get(name, named.found.summary)}


def _judged(
    learnt: Mapping[str, uc.LearntConstraint], named: Named | None, demonstrations: Sequence[uc.Demonstration]
) -> uc.evaluation.verdicts.Verdict:
    """What was learnt, what it is by name where that holds more, and what of these is in the files."""
    if named is None:
        return uc.evaluation.verdicts.of_constraint(*learnt.values())
    found = uc.evaluation.verdicts.of_files(_judged_by_name(learnt, named, demonstrations), *learnt.values())
    asked = click.get_current_context().params
    typed = [name for name in ("features", "with_task", "surface") if asked[name] not in ("auto", False)]
    how = f"without --{' or --'.join(typed)}".replace("_", "-") if typed else "of one alone, with --episodes"
    apart = named.shown(learnt) in (True, None) and not any(one.mechanism_ for one in learnt.values())
    said, other = f" Learnt {how}, it holds to the mechanism." * apart, "; or name the --features" * bool(typed)
    return found._replace(said=found.said + said, next=found.next.replace(other, ""))


def _judged_by_name(
    learnt: Mapping[str, uc.LearntConstraint], named: Named, demonstrations: Sequence[uc.Demonstration]
) -> uc.evaluation.verdicts.Verdict:
    found = uc.evaluation.verdicts.of_constraint(*learnt.values(), shown=named.shown(learnt))
    kinds = dict(zip(named.names, named.found.candidates[0].kinds, strict=False))
    if "free" in kinds.values() and {*kinds.values()} - {"free", "undecided"}:
        names = [name for name, kind in kinds.items() if kind in ("free", "undecided")]
        left = shlex.quote(",".join([*click.get_current_context().params["leave_out"], *names]))
        said = f"Demonstrations differ: {named.found.summary}. No one constraint holds all of them."
        then = f"Learn it of those that look held, with --leave-out {left}."
        doubt = "What is learnt of all together." if "" in learnt else f"What is learnt of {listed(names)}."
        return uc.evaluation.verdicts.Verdict(uc.evaluation.verdicts.Mark.DOUBTFUL, said, doubt=doubt, next=then)
    if named.found.kind == "mixture" and {*kinds.values()} <= {"held", "undecided"}:
        sure = f"{[*kinds.values()].count('held')} of {len(kinds)} demonstrations that they were held"
        return found._replace(said=f"{found.said} Positions tell of {sure}, though not by what; not of the others.")
    if named.differs(learnt):
        said = f"Demonstrations differ: {named.found.summary}. {found.said.replace('held;', 'held in all;')}"
        return found._replace(said=said, next="Learn those of one mechanism alone, with --episodes or --leave-out.")
    rank, mechanism = max(one.choice_.fields.rank for one in learnt.values()), named.found.mechanism
    followed = named.shown(learnt) is True and all(one.mechanism_ for one in learnt.values())
    found = uc.evaluation.verdicts.of_passing(found, named.passing(learnt, demonstrations), mechanism.title)
    return uc.evaluation.verdicts.of_mechanism(found, rank, mechanism, followed)


def _report(
    place: str,
    learnt: Mapping[str, uc.LearntConstraint],
    demonstrations: Sequence[uc.Demonstration],
    columns: Sequence[str],
    named: Named | None,
    verdict: uc.evaluation.verdicts.Verdict,
) -> None:
    from ..pages.constraint import constraint_page

    said = () if named is None else named.sentences
    every, table = list(learnt.values()), table_of(learnt, named, True)
    write(place, constraint_page(every, demonstrations, Path(place).stem, columns, said, table, verdict))


def _learnt(
    constraint: uc.LearntConstraint, demonstrations: Sequence[uc.Demonstration], surface: bool
) -> dict[str, uc.LearntConstraint]:
    """One for all, without a name; or one for each, by name, where one for all has doubts or is less simple."""
    states, actions, groups = uc.stack(demonstrations)
    samples = states, None if surface else actions, groups
    try:
        shared = constraint.fit(*samples).choice_
    except InvalidDataError:
        each = constraint.differing(*samples)
        if not each:
            raise
    else:
        form = FEATURES.index(shared.name)
        each = constraint.differing(*samples) if shared.doubts or form > 1 else {}
        if not shared.doubts and any(FEATURES.index(one.choice_.name) >= form for one in each.values()):
            each = {}
    return {demonstrations[int(str(number))].name: one for number, one in each.items()} or {"": constraint}


def _agreeing(
    asked: uc.LearntConstraint, named: Named | None, demonstrations: Sequence[uc.Demonstration], surface: bool
) -> dict[str, uc.LearntConstraint]:
    """By other features if these let pass what positions show to be held, or hold more: one path always does."""
    learnt = _learnt(asked, demonstrations, surface)
    if named is None or asked.features != "auto" or asked.task:
        return learnt
    every = named.found.candidates
    likely = [one for one in every if every[0].against(one) < uc.constraints.mechanisms.LIKELY]
    ranks = {max(each.rank for each in one.mechanisms) for one in likely}
    most = max(ranks) if len(ranks - {0}) == len(ranks) == 1 else math.inf

    def wrong(one: Mapping[str, uc.LearntConstraint]) -> tuple[bool, bool]:
        contrary = named.passing(one, demonstrations) > uc.evaluation.verdicts.CONTRARY
        return contrary, max(each.rank_ for each in one.values()) > most

    for part in [demonstrations] if (shared := "" in learnt) else [[one] for one in demonstrations]:
        best = learnt if shared else {part[0].name: learnt[part[0].name]}
        for features in FEATURES[1 + surface :] if any(wrong(best)) else ():
            with contextlib.suppress(InvalidDataError):
                other = _learnt(uc.LearntConstraint(features), part, surface)
                best = min(best, other if shared else {part[0].name: other[""]}, key=wrong)
        learnt = best if shared else learnt | best
    return learnt if surface else {name: named.kept(name, one, demonstrations) for name, one in learnt.items()}


def _of_demonstration(output: str, name: str) -> str:
    path, plain = Path(output), re.sub(r"[^\w.-]+", "_", name)
    return str(path.with_name(f"{path.stem}_{plain}{path.suffix}")) if name else output


def _told(
    learnt: Mapping[str, uc.LearntConstraint], verdict: uc.evaluation.verdicts.Verdict, named: Named | None
) -> dict[str, Any]:
    each = {name: _numbers(one) for name, one in learnt.items()}
    return {
        **each.pop("", {}),
        "each": each,
        "mechanism": None if named is None else named.found.summary,
        "mechanisms": {} if named is None else dict(named.each),
        "mechanism_doubt": "" if named is None else named.found.doubt,
        "verdict": verdict.to_json(),
    }


def _numbers(learnt: uc.LearntConstraint) -> dict[str, Any]:
    choice = learnt.choice_
    return {
        "rank": learnt.rank_,
        "noise": learnt.noise_,
        "held_out": choice.held_out,
        "features": choice.name,
        "candidates": dict(choice.candidates),
        "doubts": list(choice.doubts),
        "holds_to": "what was learnt" if learnt.mechanism_ is None else learnt.mechanism_.sentence,
    }


def options_for_held(what: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add the options that name a constraint."""
    plane = f"Normal of a plane {what}; one number for each action, such as 0,0.3,1. Of joints, in the space of their "
    plane += "velocities; with --jacobian three, in that of the hand."
    learnt = click.option("--constraint", type=click.Path(), help=f"Learnt constraint {what} (.npz).")
    return with_options(click.option("--plane", type=numbers, help=plane), learnt, options_for_arm)


def held_of(
    plane: tuple[float, ...] | None, path: str | None, arm: Any, recipe: uc.Recipe, at: Any, actions: int
) -> uc.constraints.Constraint | None:
    """The constraint of the options, a plane or a learnt one, to be used at states (N, n) that a recipe prepares.

    Where there is an ``arm``, its hand is on the plane.
    """
    if plane is not None and path is not None:
        raise SettingError("--plane: got --constraint too, expected one of them.")
    if arm is not None and plane is None:
        raise SettingError("--jacobian: got no --plane, expected that of the hand; a --constraint knows its own robot.")
    if arm is not None and ({arm.joints} != {len(at[0]), actions} or recipe.centre):
        got = f"{len(at[0])} states{' relative to a mean' * recipe.centre} and {actions} actions"
        raise SettingError(f"--jacobian: got {got}, expected angles and velocities of {arm.joints} joints.")
    if plane is not None:
        return _plane_of(plane, arm, actions)
    if path is None:
        return None
    learnt = loaded(path, constraints())
    by_itself = isinstance(learnt, uc.constraints.mechanisms.Mechanism)
    found = 2 * (len(learnt.centre),) if by_itself else (learnt.choice_.columns, learnt.choice_.actions)
    if found != (states := len(at[0]), actions):
        raise SettingError(f"{path}: holds {found[1]} actions at {found[0]} states, expected {actions} at {states}.")
    notes = uc.storage.load_notes(path)
    own = uc.Recipe.from_dict(notes.get("recipe", {}))
    if own.states and recipe.states and (own.states, own.centre) != (recipe.states, recipe.centre):
        raise SettingError(f"{path}: is of {_said_states(own)}, expected {_said_states(recipe)}, as the policy.")
    if said := said_elsewhere(notes, at):
        click.echo(f"Note: {path}: {said}", err=True)
    if (judged := verdict_of(learnt, notes)).mark is not uc.evaluation.verdicts.Mark.GOOD:
        click.echo(f"Note: {path}: {judged.said} {f'Do not trust: {judged.doubt}' * bool(judged.doubt)}", err=True)
    return learnt if by_itself else learnt.mechanism_ or learnt


def _plane_of(plane: tuple[float, ...], arm: Any, actions: int) -> uc.constraints.Constraint:
    """A plane of actions; or of the hand of an arm, one row of its Jacobian."""
    import numpy as np

    count, meaning = (actions, "one for each action") if arm is None else (3, "a normal in the frame of its base")
    if len(plane) != count:
        raise SettingError(f"--plane: got {len(plane)} numbers, expected {count}, {meaning}.")
    with of_option("--plane"):
        held = uc.constraints.Plane(np.array(plane))
    return held if arm is None else lambda states, _times: held.normal @ arm.jacobian(states)[:, None, :3]


def said_elsewhere(notes: Mapping[str, Any], states: Any) -> str:
    """Of a constraint, that most states are farther from where it was learnt than that is wide; or nothing."""
    import numpy as np

    try:
        low, high = np.array(notes.get(WHERE, (-np.inf, np.inf)), dtype=float)
        off = np.median(np.maximum(low - states, states - high).max(axis=1))
    except (TypeError, ValueError, OverflowError):  # a note that somebody else has written
        return ""
    far = off > np.linalg.norm(high - low)
    return f"it was learnt at states that are {off:.3g} away from these: is it of another task?" * bool(far)


def _said_states(recipe: uc.Recipe) -> str:
    return f"{', '.join(recipe.states or ())}{', centred' if recipe.centre else ''}"


def arm_of(urdf: str, tip: Any) -> Any:
    """The chain of a robot up to a link."""
    from ..paper.systems.arm import Arm

    return Arm.from_urdf(urdf, tip)


class Named(NamedTuple):
    """What may have held some demonstrations, by name: one mechanism for all, or one for each."""

    found: Any
    names: list[str]
    up: str
    """The last column."""
    held: Sequence[Any]

    def shown(self, learnt: Mapping[str, uc.LearntConstraint]) -> bool | str | None:
        """Whether positions show what held them; None where it may be a habit, "free" where nothing did."""
        free, part = self.found.kind == "free", "" not in learnt and len(learnt) < len(self.names)
        if not self.found.decided or ("" in learnt and self.differs(learnt)) or (free and part):
            return False  # that nothing held all of them tells nothing of one
        return "free" if free else None if self.found.habit else True

    def differs(self, learnt: Mapping[str, uc.LearntConstraint]) -> bool:
        """Whether kinds of mechanisms differ, or one constraint for all holds less than those of each."""
        less = "" in learnt and learnt[""].rank_ < max(one.rank for one in self.held)
        return self.found.kind == "mixture" or (less and len(self.held) > 1 and self.found.decided)

    def kept(self, name: str, learnt: uc.LearntConstraint, demos: Sequence[uc.Demonstration]) -> uc.LearntConstraint:
        """What was learnt of one demonstration, or of all, held by its mechanism if positions decide on that."""
        kinds = self.found.candidates[0].kinds
        own = dict(zip(self.names if len(kinds) > 1 else [name], zip(self.held, kinds, strict=True), strict=False))
        mechanism, kind = own.get(name, (None, "undecided"))
        sure = self.found.decided or self.found.odds >= uc.constraints.mechanisms.LIKELY  # others may be undecided
        if kind in ("free", "undecided", "held") or not sure:
            return learnt
        return learnt.held_by(mechanism, *uc.stack([one for one in demos if name in ("", one.name)])[:2])

    def passing(self, learnt: Mapping[str, uc.LearntConstraint], demonstrations: Sequence[uc.Demonstration]) -> float:
        """How much of what a mechanism that is sure holds, or of its own if that is less, what was learnt lets pass."""
        import numpy as np

        if self.shown(learnt) in (False, "free") or any(one.task for one in learnt.values()):
            return 0.0
        own, found = dict(zip(self.names, self.held, strict=False)) if len(self.held) > 1 else {}, [0.0]
        for one in demonstrations if "" in learnt else [one for one in demonstrations if one.name in learnt]:
            held, rows = own.get(one.name, self.held[0]), (learnt.get("") or learnt[one.name])(one.states)
            alike = np.linalg.svd(held.rows(one.states) @ rows.swapaxes(1, 2), compute_uv=False)
            found.append(float(np.median(1.0 - np.minimum(alike.min(axis=1, initial=1.0), 1.0) ** 2) ** 0.5))
        return max(found)

    @property
    def each(self) -> list[tuple[str, str]]:
        """Name and mechanism of each, where they differ."""
        open_ = [f"{kind}: " * (kind in ("undecided", "held")) for kind in self.found.candidates[0].kinds]
        told = [doubt + one.sentence for doubt, one in zip(open_, self.held, strict=True)]
        return list(zip(self.names, told, strict=True)) if len(told) > 1 else []

    @property
    def sentences(self) -> list[str]:
        """The verdict, and what it leaves open."""
        known, doubt = "Shape of the path, held or not" if self.found.habit else "Mechanism", self.found.doubt
        known += ", if these are positions" * (not self.found.mechanism.unit)
        meant = f" ({'± is half of a 95 % interval, ' * ('±' in self.found.summary)}10:1 are odds for what is first)"
        meant *= ":1" in self.found.summary
        apart = [
            name for name, one in zip(self.names, self.held, strict=False) if sum(map(one.parallel, self.held)) < 2
        ]
        apart = [] if self.found.candidates[0].over_free else apart  # of each its kind says that
        free = f"Maybe free, as no other has an axis of that direction: {listed(apart)}."
        said = [f"{known}: {self.found.summary}{meant}.", *([f"{doubt[0].upper()}{doubt[1:]}."] if doubt else [])]
        said[0] = said[0].replace("nothing held", "none") if self.found.habit else said[0]
        return [*said, free] if doubt and 0 < len(apart) < len(self.held) else said


def mechanism_of(demonstrations: Sequence[uc.Demonstration], recipe: uc.Recipe, first: uc.Recording) -> Named | None:
    """Which mechanism may have held positions; None where these are none, or too little was recorded."""
    names = recipe.states or ()
    if recipe.actions is not None or len(names) not in (2, 3) or recipe.space != uc.spaces.Euclidean(len(names)):
        return None
    positions, actions, groups = uc.stack(demonstrations)
    speeds = (actions**2).sum(axis=1) ** 0.5
    moves = speeds > RESTS * (speeds**2).mean() ** 0.5  # where somebody rests, all that positions keep to is a point
    positions, groups = positions[moves], groups[moves]
    every = -(-len(positions) // MOST_POSITIONS)
    try:
        unit = _length_of([recipe.units(first.units).get(name, "") for name in names])
        found = uc.constraints.identify(positions[::every], groups=groups[::every], unit=unit)
        if found.kind == "point":
            least = min(demonstrations, key=lambda one: one.states.var(axis=0).sum()).name
            raise InvalidDataError(f"positions keep to a point, which would hold every motion; {least!r} moves least.")
    except InvalidDataError as error:
        click.echo(f"Note: no mechanism is named: {error}", err=True)
        return None
    told = [demonstrations[number].name for number in sorted({*groups[::every].tolist()})]
    return Named(found, told, names[-1], found.candidates[0].mechanisms)


def _length_of(units: Sequence[str]) -> str:
    """Of lengths, as the columns say it; empty where they do not."""
    [unit, *others] = dict.fromkeys(unit.lower() for unit in units)
    if others or unit not in LENGTHS:
        raise InvalidDataError(
            f"the columns are in {listed(units)}, expected one unit of length: these are no positions."
        )
    return unit


def _say(
    learnt: Mapping[str, uc.LearntConstraint], surface: bool, labels: Sequence[Sequence[str]], named: Named | None
) -> None:
    if "" in learnt:
        unit, of = unit_of(labels[not surface]), "distance from it" if surface else "action"
        _say_one(learnt[""], f"{unit} of {of}" if unit else f"(unit of the {'states' if surface else 'actions'})")
    else:
        click.echo("Each demonstration has its own: one constraint for all misses more where held out.")
    if named is not None:
        click.echo("\n".join(named.sentences))
    head, rows = table_of(learnt, named)
    if rows:
        print_table(head, rows)
    if named is not None and named.each:
        click.echo("Where each is: --json, and --report draws it.")


def _say_one(learnt: uc.LearntConstraint, what: str) -> None:
    choice = learnt.choice_
    smooth = f", smoothed with {choice.smoothness:g}" if choice.smoothness else ""
    of = "Learnt" if learnt.mechanism_ is None else "Of velocities alone"
    click.echo(f"{of}: {choice.fields.rank} of {choice.actions} directions held, by {choice.name} features{smooth}.")
    missed = f"where held out {choice.held_out:.3g} of the mean square of all that moves"
    click.echo(f"Noise and misfit along them are about {choice.noise:.3g} {what}, and {missed}.")
    rows = [[name, f"{share:.3g}"] for name, share in choice.candidates.items()]
    print_table(["features", "missed where held out"], rows)
    if choice.candidates.get(choice.name, 0.0) > min(choice.candidates.values()):
        click.echo(f"Taken: {choice.name}, the simplest that misses no more than the least, up to noise and chance.")


def table_of(
    learnt: Mapping[str, uc.LearntConstraint], named: Named | None, whole: bool = False
) -> tuple[list[str], list[list[str]]]:
    """What held each demonstration, where that differs: head and rows; the whole of it is wide."""
    own = {name: one for name, one in learnt.items() if name}
    by = [one.mechanism_.kind if one.mechanism_ else one.choice_.name for one in own.values()]
    columns = {
        "looks held": [
            f"{one.rank_} of {one.choice_.actions}, {how}" for one, how in zip(own.values(), by, strict=True)
        ],
        "missed where held out": [f"{one.choice_.held_out:.3g}" * (not one.mechanism_) for one in own.values()],
    }
    names = list(own)
    if named is not None and named.each:
        names, held, kinds = named.names, named.held, named.found.candidates[0].kinds
        columns["kind"] = kinds if named.found.kind == "mixture" else []
        what = f"angle of {'normal' if {*kinds} == {'plane'} else 'axis'} to {bare(named.up)} axis"
        angles = [f"{math.degrees(math.acos(min(abs(one.axis[-1]), 1.0))):.1f}°" for one in held]
        sure = ["tilt" in one.margins and kind != "undecided" for one, kind in zip(held, kinds, strict=True)]
        columns[what] = [each * told for each, told in zip(angles, sure, strict=True)]
        columns["radius"] = ["" if one.vague or not one.radius else f"{one.radius:.3g} {one.unit}" for one in held]
        at = [", ".join(f"{each + 0.0:.3f}" for each in one.centre.round(3)) for one in held]
        columns["centre"] = [each * bool(radius) for each, radius in zip(at, columns["radius"], strict=True)]
        columns["mechanism"] = [text for _, text in named.each] if whole else []
    shown = {head: values for head, values in columns.items() if any(values)}
    return ["demonstration", *shown], [list(row) for row in zip(names, *shown.values(), strict=True)]
