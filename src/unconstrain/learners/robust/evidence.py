"""What the actions show of the policy, whatever the constraints and the prior; the basis of what counts as determined.

An action shows the policy along itself only. Noise adds a component along directions in which nobody ever moved; its
expectation is subtracted. To a learner by segments, a demonstration that was held in one plane all the time is taken
to show all components in it, unless it went about one place at one distance: so do cranks. A rail of another bend looks
as its plane does.

A direction that a learner may call determined must be shown by more than two
demonstrations: constraints that one or two met, or that all had in common, may have hidden anything there.

That samples look free is evidence too, but free and always held in the same way look alike. It counts along those
directions of action space only in which there was motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...base.display import counted_off
from ...risks import Quadratic, inconsistency
from ...training import Samples
from .constants import EIGENVALUE_STANDARD_ERRORS, LEAST_MISFIT, LEFT_OUT, MOST_PARTS
from .noise import (
    beyond_misfit,
    consistency_residuals,
    corrected,
    correlation_time,
    inefficiency,
    most_noise,
    noise_of_each,
)
from .pivot import pivot_of
from .segments import held_throughout


@dataclass(frozen=True, eq=False)
class Evidence:
    """Information on the weights in units of its variance, by parts of the data, for each of M models.

    Parameters
    ----------
    consistent : list of Quadratic
        −2 times the log-likelihood of the part's actions along themselves, less what noise adds to it, or along all
        directions in which a demonstration moved that was held in the same way all the time.
    free : ndarray, shape (K, M, P, P)
        Information of its samples as far as they look free.
    seen : ndarray, shape (M, d, d)
        Projection onto the directions of action space in which there was motion.
    error : ndarray, shape (M,)
        Standard error of the noise that was subtracted of samples along themselves, as a share of ``Σ w φφᵀ ⊗ I``.
    """

    consistent: list[Quadratic]
    free: Array
    seen: Array
    error: Array

    @property
    def hessians(self) -> Array:
        """Both kinds of information, shape (K, M, P, P)."""
        return np.stack([one.hessian for one in self.consistent]) + self.free

    def gradients(self, weights: Array) -> Array:
        """Half the slope of each part's log-likelihood at some weights (M, P), shape (K, M, P)."""
        return np.stack([one.linear - np.einsum("mij,mj->mi", one.hessian, weights) for one in self.consistent])


def shown(samples: Samples, policy: Array, variance: float, free: Array, by_segments: bool = False) -> Evidence:
    """The evidence of all samples.

    Parameters
    ----------
    samples : Samples
    policy : ndarray, shape (N, d)
        Predictions, from which the residuals' variance is taken.
    variance : float
        Of the residuals per action coordinate.
    free : ndarray, shape (N,)
        Probability that each sample was free.
    by_segments : bool
        Whether demonstrations that were held in the same way all the time show more than samples along themselves.
    """
    least = min(variance, most_noise(samples))
    noise = max(least, LEAST_MISFIT**2 * samples.energy)  # variance on each coordinate
    time = correlation_time(consistency_residuals(samples, policy, noise)[:, None], samples.groups)
    unit, parts = _residual(samples, policy, noise, time), parts_of(samples)
    seen = _seen(samples, parts, noise, time)
    consistent, as_free, free = [], [], _of_free_demonstrations(samples, free)
    held, moved, sure = _held(samples, by_segments)
    missed = _missed(samples[held], policy[held], moved[held], noise)
    for part in counted_off(range(int(parts.max()) + 1), "evidence: part"):
        rows = parts == part
        some, turned = samples[rows], np.where(held[rows], 0.0, 1.0)
        weighted, plain = (some.moments(some.actions, turned * by) for by in ((some.actions**2).sum(axis=1), 1.0))
        own = (1.0 / unit) * inconsistency(corrected(weighted, plain, noise))
        if held[rows].any():
            own = own + (1.0 / missed) * samples[rows & held].constrained(sure[rows & held])
        consistent.append(own)
        as_free.append(_as_free(some, free[rows] / (max(variance, noise) * time), noise, seen))
    error = EIGENVALUE_STANDARD_ERRORS * noise * np.sqrt(2.0 * time / np.maximum(samples.sizes, 1.0)) / unit
    return Evidence(consistent, np.stack(as_free), seen, error)


def _held(samples: Samples, by_segments: bool) -> tuple[NDArray[np.bool_], Array, Array]:
    """Which samples are of demonstrations that were held all the time, (N,), where these moved, and what they show.

    Both are (N, d, d). Noise of variance σ² turns N̂ by a mean square of ``t = σ² Σ 1 / λ`` over the eigenvalues of
    ``Σ u uᵀ``: along what was held it seems to show as much, and ``N̂ − t (I − N̂)`` shows nothing there on average.
    None are of a policy that was not learnt by segments.
    """
    if not by_segments:
        nowhere = np.zeros((len(samples), samples.actions.shape[1], samples.actions.shape[1]))
        return np.zeros(len(samples), dtype=bool), nowhere, nowhere
    noise = beyond_misfit(noise_of_each(samples.actions, samples.groups, most_noise(samples), samples.noise), samples)
    held, moved = held_throughout(samples.actions, samples.groups, noise)
    sure, d = moved.copy(), samples.actions.shape[1]
    for group in np.unique(samples.groups[held]):
        rows = samples.groups == group
        own, onto = samples[rows], moved[rows][0]
        rank = round(np.trace(onto))
        held[rows] = rank > 0 and (rank == 1 or pivot_of(_path(own), own.actions) is None)
        if rank:
            squares = np.linalg.eigvalsh(onto @ own.actions.T @ own.actions @ onto)[-rank:]
            sure[rows] -= min(float(noise[rows].mean() * (1.0 / squares).sum()), 1.0) * (np.eye(d) - onto)
    return held, moved, sure


def _path(samples: Samples) -> Array:
    """States of one demonstration, or where its actions lead, in unknown units, where these are not of that shape."""
    alike = samples.states.shape == samples.actions.shape
    return samples.states if alike else np.cumsum(samples.actions, axis=0) - 0.5 * samples.actions


def _missed(samples: Samples, policy: Array, moved: Array, noise: float) -> Array:
    """Variance of what a policy misses along ``moved`` (N, d, d), per coordinate, times its inefficiency, (M,)."""
    if not len(samples):
        return np.ones(samples.memberships.shape[1])
    off = np.einsum("nab,nb->na", moved, samples.actions - policy)
    coordinates = float(samples.counts @ np.einsum("naa->n", moved))
    square = max(float(samples.counts @ np.vecdot(off, off)) / coordinates, noise)
    time = correlation_time(off, samples.groups)
    return np.asarray(time * noise + inefficiency(time, samples) * (square - noise))


def _as_free(samples: Samples, precision: Array, noise: float, seen: Array) -> Array:
    """Information ``Σ w φφᵀ ⊗ Q`` of free samples, (M, P, P), where Q is ``seen``.

    Of demonstrations only that moved along all of Q: one that did not looks the same if it was held.
    """
    d, p = samples.actions.shape[1], samples.regressors
    whole, rank = 0.0, np.einsum("maa->m", seen)

    def spans(moved: Array) -> Array:
        return np.asarray(np.einsum("mab,ab->m", seen, moved) > rank - 0.5, dtype=np.float64)

    for group in np.unique(samples.groups):
        rows = samples.groups == group
        moved = _moved(samples.actions[rows], samples.counts[rows], noise)
        gram = samples[rows].moments(np.ones((rows.sum(), 1)), precision[rows]).gram
        whole = whole + np.einsum("m,mij,mkl->mikjl", spans(moved), gram, seen)
    return np.asarray(whole).reshape(-1, p * d, p * d)


def _moved(actions: Array, counts: Array, noise: float) -> Array:
    """Projection onto the directions in which there was motion beyond the noise, (d, d)."""
    values, axes = np.linalg.eigh((actions.T * counts) @ actions / counts.sum())
    basis = axes[:, values > noise * (1.0 + EIGENVALUE_STANDARD_ERRORS * np.sqrt(2.0 / counts.sum()))]
    return np.asarray(basis @ basis.T)


def _of_free_demonstrations(samples: Samples, free: Array) -> Array:
    """The probability of being free, and zero where it may be chance, or a hinge looks the same.

    That is in demonstrations of which most was not free, and in those that went about one place at one distance.
    """
    of_group, counts = (np.bincount(samples.groups, samples.counts * one) for one in (free, np.ones(len(free))))
    mostly = of_group > 0.5 * counts
    for group in np.flatnonzero(mostly):
        rows = samples.groups == group
        mostly[group] = pivot_of(_path(samples[rows]), samples.actions[rows]) is None
    return np.asarray(free * mostly[samples.groups])


def parts_of(samples: Samples) -> NDArray[np.intp]:
    """What is left out together, (N,): demonstrations, or the folds where these are many or there is only one."""
    few = 1 <= samples.groups.max() < MOST_PARTS or samples.folds.max() < LEFT_OUT
    return samples.groups if few else samples.folds


def surely(parts: Array, least: float) -> Array:
    """Orthonormal basis, (P, S), of what K symmetric matrices (K, P, P) exceed in sum, whichever two are left out.

    Successively without every two: eigenvectors whose eigenvalues are then up to ``least`` are given up.
    """
    left_out = np.array(list(combinations(range(len(parts)), min(LEFT_OUT, len(parts)))))
    rests, basis = parts.sum(axis=0) - parts[left_out].sum(axis=1), np.eye(parts.shape[1])
    if _exceed(rests, least):
        return basis
    for rest in rests:
        inner = basis.T @ rest @ basis
        if not _exceed(inner, least):
            values, axes = np.linalg.eigh(inner)
            basis = basis @ axes[:, values > least]
    return basis


def _exceed(matrices: Array, least: float) -> bool:
    """Whether all eigenvalues of all matrices (..., P, P) are above some number."""
    try:
        np.linalg.cholesky(matrices - least * np.eye(matrices.shape[-1]))
    except np.linalg.LinAlgError:
        return False
    return True


def _seen(samples: Samples, parts: NDArray[np.intp], noise: float, time: float) -> Array:
    """Projection onto the directions in which there was motion in each model's field, (M, d, d)."""
    counted, d = samples.counts[:, None] * samples.memberships, samples.actions.shape[1]
    squares = []
    for part in range(int(parts.max()) + 1):
        mine, u = counted[parts == part], samples.actions[parts == part]
        white = noise * mine.sum(axis=0)[:, None, None] * np.eye(d)
        squares.append(np.einsum("nm,na,nb->mab", mine, u, u, optimize=True) - white)
    least = noise * (1.0 + EIGENVALUE_STANDARD_ERRORS * np.sqrt(2.0 * time * np.maximum(samples.sizes, 1.0)))
    bases = (surely(np.stack(squares)[:, model], float(at)) for model, at in enumerate(least))
    return np.stack([basis @ basis.T for basis in bases])


def _residual(samples: Samples, policy: Array, noise: float, time: float) -> Array:
    """Mean square of ρ times the statistical inefficiency, (M,): that of the misfit has at most P values."""
    d, counts = samples.actions.shape[1], samples.counts / samples.counts.sum()
    white = noise * float(counts @ (policy**2).sum(axis=1)) + 2 * d * noise**2
    chance = 1.0 + EIGENVALUE_STANDARD_ERRORS * np.sqrt(2.0 * time / len(samples))
    misfit = max(float(counts @ consistency_residuals(samples, policy, noise) ** 2) - chance * white, 0.0)
    return time * white + inefficiency(time, samples) * misfit
