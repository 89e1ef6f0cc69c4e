"""The sums over samples."""

import ctypes
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import naive
from unconstrain.risks import moments as module
from unconstrain.risks.moments import Moments, Sums, gather
from unconstrain.risks.objectives import inconsistency, standard_risk, unvec, vec

NAMES = ("weight", "energy", "cross", "gram", "consistent")


def table(seed, samples=20, p=3, d=2, models=2):
    rng = np.random.default_rng(seed)
    return (
        rng.standard_normal((samples, p)),
        rng.standard_normal((samples, d)),
        rng.uniform(0, 1, (samples, models)),
    )


def test_no_sample_at_all_sums_to_zero():
    moments = gather(np.empty((0, 3)), np.empty((0, 2)), np.empty((0, 4)))
    assert [s.shape for s in moments.sums] == [(4,), (4,), (4, 2, 3), (4, 3, 3), (4, 6, 6)]
    for mine, zero in zip(moments.sums, Moments.zero(4, 2, 3).sums, strict=True):
        assert_array_equal(mine, zero)


def test_without_weights_each_sample_counts_once_in_one_model():
    features, actions, _ = table(0)
    plain, ones = gather(features, actions), gather(features, actions, np.ones((20, 1)))
    for name in NAMES:
        assert_array_equal(getattr(plain, name), getattr(ones, name))
    assert plain.weight == [20.0]


def test_sums_are_those_of_the_design_table():
    features, actions, counts = table(1)
    moments = gather(features, actions, counts)
    unit = actions / np.linalg.norm(actions, axis=1, keepdims=True)
    for m in range(2):
        w = counts[:, m]
        assert_allclose(moments.weight[m], w.sum())
        assert_allclose(moments.energy[m], sum(w[n] * actions[n] @ actions[n] for n in range(20)))
        assert_allclose(moments.cross[m], sum(w[n] * np.outer(actions[n], features[n]) for n in range(20)))
        assert_allclose(moments.gram[m], sum(w[n] * np.outer(features[n], features[n]) for n in range(20)))
        pairs = (w[n] * np.kron(np.outer(features[n], features[n]), np.outer(unit[n], unit[n])) for n in range(20))
        assert_allclose(moments.consistent[m], sum(pairs), atol=1e-14)


@pytest.mark.parametrize("models", [1, 3])
def test_zero_actions_do_not_vote(models):
    features, actions, counts = table(2, models=models)
    still = np.zeros_like(actions)
    with_rest = gather(np.tile(features, (2, 1)), np.vstack([actions, still]), np.tile(counts, (2, 1)))
    moving, resting = gather(features, actions, counts), gather(features, still, counts)
    assert_allclose(with_rest.consistent, moving.consistent)
    assert_allclose(with_rest.cross, moving.cross)
    assert_allclose(with_rest.energy, moving.energy)
    assert_allclose(with_rest.gram, 2 * moving.gram)
    assert_allclose(with_rest.weight, 2 * moving.weight)
    assert not resting.consistent.any()
    assert not resting.energy.any()


@pytest.mark.parametrize("models", [1, 3])
@pytest.mark.parametrize("d", [1, 2, 4])
def test_hessians_are_exactly_symmetric_and_have_no_negative_eigenvalue(models, d):
    moments = gather(*table(3, d=d, models=models))
    for hessian in (moments.gram, moments.consistent):
        assert_array_equal(hessian, np.swapaxes(hessian, -1, -2))
        assert np.linalg.eigvalsh(hessian).min() > -1e-12 * np.abs(hessian).max()


def test_one_dimensional_actions_are_never_ambiguous():
    features, actions, counts = table(4, d=1)
    moments = gather(features, actions, counts)
    assert_allclose(moments.consistent, moments.gram)


@pytest.mark.parametrize("models", [1, 3])
def test_the_size_of_blocks_does_not_change_the_sums(monkeypatch, models):
    features, actions, counts = table(5, samples=500, models=models)
    whole = gather(features, actions, counts)
    monkeypatch.setattr(module, "_BLOCK", 1)  # as small as blocks get
    for mine, theirs in zip(gather(features, actions, counts).sums, whole.sums, strict=True):
        assert_allclose(mine, theirs, rtol=1e-12, atol=1e-12)


def test_total_adds_several():
    parts = [gather(*table(seed)) for seed in range(3)]
    for whole, *each in zip(Moments.total(parts).sums, *(part.sums for part in parts), strict=True):
        assert_allclose(whole, np.sum(each, axis=0))


@pytest.mark.parametrize("new", [2, 3, 5])
def test_changing_features_afterwards_is_gathering_over_them(new):
    features, actions, counts = table(6)
    change = np.random.default_rng(7).standard_normal((2, new, 3))
    moved = gather(features, actions, counts).in_features(change)
    for m in range(2):
        expected = gather(features @ change[m].T, actions, counts[:, m : m + 1])
        for name in NAMES:
            assert_allclose(getattr(moved, name)[m], getattr(expected, name)[0], atol=1e-12)


@given(st.integers(1, 4), st.integers(1, 4), st.integers(0, 1000))
def test_vec_lays_columns_on_top_of_one_another(d, p, seed):
    W = np.random.default_rng(seed).standard_normal((2, d, p))
    assert_array_equal(vec(W)[1], W[1].ravel(order="F"))
    assert_array_equal(unvec(vec(W), d), W)


def test_objectives_differ_in_the_hessian_only():
    moments = gather(*table(8))
    first, second = inconsistency(moments), standard_risk(moments)
    assert_array_equal(first.constant, second.constant)
    assert_array_equal(first.linear, second.linear)
    assert np.linalg.eigvalsh(second.hessian - first.hessian).min() > -1e-12


@pytest.mark.parametrize("scale", [1e-90, 1e-8, 1e8, 1e90])
def test_directions_survive_any_size_of_action(scale):
    features, actions, counts = table(9)
    plain, scaled = gather(features, actions, counts), gather(features, scale * actions, counts)
    assert_allclose(scaled.consistent, plain.consistent, atol=1e-13)
    assert_allclose(scaled.cross, scale * plain.cross)
    assert_allclose(scaled.energy, scale**2 * plain.energy)


def test_sums_of_one_model_equal_the_paper_s_where_an_axis_hardly_moves():
    # The last diagonal block is a difference; it must not drown what is there.
    features, actions, _ = table(10)
    actions[:, 1] *= 1e-3
    _, g, H = naive.inconsistency_terms(features, actions)
    moments = gather(features, actions)
    assert_allclose(moments.consistent[0], H, atol=1e-13 * np.abs(H).max())
    assert_allclose(vec(moments.cross)[0], g)


@pytest.mark.parametrize("models", [1, 3])
@pytest.mark.parametrize("d", [1, 2, 3])
def test_sums_are_those_of_the_naive_twin(models, d):
    features, actions, counts = table(11, samples=60, d=d, models=models)
    actions[::7] = 0.0
    moments = gather(features, actions, counts)
    for m in range(models):
        energy, g, H = naive.inconsistency_terms(features, actions, counts[:, m])
        _, _, M = naive.risk_terms(features, actions, counts[:, m])
        assert_allclose(moments.energy[m], energy, rtol=1e-12)
        assert_allclose(vec(moments.cross)[m], g, rtol=0, atol=1e-12 * np.abs(g).max())
        assert_allclose(moments.consistent[m], H, rtol=0, atol=1e-12 * np.abs(H).max())
        assert_allclose(standard_risk(moments).hessian[m], M, rtol=0, atol=1e-12 * np.abs(M).max())


@pytest.mark.parametrize("models", [1, 3])
def test_sums_of_blocks_are_those_of_all(models):
    features, actions, counts = table(12, samples=50, models=models)
    sums = Sums(models, 2, 3)
    assert_array_equal(sums.moments.gram, np.zeros((models, 3, 3)))
    for rows in (slice(0, 7), slice(7, 7), slice(7, 50)):
        sums.add(features[rows], actions[rows], counts[rows])
    found, whole = sums.moments, gather(features, actions, counts)
    sums.add(features, actions, counts)  # does not change what was found
    for mine, theirs in zip(found.sums, whole.sums, strict=True):
        assert_allclose(mine, theirs, atol=1e-12)
    assert_allclose(sums.moments.consistent, 2 * whole.consistent, atol=1e-12)


def test_pieces_are_all_rows_once():
    table = np.empty((30_001, 3))
    pieces = list(Sums(1, 2, 3).pieces(table))
    assert len(pieces) > 1
    assert_array_equal(np.concatenate([np.arange(30_001)[rows] for rows in pieces]), np.arange(30_001))
    assert list(Sums(1, 2, 3).pieces(table[:0])) == []


def test_one_feature_and_one_action_in_several_models_can_be_summed():
    weights = np.array([[1.0, 0.5], [2.0, 0.0]])
    found = gather(np.array([[2.0], [3.0]]), np.array([[1.0], [-1.0]]), weights)
    assert_allclose(found.cross[:, 0, 0], [2 - 6, 1])


@pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "mallinfo2"), reason="of the GNU C library only"
)
def test_summing_changes_nothing_about_where_the_process_gets_its_memory():
    # The library maps large arrays, and keeps to itself what is small or was once freed at that size.
    code = """
import ctypes, numpy as np
from unconstrain.risks import Sums
class Said(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in ("a", "b", "c", "d", "mapped", "f", "g", "h", "i", "j")]
library = ctypes.CDLL(None)
library.mallinfo2.restype = Said
Sums(1, 2, 3).add(np.ones((50, 3)), np.ones((50, 2)), np.ones((50, 1)))
before = library.mallinfo2().mapped
large = np.empty(20 * 2**20, dtype=np.uint8)
assert library.mallinfo2().mapped - before >= len(large)
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_who_adds_at_the_same_time_writes_to_other_memory():
    workspace = module._Workspace()
    with workspace.room((4, 3)) as first, workspace.room((2, 3), order="F") as second:
        assert not np.shares_memory(first, second)
        assert first.flags.c_contiguous
        assert second.flags.f_contiguous
    with workspace.room((2, 2)) as third:
        assert np.shares_memory(third, first) or np.shares_memory(third, second)
