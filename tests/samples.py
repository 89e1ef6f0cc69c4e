"""Data to learn from, drawn from a seed, with the truth that made it."""

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

import unconstrain as uc
from unconstrain import training


class Samples(NamedTuple):
    """States (N, n), actions (N, d), their groups, and what made them."""

    states: np.ndarray
    actions: np.ndarray
    groups: np.ndarray
    policy: np.ndarray
    projections: np.ndarray


def spiral(states):
    """A smooth policy in the plane that no affine map and no few kernels fit exactly."""
    x, y = states[:, 0], states[:, 1]
    return np.column_stack([y + 0.3 * x**2, -x + 0.5 * np.sin(2 * y)])


def draw(seed=0, samples=90, groups=6, noise=0.02, constrained=True, policy=spiral, dimensions=2):
    """Samples of a policy, each behind its own random one-dimensional constraint."""
    rng = np.random.default_rng(seed)
    states = rng.uniform(-1, 1, (samples, dimensions))
    wanted = policy(states)
    d = wanted.shape[1]
    projections = np.tile(np.eye(d), (samples, 1, 1))
    if constrained:
        normals = rng.standard_normal((samples, d))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        projections -= normals[:, :, None] * normals[:, None, :]
    actions = np.stack([N @ u for N, u in zip(projections, wanted, strict=True)])
    actions += noise * rng.standard_normal(actions.shape)
    return Samples(states, actions, np.arange(samples) % groups, wanted, projections)


def rotation(seed, d):
    """A random rotation of d dimensions."""
    Q, R = np.linalg.qr(np.random.default_rng(seed).standard_normal((d, d)))
    return Q * np.sign(np.diagonal(R))


def samples_of(data, groups=None, features=None, models=1):
    """Samples with plain features, one model unless told."""
    count = len(data.states)
    phi = np.column_stack([data.states, np.ones(count)]) if features is None else features
    rng = np.random.default_rng(0)
    share = rng.uniform(0.1, 1.0, (count, models))
    named = data.groups if groups is None else groups
    return training.Samples(
        data.states,
        phi,
        data.actions,
        np.ones(count),
        share,
        share / share.sum(axis=1, keepdims=True),
        named,
        np.unique(named, return_inverse=True)[1],
        np.tile(np.eye(phi.shape[1]), (models, 1, 1)),
        np.zeros((models, phi.shape[1], phi.shape[1])),
        np.arange(count),
    )


def seen(folds):
    """What a learner that needs sums alone looks at."""
    return SimpleNamespace(folds=folds)


def on_plates(normals, policy, noise=0.0):
    """Strokes of a policy in three dimensions, each in a plane of its own."""
    rng, demos, angle = np.random.default_rng(3), [], np.linspace(0, 6, 60)
    circle = np.column_stack([np.cos(angle), np.sin(angle), np.cos(angle + 1)])
    for normal in np.array(normals):
        onto = np.eye(3) - np.outer(normal, normal) / (normal @ normal)
        states = (circle + rng.uniform(-0.5, 0.5, 3)) @ onto
        demos.append(uc.Demonstration(states, policy(states) @ onto + rng.normal(0, noise, (60, 3))))
    return demos


def turning(states):
    """A policy in three dimensions."""
    return states @ np.array([[-1.0, 0.8, 0.2], [-0.8, -1.0, 0.5], [-0.2, -0.5, -0.8]]).T


PLATES = [(0.0, 0.0, 1.0), (0.4, 0.0, 1.0), (0.0, -0.5, 1.0)]


def off_everywhere(states):
    """Another policy than :func:`turning`, in all directions."""
    return turning(states) + np.stack([states[:, 1], 0.5 * states[:, 0], 0.0 * states[:, 0]], axis=1)
