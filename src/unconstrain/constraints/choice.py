"""Which form a constraint has: the simplest that is, on demonstrations held out, as good as any to a standard error.

A form is judged by what moves along the directions that it holds, and by how many these are where movements cross each
other. Where the motion is one function of the state, more directions are no merit: across it there always is a further
one, for features that are flexible enough.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, check_learnt
from ..base.display import counted, percent
from ..base.errors import InvalidDataError
from .evidence import Evidence, Kept
from .forms import Form, Lifted
from .spectrum import HELD, Fields

SMOOTHNESS = (1.0, 1e-2, 1e-4, 0.0)
"""Strengths of the prior that are tried where features have a roughness."""

EXACT = 1e-24
"""Less motion along what is held, as a share of the mean square, is rounding."""

LOOSE = 0.3
"""Nothing is held where the best direction moves by this share of the mean square or more."""

PROPORTIONAL = 0.25
"""No function of the state holds what moves along, squared, by this share of the square of the motion that is free."""

DOUBTFUL = 0.05
"""From this share on, of either, there is a doubt."""

ONE_WAY = 0.5
"""Motion of which the state explains more than this share, where held out, is one function of it."""


@dataclass(frozen=True, eq=False)
class Choice:
    """The form that was taken, solved over everything.

    Parameters
    ----------
    name : str
        Of the features; empty for those that were given.
    form : Form
    smoothness : float
        Strength of the prior.
    fields : Fields
    noise : float
        Standard deviation along each held direction, in units of the action.
    held_out : float
        Mean square along held directions where held out, as a share of that of all actions.
    proportional : float
        How it grows with the square of the free motion: zero for noise alone.
    explained : float
        Share of the motion that is a function of the state, where held out.
    candidates : dict
        ``held_out`` of each form.
    columns, actions : int
        Dimensions n and d.
    unit : float
        Of the actions.
    several : bool
        Whether it is of several demonstrations.
    wound : bool, optional
        Whether they turn more on their way than free ones do, if that is known.
    """

    name: str
    form: Form
    smoothness: float
    fields: Fields
    noise: float
    held_out: float
    proportional: float
    explained: float
    candidates: Mapping[str, float]
    columns: int
    actions: int
    unit: float
    several: bool = False
    wound: bool | None = None

    def missed(self, states: Array, actions: Array) -> float:
        """Mean square along held directions, as a share of that of all actions, of others than were learnt from."""
        samples = self.form.lift(states, actions / self.unit)
        rows, one = self.fields.rows(samples), np.zeros(len(states), dtype=np.intp)
        others = Kept(one.astype(np.uint64), states, actions / self.unit, np.ones(len(states)), one)
        return _missed(rows, self.fields.residuals(samples, rows), others).share

    def checked(self) -> Choice:
        """Itself, if it is finite.

        Raises
        ------
        InvalidDataError
            If the fields are not finite.
        """
        check_learnt(self.fields.coefficients)
        return self

    @property
    def lacking(self) -> bool:
        """Whether movements were not recorded that would tell what is held."""
        return self.one_way or self.fields.next < HELD

    @property
    def one_way(self) -> bool:
        """Whether the motion is one function of the state, with or without anything that holds it.

        Across it there always is a direction that varies with the state: of an affine motion, its product with any
        skew-symmetric matrix. A constant direction is no matter of course, nor is a surface that all points are on.
        """
        anyway = self.fields.rank == self.actions - 1 or not self.form.constant
        return anyway and self.explained > ONE_WAY

    @property
    def doubts(self) -> tuple[str, ...]:
        """What the data does not tell, in sentences."""
        said = []
        if self.wound is False and not self.several:
            said.append("Free strokes that turn as little keep to a surface of their own, too: record ways that cross.")
        if self.one_way:
            said.append(
                "At each state only one direction was seen: a free policy that is a function of the state looks the "
                "same. Record movements that cross each other, or name the features."
            )
        if self.fields.next < HELD and self.fields.rank < self.actions - 1:
            said.append(
                f"One direction more moves by only {self.fields.next:.1g} of what is free: it is held, too, with more "
                "noise, or nobody wanted to move along it."
            )
        if max(self.held_out, self.proportional) > DOUBTFUL:
            faster = f", {percent(self.proportional)} where movements are fast" if self.proportional > DOUBTFUL else ""
            differs = ", or differs between demonstrations" if self.several else ""
            said.append(
                f"Along the held directions moves {percent(self.held_out)} of a mean square action{faster}: noise, or "
                f"the constraint is not quite of this form{differs}."
            )
        return tuple(said)


def chosen(evidence: Evidence) -> Choice:
    """Compare all forms, and solve the one that is taken.

    Raises
    ------
    InvalidDataError
        If no direction is held, as far as can be told.
    """
    kept = evidence.kept
    assert kept is not None
    tried = [
        _Trial.of(name, strength, evidence)
        for name, form in evidence.forms.items()
        for strength in (SMOOTHNESS if hasattr(form.model.features, "roughness") else (0.0,))
    ]
    margin = evidence.forms[tried[0].name].chart.margin
    explained = max(one.explained for one in tried)
    counts = explained <= ONE_WAY and margin == 0.0  # points of a surface have no motion to tell
    losses = [one.held_out.by_fold * (round(one.held_out.rank) if counts else 1) for one in tried]
    best = tried[simplest(np.stack(losses), margin)]
    _check(best, len(kept.keys))
    motion = float(np.average((kept.actions**2).mean(axis=1), weights=kept.weights))
    noise = evidence.unit * float(np.sqrt(motion * np.sqrt(best.fitted.share * best.held_out.share)))
    shares = {name: min(one.held_out.share for one in tried if one.name == name) for name in evidence.forms}
    sizes = kept.states.shape[1], kept.actions.shape[1]
    form, several = evidence.forms[best.name], evidence.split is not None
    told = noise, best.held_out.share, best.held_out.rate, explained, shares
    return Choice(best.name, form, best.strength, best.fields, *told, *sizes, evidence.unit, several)


def simplest(losses: Array, margin: float = 0.0) -> int:
    """The first candidate (C, folds) that is behind the best by at most a standard error, paired, and a margin."""
    behind = losses - losses[int(losses.mean(axis=1).argmin())]
    error = behind.std(axis=1) / np.sqrt(max(behind.shape[1] - 1, 1))
    return int((behind.mean(axis=1) <= error + margin + 1e-9).argmax())


class _Missed(NamedTuple):
    """Mean square along held directions, over that of actions; its slope in the free one; its log by fold; rank."""

    share: float
    rate: float
    by_fold: Array
    rank: float


def _missed(rows: Array, residuals: Array, kept: Kept) -> _Missed:
    squares, actions = (kept.actions**2).sum(axis=1), kept.actions.shape[1]
    motion = max(float(np.average(squares, weights=kept.weights)) / actions, np.finfo(float).tiny)
    held = (rows**2).sum(axis=(1, 2))
    weights = kept.weights * (held > 0.0)
    if not weights.any():
        return _Missed(1.0, 0.0, np.zeros(len(np.unique(kept.folds))), 0.0)
    along = (residuals**2).sum(axis=1) / np.maximum(held, 1.0)
    moved = (np.einsum("nkd,nd->nk", rows, kept.actions) ** 2).sum(axis=1)
    free = (squares - moved) / np.maximum(actions - held, 1.0)
    free = free - weights @ free / weights.sum()
    rate = float(weights @ (free * along) / max(weights @ free**2, np.finfo(float).tiny))
    counts, sums = np.bincount(kept.folds, weights), np.bincount(kept.folds, weights * along)
    means = np.where(counts > 0.0, sums / np.where(counts > 0.0, counts, 1.0), motion)[np.unique(kept.folds)]
    share, rank = float(weights @ along / weights.sum()) / motion, float(np.average(held, weights=kept.weights))
    return _Missed(share, rate, np.log(np.maximum(means / motion, EXACT)), rank)


def _explained(samples: Lifted, kept: Kept) -> float:
    """Share of the actions that their regression on the features and the state explains where held out, by moments."""
    table = np.column_stack([samples.features, kept.states, np.ones(len(kept.keys)), kept.actions])
    parts = [
        table[kept.folds == fold] * np.sqrt(kept.weights[kept.folds == fold, None]) for fold in np.unique(kept.folds)
    ]
    grams, p = np.stack([part.T @ part for part in parts]), table.shape[1] - kept.actions.shape[1]
    missed = 0.0
    for gram, rest in zip(grams, grams.sum(axis=0) - grams, strict=True):
        known = np.linalg.lstsq(rest[:p, :p], rest[:p, p:], rcond=1e-12)[0]
        missed += float(np.trace(gram[p:, p:] - 2.0 * known.T @ gram[:p, p:] + known.T @ gram[:p, :p] @ known))
    return 1.0 - missed / max(float(np.trace(grams[:, p:, p:].sum(axis=0))), np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class _Trial:
    """One form with one strength of the prior: solved, and what it misses in and out of sample."""

    name: str
    strength: float
    fields: Fields
    fitted: _Missed
    held_out: _Missed
    explained: float

    @classmethod
    def of(cls, name: str, strength: float, evidence: Evidence) -> _Trial:
        form, pencil, kept = evidence.forms[name], evidence.pencils[name], evidence.kept
        assert kept is not None
        samples, filled = form.lift(kept.states, kept.actions), pencil.filled
        rough = strength * form.roughness(samples)

        def solved(folds: NDArray[np.intp]) -> Fields:
            motion, size, weight = pencil.means(folds)
            return Fields.of(motion + rough * np.trace(motion), size, weight)

        explained = _explained(samples, kept)
        whole = solved(filled).ranked(samples, explained <= ONE_WAY)
        rows = whole.rows(samples)
        missed = whole.residuals(samples, rows)
        fitted = _missed(rows, missed, kept)
        counting = (rows != 0.0).any(axis=2, keepdims=True)  # which are held may change with the state
        for fold in filled if len(filled) > 1 else ():
            held, rest = kept.folds == fold, replace(solved(filled[filled != fold]), rank=whole.rank)
            rows[held] = np.where(counting[held], rest.rows(samples.at(held)), 0.0)
            missed[held] = rest.residuals(samples.at(held), rows[held])
        return cls(name, strength, whole, fitted, _missed(rows, missed, kept), explained)


def _check(best: _Trial, samples: int) -> None:
    """Refuse too few samples, and what nothing holds."""
    share, rate = best.held_out[:2]
    if samples < len(best.fields.coefficients):
        raise InvalidDataError(
            f"got {counted(samples, 'different sample')} for {len(best.fields.coefficients)} coefficients, "
            "expected at least as many: record more, or name simpler features."
        )
    if share >= LOOSE:
        raise InvalidDataError(
            f"no direction is held: along the best one that is a function of the state, {percent(share)} of a mean "
            "square action moves where held out. The data is free, or constraints differ by demonstration: fit each "
            "by itself, and of joint angles that a hand's constraint holds, with jacobian=."
        )
    if rate >= PROPORTIONAL:
        raise InvalidDataError(
            f"no function of the state holds this data: where held out, along the best directions moves "
            f"{percent(rate)} of the square of the free motion, and not noise alone. Constraints may differ between "
            "demonstrations: fit each by itself, or name other features."
        )
