"""Which mechanism made these movements, and how sure is that."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...base.arrays import Array, Groups, as_groups, as_matrix
from ...base.display import Shown
from ...base.errors import InvalidDataError
from ...risks import unit_actions
from .evidence import Explained, log_evidences
from .fitting import Fit, fit, noise
from .forces import Witness, witnesses
from .kinds import FLAT_KINDS, KINDS, Free
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
    alone : tuple of Identification
        Each demonstration by itself, where their kinds differ; empty where all are of one kind.
    """

    mechanisms: tuple[Mechanism, ...]
    log_evidence: float
    noise: float
    alone: tuple[Identification, ...] = ()

    @property
    def kind(self) -> str:
        """point, line, plane, circle, sphere, cylinder, screw; slider, hinge where orientations tell; free; mixed."""
        return "mixed" if self.alone else self.mechanisms[0].kind

    @property
    def free(self) -> int:
        """In how many directions it moves."""
        return len(self.mechanisms[0].centre) - self.mechanisms[0].rank

    def bends(self, other: Candidate) -> bool:
        """Whether the other is what it is where it does not bend."""
        straight = self.mechanisms[0].form.straight
        mixed = self.alone or other.alone
        return not mixed and straight is not None and straight.form == other.mechanisms[0].form

    @property
    def sentence(self) -> str:
        """Each mechanism in words."""
        each = "; ".join(one.sentence for one in self.alone or self.mechanisms)
        return each if len(self.mechanisms) == 1 else f"{self.summary}: {each}"

    @property
    def summary(self) -> str:
        """One mechanism in words, or how many there are of which kind."""
        count = len(self.mechanisms)
        if self.alone:
            kinds = Counter(f"a {one.kind}" if one.decided else "undecided" for one in self.alone)
            return f"{', '.join(f'{kind} for {some}' for kind, some in kinds.items())} of {count} demonstrations"
        return self.mechanisms[0].sentence if count == 1 else f"a {self.kind} for each of {count} demonstrations"

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
        return {
            kind: float(sum(shares[[candidate.kind == kind for candidate in self.candidates]]) / shares.sum())
            for kind in dict.fromkeys(candidate.kind for candidate in self.candidates)
        }

    @property
    def odds(self) -> float:
        """Of the likeliest kind against the next."""
        return self._odds(next(one for one in self.candidates if one.kind != self.kind))

    @property
    def decided(self) -> bool:
        """Whether one kind, or that kinds differ, is likely enough to speak of, and its radius known at all."""
        return self.odds >= LIKELY and not self._vague

    @property
    def _vague(self) -> bool:
        return not self.candidates[0].alone and any(one.vague for one in self.candidates[0].mechanisms)

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
        best, apart = self.candidates[0], "strokes from other starts would tell whether it is held"
        if best.alone:
            return next((one.doubt for one in best.alone if one.doubt), "")
        alone = self.demonstrations == len(best.mechanisms)
        if not alone or self.witnesses or best.free not in (1, len(self.mechanism.centre) - 1):
            return ""
        if best.free == 1:
            return f"a policy that keeps to this path within a surface looks the same in one stroke; {apart}"
        if not self.winding:
            return f"free strokes keep to a {best.kind} of their own, too, where they turn as little as here; {apart}"
        circle = next((one for one in self.candidates if one.kind == "circle"), best)
        if self.demonstrations > 1 or not circle.noise < NEAR * circle.mechanisms[0].radius or circle.free != 1:
            return ""
        radius, strays = (
            small_length(each, self.mechanism.unit) for each in (circle.mechanisms[0].radius, circle.noise)
        )
        return (
            f"within the {best.kind} the path is near a circle of radius {radius}, which it leaves by {strays}; {apart}"
        )

    def _judged(self, best: str) -> str:
        bent = [one for one in self.candidates if one.bends(self.candidates[0]) and self.candidates[0].free == 2]
        rival = next(one for one in self.candidates if one.kind != self.kind and one not in bent)
        if self._odds(rival) < LIKELY or self._vague:
            verdict = f"undecided: {best}; or else {rival.sentence} ({_said(self._odds(rival))})"
        else:
            other = {"free": "nothing held", "mixed": "kinds that differ"}.get(rival.kind, f"a {rival.kind}")
            other = "one kind for all" if self.kind == "mixed" else other
            verdict = f"{best}, against {other} {_said(self._odds(rival))}"
        if bent and self._odds(bent[0]) < LIKELY:
            verdict += f"; whether it bends a little, as a {bent[0].kind}, does not show ({_said(self._odds(bent[0]))})"
        return "; ".join([verdict, *map(str, self.witnesses)])

    def _odds(self, other: Candidate) -> float:
        return float(np.exp(min(self.candidates[0].log_evidence - other.log_evidence, MOST_CERTAIN)))

    def _summary(self) -> tuple[str, ...]:
        return (self.sentence,)


def identify(
    positions: ArrayLike,
    orientations: ArrayLike | None = None,
    forces: ArrayLike | None = None,
    groups: Groups | None = None,
    unit: str = "m",
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
        Which demonstration each sample is from. One mechanism for all is compared with one for each, of one kind or of
        kinds that differ.
    unit : str
        Of the positions; empty where it is not known.

    Raises
    ------
    InvalidDataError
        If the tables do not fit together, a demonstration has fewer than ten samples, or nothing moves.
    """
    track, order, scale, origin = _track(positions, orientations, groups)
    pushed = None if forces is None else _as_long(forces, "forces", track.positions.shape)[order]
    whole, *alone = _fits(track)
    times = [min(max(fit.time for fit in fits) for fits in one.values() if fits[0].mechanism.count) for one in alone]
    longest = min(max(fit.time for fit in fits) for fits in whole.values() if fits[0].mechanism.count)
    white = noise_by_differences(track.positions, track.groups)
    setting = _Setting(min(longest, max(times, default=longest)), white, scale, origin, unit)
    parts = [None if pushed is None else pushed[track.groups == group] for group in np.unique(track.groups)]
    return _judged(whole, pushed, setting, [_judged(*one, setting) for one in zip(alone, parts, strict=False)])


def _said(odds: float) -> str:
    return "more than 10000:1" if odds > 1e4 else f"{odds:.{0 if odds >= 10 else 1}f}:1"


def _track(
    positions: ArrayLike, orientations: ArrayLike | None, groups: Groups | None
) -> tuple[Track, NDArray[np.intp], float, Array]:
    """What was recorded, in its own units; the order of its rows, the unit, the origin."""
    table = as_matrix(positions, "positions")
    if table.shape[1] not in (2, 3):
        raise InvalidDataError(f"positions: got {table.shape[1]} columns, expected two or three, in m.")
    names = as_groups(np.zeros(len(table)) if groups is None else groups, len(table))
    _, codes, counts = np.unique(names, return_inverse=True, return_counts=True)
    if counts.min() < FEWEST:
        raise InvalidDataError(
            f"positions: got a demonstration of {counts.min()} samples, expected at least {FEWEST} of each."
        )
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
        raise InvalidDataError(
            f"{what}: got an array of shape {table.shape}, expected {shape}, a row for each position."
        )
    return table


def _fits(track: Track) -> list[Explained]:
    """By kind, and by how many mechanisms there are: one for all demonstrations, or one for each; then those alone."""
    kinds = KINDS if track.dimensions == 3 else FLAT_KINDS
    if track.poses:
        kinds = (*kinds[:-1], *TIED_KINDS)
    parts = track.demonstrations
    alone = [{(kind, 1): _each([fit(kind, part)]) for kind in kinds} for part in parts if len(parts) > 1]
    each = {(kind, len(parts)): _each([one[kind, 1][0] for one in alone]) for kind in kinds[1:] if alone}
    return [{**{(kind, 1): _each([fit(kind, track)]) for kind in kinds}, **each}, *alone]


def _each(fits: list[Fit]) -> list[Fit]:
    """Their axes on one side."""
    turned = on_one_side([one.mechanism for one in fits])
    return [Fit(mechanism, one.track) for mechanism, one in zip(turned, fits, strict=True)]


class _Setting(NamedTuple):
    """What all explanations share: samples that are worth one, what is white, and where and how large the track is."""

    time: float
    white: float
    scale: float
    origin: Array
    unit: str


def _judged(
    explained: Explained, pushed: Array | None, setting: _Setting, alone: Sequence[Identification] = ()
) -> Identification:
    """All explanations of a recording, whose demonstrations were judged by themselves."""
    track = explained[Free, 1][0].track
    found = log_evidences(explained, setting.time, setting.white)
    every = [_candidate(fits, found[each], setting) for each, fits in explained.items()]
    candidates = tuple(sorted([*every, *_mixed(every, alone)], key=lambda each: -each.log_evidence))
    said: list[Witness] = []
    if pushed is not None and not candidates[0].alone:
        positions = setting.origin + setting.scale * track.positions
        said = witnesses(candidates[0].mechanisms, positions, pushed, track.groups)
    steps = [np.diff(one.positions, axis=0) for one in track.demonstrations]
    return Identification(candidates, len(track.positions) / setting.time, said, len(steps), winding(steps))


def _candidate(fits: list[Fit], evidence: float, setting: _Setting) -> Candidate:
    variances = noise(fits)
    scale, origin, unit = setting[2:]
    mechanisms = tuple(one.certain(variances).placed(scale, origin, unit) for one in fits)
    return Candidate(mechanisms, evidence, scale * float(np.sqrt(variances[0])) if len(variances) else np.nan)


def _mixed(candidates: Sequence[Candidate], alone: Sequence[Identification]) -> list[Candidate]:
    """Each demonstration with a kind of its own, if these differ: what that gains over the best kind for all of them.

    The gain is by what each is alone, with noise of its own on both sides; each choice but the first is paid for.
    """
    if len({one.kind for one in alone}) < 2:
        return []
    values = [{each.kind: each.log_evidence for each in one.candidates} for one in alone]
    same = {each: sum(one[each.kind] for one in values) for each in candidates if len(each.mechanisms) == len(alone)}
    best = max(same, key=lambda each: same[each])
    gain = sum(max(one.values()) for one in values) - same[best] - (len(alone) - 1) * np.log(len(values[0]))
    mechanisms = tuple(one.mechanism for one in alone)
    return [Candidate(mechanisms, best.log_evidence + float(gain), np.nan, tuple(alone))]
