"""The truth that demonstrations carry, laid end to end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import unconstrain as uc

from ...base.arrays import Array


def true_policy(demonstrations: Sequence[uc.Demonstration]) -> Array:
    """The policy at all samples, shape (N, d)."""
    return np.concatenate([demo.truth.policy for demo in demonstrations if demo.truth is not None])


def true_projections(demonstrations: Sequence[uc.Demonstration]) -> Array:
    """The projections N of all samples, shape (N, d, d)."""
    return np.concatenate([demo.truth.projections for demo in demonstrations if demo.truth is not None])


def was_free(demonstrations: Sequence[uc.Demonstration]) -> NDArray[np.bool_]:
    """Which samples nothing constrained, shape (N,)."""
    projections = true_projections(demonstrations)
    free: NDArray[np.bool_] = np.abs(projections - np.eye(projections.shape[1])).max(axis=(1, 2)) < 1e-9
    return free


def spread(demonstrations: Sequence[uc.Demonstration]) -> float:
    """Root-mean-square spread of the policy over its coordinates."""
    return float(np.sqrt(true_policy(demonstrations).var(axis=0).mean()))


def with_noise(
    demonstrations: Sequence[uc.Demonstration], share: float, rng: np.random.Generator
) -> list[uc.Demonstration]:
    """The same with normal noise on the actions, as a share of the policy's spread."""
    size = share * spread(demonstrations)
    return [
        replace(demo, actions=demo.actions + size * rng.standard_normal(demo.actions.shape)) for demo in demonstrations
    ]
