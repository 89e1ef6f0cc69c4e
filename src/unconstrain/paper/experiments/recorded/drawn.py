"""Recorded movements, their velocities projected by constraints that are drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

import unconstrain as uc

from ....base.arrays import Array
from ....risks import null_space_projection, project

Constraints = Callable[[np.random.Generator, Sequence[uc.Demonstration]], list[Array]]
"""Draws, for each demonstration, the projection at each sample, (T, d, d)."""

SWITCHES = 2
"""How often a constraint that switches does so in a demonstration, as in section IV-A."""

TURN = 0.4
"""How far a normal that varies turns: the standard deviation of its slope along each action coordinate."""


def project_all(demonstrations: Sequence[uc.Demonstration], projections: Sequence[Array]) -> list[uc.Demonstration]:
    """What is observed of free velocities under constraints: ``u = N v``, with the velocity as the truth."""
    return [
        replace(demo, actions=project(N, demo.actions), truth=uc.Truth(demo.actions, N))
        for demo, N in zip(demonstrations, projections, strict=True)
    ]


def switching(rng: np.random.Generator, demonstrations: Sequence[uc.Demonstration]) -> list[Array]:
    """One direction is blocked at a time, another from each switch on."""
    found = []
    for demo in demonstrations:
        assert demo.times is not None
        d = demo.actions.shape[1]
        lines = uc.constraints.SwitchingLine.random(rng, float(demo.times[-1]), SWITCHES, d)
        found.append(null_space_projection(lines(demo.states, demo.times)))
    return found


def one_each(rng: np.random.Generator, demonstrations: Sequence[uc.Demonstration]) -> list[Array]:
    """One direction is blocked throughout each demonstration."""
    normals = rng.standard_normal((len(demonstrations), demonstrations[0].actions.shape[1]))
    return [_across(np.tile(normal, (len(demo), 1))) for normal, demo in zip(normals, demonstrations, strict=True)]


def half_free(rng: np.random.Generator, demonstrations: Sequence[uc.Demonstration]) -> list[Array]:
    """Every second demonstration is free; one direction is blocked throughout each of the others."""
    projections = one_each(rng, demonstrations)
    free = np.eye(projections[0].shape[1])
    return [np.tile(free, (len(N), 1, 1)) if index % 2 else N for index, N in enumerate(projections)]


def varying(rng: np.random.Generator, demonstrations: Sequence[uc.Demonstration]) -> list[Array]:
    """A normal of each demonstration's own that turns slowly with the state."""
    states = uc.stack(demonstrations).states
    middle, scale = states.mean(axis=0), states.std(axis=0).max()
    n, d = states.shape[1], demonstrations[0].actions.shape[1]
    found = []
    for demo in demonstrations:
        drawn = rng.standard_normal(d)
        normal = drawn / np.linalg.norm(drawn)
        slopes = TURN / np.sqrt(n) * (demo.states - middle) / scale @ rng.standard_normal((n, d))
        found.append(_across(normal + slopes - np.outer(slopes @ normal, normal)))
    return found


def deepened(flat: Sequence[uc.Demonstration], other: Sequence[uc.Demonstration]) -> list[uc.Demonstration]:
    """Movements in the plane with a third coordinate: the first of another movement, at the same share of its way."""
    found = []
    for index, demo in enumerate(flat):
        assert demo.times is not None
        depth = other[index % len(other)].states[:, 0]
        along = np.interp(np.linspace(0, 1, len(demo)), np.linspace(0, 1, len(depth)), depth)
        speed = np.gradient(along, demo.times)
        states, actions = np.column_stack([demo.states, along]), np.column_stack([demo.actions, speed])
        found.append(replace(demo, states=states, actions=actions, noise=None))
    return found


def _across(normals: Array) -> Array:
    """Projections (T, d, d) that take away what is along the normals (T, d)."""
    return null_space_projection(normals[:, None, :])
