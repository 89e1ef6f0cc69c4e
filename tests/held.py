"""Movements under constraints that are functions of the state, with their truth."""

import numpy as np

import unconstrain as uc


def attracted(states):
    return -0.5 * states


def circling(states):
    return np.column_stack([states[:, 1], -states[:, 0]]) + 0.3 * states


def parabola(states, times=None):
    """The state-dependent constraint of the library CCL, ``A(x) = [4 x₁, −1]``."""
    return np.stack([4.0 * states[:, 0], -np.ones(len(states))], axis=1)[:, None]


def near_corners(rng, count):
    return (np.array([1.0, 2.0]) + 0.1 * rng.random((count, 2))) * rng.choice([-1.0, 1.0], (count, 2))


def demonstrate(constraint, rng, policy=attracted, starts=near_corners, count=50, steps=20, dt=0.1, noise=0.0):
    """Roll-outs, with noise on the actions as a share of the policy's spread; returns them and its size."""
    demos = uc.rollout(policy, starts(rng, count), steps, dt, constraint, method="euler")
    wanted = np.concatenate([demo.truth.policy for demo in demos])
    size = noise * np.sqrt(wanted.var(axis=0).mean())
    shaken = [
        uc.Demonstration(
            demo.states, demo.actions + size * rng.standard_normal(demo.actions.shape), demo.times, demo.truth
        )
        for demo in demos
    ]
    return shaken, size


def two_links(postures):
    """Jacobian of the hand of a planar arm of two links of one metre."""
    first, both = postures[:, 0], postures.sum(axis=1)
    x = np.stack([-np.sin(first) - np.sin(both), -np.sin(both)], axis=1)
    y = np.stack([np.cos(first) + np.cos(both), np.cos(both)], axis=1)
    return np.stack([x, y], axis=1)


def drawn(constraint, rng, samples=1000, low=-1.0, high=1.0, columns=3, task=None, noise=0.0):
    """Samples at random states with random policies: states, actions, projections and what the task does."""
    states, wanted = rng.uniform(low, high, (samples, columns)), rng.standard_normal((samples, columns))
    matrices = constraint(states, None)
    projections = uc.null_space_projection(matrices)
    done = np.zeros_like(wanted)
    if task is not None:
        done = np.einsum("ndk,nk->nd", np.linalg.pinv(matrices), task(states))
    actions = done + np.einsum("nij,nj->ni", projections, wanted) + noise * rng.standard_normal(wanted.shape)
    return states, actions, projections, done
