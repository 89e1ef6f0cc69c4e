"""The learners find what they found before, and policies stored before still load; frozen/ keeps both."""

from itertools import product

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

import unconstrain as uc
from frozen.make import FOLDER, LEARNERS, POLICIES, PROBES, STORED, learnt

ITERATIVE = {"robust", "likelihood", "noise_corrected", "segments"}
"""Learners that repeat until nothing changes, and so pass rounding on from step to step."""

EXACT = 1e-12
"""Other kernels of linear algebra (OPENBLAS_CORETYPE) change actions by up to 7e-13 of the largest, and the weights of
the grid, whose kernels nearly repeat each other, by up to 8e-12."""


@pytest.fixture(scope="module")
def found():
    """Weights and actions by name, as they were."""
    with np.load(FOLDER / "found.npz") as file:
        return dict(file)


def assert_as_before(name, now, before, allowed):
    """Equal to a share of the largest value of the array."""
    assert now.shape == before.shape, name
    difference = np.abs(now - before).max() / np.abs(before).max()
    assert difference <= allowed, f"{name}: differs by {difference:.1e} of its largest value, expected {allowed:.0e}"


@pytest.mark.parametrize(("kind", "learner"), product(POLICIES, LEARNERS))
def test_learners_find_what_they_found_before(found, kind, learner):
    name, allowed = f"{kind}-{learner}", 1e-9 if learner in ITERATIVE else EXACT
    with threadpool_limits(1):
        policy = learnt(kind, learner)
        actions = policy(PROBES)
    weights_allowed = max(allowed, 1e-10) if kind == "grid" else allowed
    assert_as_before(f"weights of {name}", policy.solution_.weights, found[name], weights_allowed)
    assert_as_before(f"actions of {name}", actions, found[f"{name}-actions"], allowed)


@pytest.mark.parametrize(("kind", "learner"), STORED)
def test_stored_policies_act_as_they_did(found, kind, learner):
    name = f"{kind}-{learner}"
    with threadpool_limits(1):
        actions = uc.load(FOLDER / f"{name}.npz")(PROBES)
    assert_as_before(f"actions of {name}.npz", actions, found[f"{name}.npz"], EXACT)
    assert uc.storage.load_notes(FOLDER / f"{name}.npz") == {"recipe": {"states": ["x", "y"]}}
