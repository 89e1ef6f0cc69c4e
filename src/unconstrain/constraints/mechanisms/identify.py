"""Which mechanism made these movements, and how sure is that."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import comb, factorial, log, prod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...base.arrays import Array, Groups, as_groups, as_matrix
from ...base.display import Shown
from ...base.errors import InvalidDataError
from ...risks import unit_actions
from .evidence import Explained, log_evidences
from .fitting import Fit, fit, noise
from .forces import Witness, witnesses
from .kinds import FLAT_KINDS, KINDS, Plane
from .mechanism import Mechanism, on_one_side, small_length
from .tied import TIED_KINDS
from .track import Track, noise_by_differences, winding

MOST_CERTAIN = 700.0
"""Logarithm of odds beyond which numbers end."""

FEWEST = 10
"""Samples of a demonstration."""

SMALLEST_MOVEMENT = 1e-12
"""Share of the numbers themselves below which positions differ by rounding."""

LIKELY = 20.0
"""Odds from which one kind is called decided."""

BEYOND, LASTING = 4.0, 10.0
"""Who spreads by so many times the usual noise in each direction moves there: noise that lasts looks free, too. What
lasts so many times longer than usual is a movement that no kind fits."""

FLAT = 10.0
"""A surface whose radius is more than so many times the extent of what was recorded is a plane to a robot."""

APART = "strokes from other starts would tell whether it is held"

NEAR = 0.15
"""A path is near a circle that it leaves by less than this share of the radius."""


@dataclass(frozen=True, eq=False, repr=False)
class Candidate(Shown):
    """One explanation of a recording.

    Parameters
    ----------
    mechanisms : tuple of Mechanism
        One for all demonstrations, or one for each, in the order of their sorted names.
    log_evidence : float
    noise : float
        Standard deviation from them in each direction that they hold; NaN where they hold none, or kinds differ.
    odds : tuple of float
        Of the kind of each against the next, where kinds differ; else empty.
    over_free : tuple of float
        By how much the log evidence of each is above that of nothing held, where some are free; else empty.
    flat : bool
        Whether each is a sphere or a cylinder so large that it is a plane to a robot.
    """

    mechanisms: tuple[Mechanism, ...]
    log_evidence: float
    noise: float
    odds: tuple[float, ...] = ()
    over_free: tuple[float, ...] = ()
    flat: bool = False

    @property
    def kind(self) -> str:
        """point, line, plane, circle, sphere, cylinder, screw; slider, hinge where orientations tell; free; mixture."""
        return "mixture" if self.odds else self.mechanisms[0].kind

    @property
    def kinds(self) -> list[str]:
        """Of each mechanism; undecided where that is, or a radius is not known; held, if only that is, beside free."""
        told = zip(self.odds or len(self.mechanisms) * (LIKELY,), self.mechanisms, strict=True)
        kinds = ["undecided" if odds < LIKELY or one.vague else one.kind for odds, one in told]
        held = [lead >= log(LIKELY) for lead in self.over_free or len(kinds) * (0.0,)]
        return ["held" if sure and kind == "undecided" else kind for sure, kind in zip(held, kinds, strict=True)]

    @property
    def free(self) -> int:
        """In how many directions it moves; the least of several."""
        return min(len(one.centre) - one.rank for one in self.mechanisms)

    def bends(self, other: Candidate) -> bool:
        """Whether the other is what it is where it does not bend."""
        straight = self.mechanisms[0].form.straight
        return straight is not None and not self.odds and straight.form.kind == other.kind

    def against(self, other: Candidate) -> float:
        """Odds against another."""
        return float(np.exp(min(self.log_evidence - other.log_evidence, MOST_CERTAIN)))

    @property
    def sentence(self) -> str:
        """Each mechanism in words."""
        each = "; ".join(mechanism.sentence for mechanism in self.mechanisms)
        return each if len(self.mechanisms) == 1 else f"{self.summary}: {each}"

    @property
    def summary(self) -> str:
        """One mechanism in words, or how many there are of which kind."""
        count = len(self.mechanisms)
        kinds = ", ".join(f"{kind} for {some}" for kind, some in Counter(self.kinds).items())
        each = kinds if self.odds else f"a {self.kind} for each"
        return self.mechanisms[0].sentence if count == 1 else f"{each} of {count} demonstrations"

    def _summary(self) -> tuple[str, ...]:
        return (self.sentence,)


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Shown):
    """All explanations, the likeliest first; each kind was as likely as any other before.

    Parameters
    ----------
    candidates : tuple of Candidate
    effective_samples : float
        Neighbours in time are partly copies of each other.
    witnesses : list of Witness
        What forces say of the directions that the likeliest mechanism holds; empty if none were given.
    demonstrations : int
    winding : bool
        Whether they turn more on their way than free ones do.
    """

    candidates: tuple[Candidate, ...]
    effective_samples: float
    witnesses: list[Witness]
    demonstrations: int = 1
    winding: bool = True

    @property
    def kind(self) -> str:
        """That of the likeliest."""
        return self.candidates[0].kind

    @property
    def mechanism(self) -> Mechanism:
        """The likeliest: a constraint, to be given to roll-outs. Of the first demonstration, if each has its own."""
        return self.candidates[0].mechanisms[0]

    @property
    def probabilities(self) -> dict[str, float]:
        """Of each kind."""
        values = np.array([candidate.log_evidence for candidate in self.candidates])
        shares = np.exp(values - values.max())
        kinds = np.array([candidate.kind for candidate in self.candidates])
        return {kind: float(shares[kinds == kind].sum() / shares.sum()) for kind in dict.fromkeys(kinds.tolist())}

    @property
    def odds(self) -> float:
        """Of the likeliest kind against the next."""
        return self.candidates[0].against(next(one for one in self.candidates if one.kind != self.kind))

    @property
    def decided(self) -> bool:
        """Whether a kind is likely enough to speak of, that of each where they differ, and each radius known at all."""
        first, *rest = self.candidates
        rival = next(one for one in rest if one.kind != first.kind and not (one.flat and one.bends(first)))
        return first.against(rival) >= LIKELY and not {"undecided", "held"} & {*first.kinds}

    @property
    def sentence(self) -> str:
        """The verdict in words: what it is, or what it may be, and what the forces say."""
        return self._judged(self.candidates[0].sentence)

    @property
    def summary(self) -> str:
        """The same, without each mechanism where every demonstration has its own."""
        return self._judged(self.candidates[0].summary)

    @property
    def doubt(self) -> str:
        """What a stroke by itself does not tell of its mechanism, in words; empty if there is nothing."""
        best = self.candidates[0]
        circle = next((one for one in self.candidates if one.kind == "circle"), best)
        near = circle.free == 1 and circle.noise < NEAR * circle.mechanisms[0].radius
        if self.habit or self.witnesses or self.demonstrations > 1 or best.free != 2 or not near:
            return self.habit
        lengths = circle.mechanisms[0].radius, circle.noise
        radius, strays = (small_length(one, self.mechanism.unit) for one in lengths)
        path = f"within the {best.kind} the path is near a circle of radius {radius}"
        return f"{path}, which it leaves by {strays}; {APART}"

    @property
    def habit(self) -> str:
        """Why free strokes may keep to the likeliest as well, in words; empty if they do not."""
        best = self.candidates[0]
        alone = self.demonstrations == len(best.mechanisms)
        if not alone or self.witnesses or best.free not in (1, len(self.mechanism.centre) - 1):
            return ""
        if best.free == 1:
            return f"a policy that keeps to this path within a surface looks the same in one stroke; {APART}"
        own = "surface" if best.odds else best.kind
        free = f"free strokes keep to a {own} of their own, too, where they turn as little as here; {APART}"
        return "" if self.winding else free

    def _judged(self, best: str) -> str:
        first = self.candidates[0]
        bent = [one for one in self.candidates if one.bends(first) and first.free == 2]
        rival = next(one for one in self.candidates if one.kind != self.kind and one not in bent)
        odds = first.against(rival)
        if odds < LIKELY or (not first.odds and "undecided" in first.kinds):
            rest = "" if first.odds else f"; or else {rival.summary} ({_said(odds)})"
            verdict = f"undecided: {best}{rest}".replace("undecided: undecided", "undecided")
        else:
            other = "nothing held" if rival.kind == "free" else f"a {rival.kind}"
            verdict = f"{best}, against {'one kind for all' if first.odds else other} {_said(odds)}"
        if bent and first.against(bent[0]) < LIKELY:
            large = f"or a {bent[0].kind} so large that it looks flat"
            bends = large if bent[0].flat else f"whether it bends a little, as a {bent[0].kind}, does not show"
            verdict += f"; {bends} ({_said(first.against(bent[0]))})"
        return "; ".join([verdict, *map(str, self.witnesses)])

    def _summary(self) -> tuple[str, ...]:
        return (self.sentence,)


def identify(
    positions: ArrayLike,
    orientations: ArrayLike | None = None,
    forces: ArrayLike | None = None,
    groups: Groups | None = None,
    unit: str = "",
) -> Identification:
    """Fit every kind of mechanism to recorded positions and compare them.

    Parameters
    ----------
    positions : array_like, shape (N, 2) or (N, 3)
        In the order of time within each demonstration.
    orientations : array_like, shape (N, 4), optional
        Quaternions (x, y, z, w) of what moves. They tell a hinge, whose tool turns with it, from a circle.
    forces : array_like, shape (N, 2) or (N, 3), optional
        On the mechanism, in N and in the frame of the positions, without the tool's weight.
    groups : sequence, shape (N,), optional
        Which demonstration each sample is from. One mechanism for all is compared with one for each.
    unit : str
        Of the positions, for sentences; empty where it is not known.

    Raises
    ------
    InvalidDataError
        If the tables do not fit together, a demonstration has fewer than ten samples, or nothing moves.

    Examples
    --------
    >>> turn, noise = np.linspace(0, 2, 50), np.random.default_rng(0).normal(scale=1e-3, size=(50, 2))
    >>> uc.constraints.identify(0.4 * np.column_stack([np.cos(turn), np.sin(turn)]) + noise).mechanism.kind
    'circle'
    """
    track, order, scale, origin = _track(positions, orientations, groups)
    pushed = None if forces is None else _as_long(forces, "forces", track.positions.shape)[order]
    every = _fits(track)
    apart = _strays(every[1:])
    times = [min(max(fit.time for fit in fits) for fits in one.values() if fits[0].mechanism.count) for one in every]
    longest = LASTING * float(np.median(times[1:] or times))
    usual = [time for k, time in enumerate(times[1:]) if k not in apart and time <= longest]
    time, white = min(times[0], max(usual or times)), noise_by_differences(track.positions, track.groups)
    twice = zip([*every, *every[1:]], [*len(every) * [time], *times[1:]], strict=True)
    found = [(fits, log_evidences(fits, each, white)) for fits, each in twice]
    whole, *alone = ([_candidate(one[key], worth[key], scale, origin, unit) for key in one] for one, worth in found)
    alone, own = alone[: len(every) - 1], alone[len(every) - 1 :]
    mixed = _mixtures(whole, own if (leads := _free(own)) else alone)
    free = next(one.log_evidence for one in whole if one.kind == "free")
    most = {kind: free - lead for kind, lead in leads.items()}  # where free ones end on one cycle, it seems to hold all
    whole = [replace(one, log_evidence=min(one.log_evidence, most.get(one.kind, np.inf))) for one in whole]
    mixed += _beside_free(every[1:], apart, (time, white), (scale, origin, unit))
    ranked = tuple(sorted([*whole, *mixed], key=lambda one: one.flat * log(LIKELY) - one.log_evidence))
    places = origin + scale * track.positions
    said = [] if pushed is None or ranked[0].odds else witnesses(ranked[0].mechanisms, places, pushed, track.groups)
    steps = [np.diff(one.positions, axis=0) for one in track.demonstrations]
    return Identification(ranked, len(order) / time, said, len(steps), winding(steps))


def _said(odds: float) -> str:
    return "more than 10000:1" if odds > 1e4 else f"{odds:.{0 if odds >= 10 else 1}f}:1"


def _track(
    positions: ArrayLike, orientations: ArrayLike | None, groups: Groups | None
) -> tuple[Track, NDArray[np.intp], float, Array]:
    """What was recorded, in its own units; the order of its rows, the unit, the origin."""
    table = as_matrix(positions, "positions")
    if table.shape[1] not in (2, 3):
        raise InvalidDataError(f"positions: got {table.shape[1]} columns, expected two or three.")
    names = as_groups(np.zeros(len(table)) if groups is None else groups, len(table))
    _, codes, counts = np.unique(names, return_inverse=True, return_counts=True)
    if counts.min() < FEWEST:
        raise InvalidDataError(f"positions: got a demonstration of {counts.min()} samples, expected at least {FEWEST}.")
    order = np.argsort(codes, kind="stable")
    origin = table.mean(axis=0)
    scale = float(np.sqrt(((table - origin) ** 2).sum(axis=1).mean()))
    if scale <= SMALLEST_MOVEMENT * float(np.abs(table).max()):
        raise InvalidDataError("positions: all rows are the same, expected a movement, or its noise at least.")
    quaternions = np.empty((len(table), 0))
    if orientations is not None:
        quaternions, lengths = unit_actions(_as_long(orientations, "orientations", (len(table), 4)))
        if table.shape[1] == 2 or not lengths.all():
            raise InvalidDataError("orientations: expected quaternions that are not zero, beside positions in space.")
    return Track((table[order] - origin) / scale, codes[order], quaternions[order]), order, scale, origin


def _as_long(values: ArrayLike, what: str, shape: tuple[int, ...]) -> Array:
    table = as_matrix(values, what)
    if table.shape != shape:
        raise InvalidDataError(f"{what}: got an array of shape {table.shape}, expected {shape}, a row for a position.")
    return table


def _fits(track: Track) -> list[Explained]:
    """Of all demonstrations, by one mechanism or by one for each; where there are several, then of each by itself."""
    kinds = FLAT_KINDS if track.dimensions == 2 else (*KINDS[:-1], *TIED_KINDS) if track.poses else KINDS
    every = [track, *parts] if len(parts := track.demonstrations) > 1 else parts
    whole, *alone = ({(kind, 1): _turned([fit(kind, one)]) for kind in kinds} for one in every)
    each = {(kind, len(parts)): _turned([one[kind, 1][0] for one in alone]) for kind in kinds[1:] if alone}
    return [whole | each, *alone]


def _turned(fits: list[Fit]) -> list[Fit]:
    """Their axes on one side."""
    return [Fit(it, one.track) for it, one in zip(on_one_side([one.mechanism for one in fits]), fits, strict=True)]


def _own(found: list[Candidate]) -> tuple[Candidate, float, dict[str, float]]:
    """Of one demonstration: the likeliest, or the straight one if that does as well; its odds, and lead on each."""
    best, *_ = ranked = sorted(found, key=lambda one: -one.log_evidence)
    own = next((one for one in ranked if best.bends(one) and best.against(one) < LIKELY), best)
    rival = next(one for one in ranked if one is not own and (own.free != 2 or not one.bends(own)))
    return own, own.against(rival), {one.kind: own.log_evidence - one.log_evidence for one in found}


def _mixtures(whole: list[Candidate], alone: list[list[Candidate]]) -> list[Candidate]:
    """Each with a kind of its own, if these differ: what each gains by it alone, less the price of which has which."""
    counts = Counter(_own(one)[0].kind for one in alone)
    if len(counts) < 2:
        return []
    own, odds, leads = zip(*map(_own, alone), strict=True)
    gains = {each: sum(lead[each.kind] for lead in leads) for each in whole if len(each.mechanisms) == len(alone)}
    best = min(gains, key=lambda each: gains[each])
    price = log(factorial(len(alone)) // prod(map(factorial, counts.values())) * len(leads[0]) ** (len(counts) - 1))
    told = best.log_evidence + gains[best] - price, np.nan, odds, tuple(lead["free"] for lead in leads)
    return [Candidate(tuple(one.mechanisms[0] for one in own), *(told if "free" in counts else told[:-1]))]


def _free(alone: list[list[Candidate]]) -> dict[str, float]:
    """Lead on each kind of those that alone are free, and move by more than noise every way; empty without any."""
    held = [sorted((one for one in found if one.kind != "free"), key=lambda one: -one.log_evidence) for found in alone]
    usual = BEYOND * float(np.median([first.noise for first, *_ in held] or [0.0]))
    wide = [min(one.noise for one in found if one.kind in ("line", "plane")) > usual for found in held]
    told = [(*_own(found), moves) for found, moves in zip(alone, wide, strict=True)]
    leads = [leads for own, odds, leads, moves in told if moves and own.kind == "free" and odds >= LIKELY]
    return {kind: sum(lead[kind] for lead in leads) for kind in leads[0]} if leads else {}


def _strays(alone: Sequence[Explained]) -> list[int]:
    """Those that stray from each kind by more than others do, and far from the straight ones: noise is common."""
    missed = [{key.form.kind: float(noise(fits)[:1].sum()) ** 0.5 for (key, _), fits in one.items()} for one in alone]
    least = [min(size for kind, size in one.items() if kind != "free") for one in missed]
    flat = [min(one["line"], one.get("plane", np.inf)) for one in missed]
    usual = BEYOND * float(np.median(least or [0.0]))
    return [k for k in range(len(alone)) if least[k] > usual and flat[k] > BEYOND * usual]


def _beside_free(every: Sequence[Explained], apart: Sequence[int], known: Any, place: Any) -> list[Candidate]:
    """Those that stray are free, the others of one kind, each with a mechanism of its own and the noise in common."""
    held = [one for k, one in enumerate(every) if k not in apart]
    if not 0 < len(apart) < len(held):
        return []
    fits = {key: _turned([one[key][0] for one in held]) for key in every[0]}
    loose = {key: [every[k][key][0] for k in apart] for key in every[0] if key[0].form.kind == "free"}
    found = ([(some[key], worth) for key, worth in log_evidences(some, *known).items()] for some in (fits, loose))
    others, [free] = ([_candidate(*one, *place) for one in each] for each in found)
    own, odds, leads = _own(others)
    value = own.log_evidence + free.log_evidence - log(comb(len(every), len(apart)) * len(leads))
    rest, kept = iter(free.mechanisms), iter(own.mechanisms)
    told = [(next(rest), LIKELY, 0.0) if k in apart else (next(kept), odds, leads["free"]) for k in range(len(every))]
    mechanisms, sure, lead = zip(*told, strict=True)
    return [Candidate(mechanisms, value, np.nan, sure, lead)] * (own.kind != "free")


def _candidate(fits: list[Fit], evidence: float, scale: float, origin: Array, unit: str) -> Candidate:
    variances = noise(fits)
    mechanisms = tuple(one.certain(variances).placed(scale, origin, unit) for one in fits)
    flat = all(one.mechanism.form.straight is Plane and one.mechanism.radius > FLAT * one.track.extent for one in fits)
    size = scale * float(np.sqrt(variances[0])) if len(variances) else np.nan
    return Candidate(mechanisms, evidence, size, flat=flat)
