"""What is guaranteed of a policy's motion, on which set and under which constraints; or what refutes it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.arrays import Array
from ..base.errors import SettingError
from ..models import spaces
from ..risks import null_space_projection
from .guided import Guided, formula_of
from .rollouts import rollout

TRIES = 60
"""States at which a guarantee is checked, a third of them free, the others on random planes."""

STEPS, NEAR = 800, 0.05
"""Of the movements by which a policy without a guarantee is refuted; ends are one within this share of the starts."""


@dataclass(frozen=True)
class Certificate:
    """What holds of a policy.

    Parameters
    ----------
    holds : bool
    said : str
        What is guaranteed, by what margin, where and under which constraints; or what was found against it.
    start, normal : ndarray, shape (n,), optional
        A counterexample, where there is one: a state, and the normal of a plane through it; None where it is free.

    Examples
    --------
    >>> uc.certify(lambda states: 0.5 * states, np.eye(2)).start.shape  # moves away from there
    (2,)
    """

    holds: bool
    said: str
    start: Array | None = None
    normal: Array | None = None


def certify(policy: Callable[[Array], Array], states: Array, seed: int = 0) -> Certificate:
    """Say what is guaranteed of a policy, or find a start, and a plane, from which it does not arrive.

    Parameters
    ----------
    policy : callable
        States (N, n) to velocities (N, n); :class:`Guided` has a guarantee by construction, affine models one by their
        eigenvalues (:class:`~unconstrain.Contracting` learns such ones), and any other policy none.
    states : ndarray, shape (N, n)
        Where it was learnt; starts are drawn around them.
    seed : int
        Of starts and planes.

    Examples
    --------
    >>> def policy(states):
    ...     return 0.5 * states  # leaves
    >>> uc.certify(policy, np.eye(2)).holds
    False
    """
    rng, middle = np.random.default_rng(seed), states.mean(axis=0)
    size = float(np.linalg.norm(states - middle, axis=1).max()) or 1.0
    starts = middle + 1.5 * size * rng.uniform(-1.0, 1.0, (TRIES, states.shape[1]))
    normals = rng.standard_normal(starts.shape)
    normals[::3] = 0.0  # free
    if isinstance(policy, Guided):
        far = middle + (starts - middle) * 10.0 ** rng.uniform(-3.0, 2.0, (TRIES, 1))
        return _guided(policy, far, normals)
    return _affine(policy, starts) or _blended(policy) or _refuted(policy, starts, normals, NEAR * size)


def _guided(policy: Guided, states: Array, normals: Array) -> Certificate:
    """Check what the construction promises at states near and far."""
    aim = policy.aim_
    projections = np.stack([null_space_projection(normal[None]) for normal in normals])
    velocities = np.einsum("tij,tj->ti", projections, policy.under(states, projections))
    slope = np.einsum("tij,tj->ti", projections, aim.potential.gradient(states))
    closed = _closed(policy)
    with np.errstate(invalid="ignore"):
        spare = aim.spare(states, velocities, slope)
        wrong = ~(spare >= -1e-9)
    if wrong.any() or not closed:
        at = int(wrong.argmax())
        why = "what guides it leads to more than one place" if not closed else "what guides it does not lead nearer"
        return _against(f"not guaranteed: {why}", states[at], normals[at])
    return Certificate(True, f"{aim.promise} Checked at {len(states)} states, a third of them free.")


def _closed(policy: Guided) -> bool:
    """Whether V is convex and grows in every direction."""
    potential, n = policy.potential_, len(policy.goal_)
    bends = potential.bends()[1]
    if bends.min() < -1e-9 * bends.max() or (potential.offsets < 0).any():
        return False
    around = np.random.default_rng(0).standard_normal((1000 * n, n))
    return bool((potential.gradient(policy.goal_ + 1e6 * np.vstack([around, -around])) != 0.0).any(axis=1).all())


def _affine(policy: Callable[[Array], Array], states: Array) -> Certificate | None:
    """Of a policy J x + b; None of any other."""
    ones, found = np.column_stack([states, np.ones(len(states))]), np.asarray(policy(states))
    jacobian = np.linalg.lstsq(ones, found)[0]
    if np.abs(ones @ jacobian - found).max() > 1e-9 * np.abs(found).max():
        return None
    rates, ways = np.linalg.eigh(0.5 * (jacobian[:-1] + jacobian[:-1].T))
    if rates[-1] < 0.0:
        return Certificate(
            True,
            f"From every state, free and under any flat constraint, movements come together at {-rates[-1]:.4g} per "
            "second or faster, and so end in one place: the policy is affine and contracts.",
        )
    if len(rates) == 1:
        return _against("not guaranteed: the policy is affine and does not contract", states[0], 0.0 * states[0])
    way = ways[:, -1]
    normal = np.linalg.svd(way[None])[2][-1]
    said = f"not guaranteed: the policy is affine and moves apart along ({_listed(way)}), at {rates[-1]:.4g} per second"
    return _against(said, states[0], normal)


def _blended(policy: Any) -> Certificate | None:
    """Of affine models that contract and rest in one place, however they are blended; None of any other policy.

    With z = x − x* and ``‖J_m‖ ≤ L`` a step changes ``‖z‖²`` by ``−2 Δt c ‖z‖² + Δt² L² ‖z‖²`` at most. On a surface
    whose nearest point is h from the goal, ``zᵀ N J_m h ≤ K ‖z‖ ‖h‖``, where a multiple of I in J_m does not count.
    """
    try:
        form = formula_of(policy)
    except SettingError:
        return None
    if form.monomials is not None or form.maps.shape[1:] != (len(form.origin), len(form.origin) + 1):
        return None
    jacobians, offsets = form.maps[..., :-1], form.maps[..., -1]
    rate = -float(np.linalg.eigvalsh(0.5 * (jacobians + jacobians.mT))[:, -1].max())
    if rate <= 0.0 or not isinstance(form.embedding.space, spaces.Euclidean):
        return None
    rests = -np.linalg.solve(jacobians, offsets[..., None])[..., 0]
    goal = rests.mean(axis=0)
    if np.abs(jacobians @ goal + offsets).max() > 1e-9 * np.abs(offsets).max():
        return None
    goal = np.where(np.abs(form.origin + goal) > 1e-12 * np.abs(form.origin).max(), form.origin + goal, 0.0)
    uneven = jacobians - np.trace(jacobians, axis1=1, axis2=2)[:, None, None] / len(goal) * np.eye(len(goal))
    most, skew = (float(np.linalg.norm(each, 2, axis=(1, 2)).max()) for each in (jacobians, uneven))
    return Certificate(
        True,
        f"From every state, movements arrive at ({_listed(goal)}), free and on every flat surface through it: the "
        f"distance to it falls at {rate:.4g} per second or faster, with Euler steps of up to "
        f"{2.0 * rate / most**2:.3g} s, since each of {len(rests)} affine models contracts and rests there. On a "
        f"surface that misses it they end within {skew / rate:.3g} times the distance between it and the surface's "
        "nearest point.",
    )


def _refuted(policy: Callable[[Array], Array], starts: Array, normals: Array, near: float) -> Certificate:
    """Look for a movement that does not arrive where most of the free ones do: free, or on a plane through there."""
    speed = float(np.median(np.linalg.norm(np.asarray(policy(starts)), axis=1)))
    dt = near / max(speed, np.finfo(float).tiny)
    free, far = normals == 0.0, 100.0 * near / NEAR
    middle = starts.mean(axis=0)

    def stopped(states: Array) -> Array:
        return np.where(np.linalg.norm(states - middle, axis=1, keepdims=True) < far, policy(states), 0.0)

    runs = rollout(stopped, starts[free[:, 0]], STEPS, dt, method="euler")
    space = getattr(policy, "space_", spaces.Euclidean(starts.shape[1]))  # ends that are turns apart may be one place
    last = np.stack([run.states[-1] for run in runs])
    late = np.stack([run.states[-STEPS // 4 :] for run in runs])
    on = np.linalg.norm(np.ptp(late, axis=1), axis=1)[np.linalg.norm(last - middle, axis=1) < far] > near
    goal = last[0] + np.median(space.difference(last, last[:1]), axis=0)
    units = normals / np.where(free, 1.0, np.linalg.norm(normals, axis=1, keepdims=True))
    starts = starts - units * np.vecdot(units, starts - goal)[:, None]
    runs = rollout(stopped, starts, STEPS, dt, lambda states, _: units[: len(states), None], method="euler")
    ends = np.stack([run.states[-1] for run in runs])
    away = np.linalg.norm(space.difference(ends, goal[None]), axis=1) > near
    if not away.any():
        return Certificate(False, f"nothing is guaranteed (see uc.Guided), but {TRIES} movements end in one place.")
    at = int(away.argmax())
    said = f"of {len(starts)} movements {away.sum()} do not end at ({_listed(goal)})"
    said = said if 2 * away.sum() <= len(away) else "movements do not end in one place"
    said = said if 2 * on.sum() <= len(on) else "movements go on, as on a cycle, and nothing keeps them to it"
    said = f"not guaranteed (see uc.Guided): {said}; one is at ({_listed(ends[at])}) after {STEPS * dt:.3g} s"
    return _against(said, starts[at], units[at])


def _against(said: str, start: Array, normal: Array) -> Certificate:
    held = f", on the plane with normal ({_listed(normal)})" if normal.any() else ", free"
    return Certificate(False, f"{said}; start ({_listed(start)}){held}.", start, normal if normal.any() else None)


def _listed(vector: Array) -> str:
    return ", ".join(f"{each:.4g}" for each in vector)
