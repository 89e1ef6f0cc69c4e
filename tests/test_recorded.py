"""The benchmark of recorded movements: its data sets, what it makes of them, its page."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import unconstrain as uc
from recorded import DATA
from seen import opened
from test_report import References
from unconstrain.base.errors import ReadError, SettingError
from unconstrain.pages import html
from unconstrain.paper import commands
from unconstrain.paper import pages as report
from unconstrain.paper.datasets.files import DATA_VARIABLE
from unconstrain.paper.experiments import recorded
from unconstrain.paper.experiments.recorded import judging, movements, simulated, summary
from unconstrain.paper.experiments.recorded.sets import KINDS, RECORDED, SIMULATED, described

FOLDERS = ("lasa_handwriting", "libras_hand", "kuleuven_contour", "lasa_rim_wiping")
needs_movements = pytest.mark.skipif(
    not all((DATA / folder).is_dir() for folder in FOLDERS),
    reason=f"not all recorded movements are in {DATA}; set UNCONSTRAIN_DATA to a folder that holds them",
)
TWELVE = ("recorded, half free", "recorded, shuffled inside", "two demonstrations", "one plane for all")
DRAWN = KINDS


@pytest.fixture(autouse=True)
def _local_copies(monkeypatch):
    monkeypatch.setenv(DATA_VARIABLE, str(DATA))


@cache
def once_drawn(kind, index=0):
    return recorded.draw(*recorded.listed(3, (kind,))[index], 3)


@pytest.fixture
def drawn():
    """The first development set of a kind, or others."""
    if not all((DATA / folder).is_dir() for folder in FOLDERS):
        pytest.skip(f"not all recorded movements are in {DATA}")
    return once_drawn


@pytest.fixture(scope="module")
def result(once):
    """Two data sets of each of four kinds, those of movements with two policies: twelve."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(DATA_VARIABLE, str(DATA))
        return once("result recorded", lambda: recorded.run(recorded.Settings(trials=2, seed=3, only=TWELVE)))


def stacked(data):
    """States, actions, true policy and projections of what is learnt from."""
    truths = [demo.truth for demo in data.demonstrations]
    return (
        np.concatenate([demo.states for demo in data.demonstrations]),
        np.concatenate([demo.actions for demo in data.demonstrations]),
        np.concatenate([truth.policy for truth in truths]),
        np.concatenate([truth.projections for truth in truths]),
    )


# ------------------------------------------------------------------------------------------------------ which there are


@needs_movements
def test_the_reported_half_and_the_other_share_no_movement_and_miss_none():
    report, development = (
        {(one.source, one.name) for one in movements.movements(reported)} for reported in (True, False)
    )
    assert report.isdisjoint(development)
    assert len(report | development) == 30 + 15 + 6 + 2
    for source in ("handwriting", "signs", "contour", "rim"):
        sizes = [sum(of == source for of, _ in half) for half in (report, development)]
        assert abs(sizes[0] - sizes[1]) <= 1


@needs_movements
def test_only_seed_0_takes_the_reported_half():
    halves = [{name for _, name in recorded.listed(seed, ("recorded, one each",), 99)} for seed in (0, 1, 2, 99)]
    assert halves[1] == halves[2] == halves[3]
    assert halves[0].isdisjoint(halves[1])
    assert {"handwriting, Angle"} <= halves[0] | halves[1]


@needs_movements
def test_a_third_coordinate_comes_from_the_same_half():
    for reported in (True, False):
        half = movements.movements(reported)
        for movement in half:
            _, following = movements.named(movement.title)
            assert following.source == movement.source
            assert following in half


@needs_movements
def test_there_are_as_many_sets_of_each_kind_as_asked_for():
    kinds = [kind for kind, _ in recorded.listed(1, at_most=8)]
    assert {kind: kinds.count(kind) for kind in kinds} == dict.fromkeys(DRAWN, 8)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_described_in_its_own_words(kind):
    said = described(kind)
    assert said.endswith(".")
    assert said not in [described(other) for other in KINDS if other != kind]


def test_a_kind_that_does_not_exist_lists_those_that_do():
    with pytest.raises(SettingError, match=r"got 'hood', expected one of recorded, switching, recorded, one each"):
        recorded.run(recorded.Settings(only=("hood",)))


def test_without_recordings_the_others_remain_and_it_is_said(monkeypatch, tmp_path):
    pooch = pytest.importorskip("pooch")
    monkeypatch.setattr(pooch, "os_cache", lambda name: tmp_path / name)
    monkeypatch.delenv(DATA_VARIABLE)
    assert movements.missing() == ["handwriting", "signs", "contour", "rim"]
    assert {kind for kind, _ in recorded.listed(1)} == set(SIMULATED).intersection(DRAWN)
    with pytest.raises(ReadError, match=r"no recorded movement is on this machine: handwriting, .*Set UNCONSTR"):
        recorded.run(recorded.Settings(only=("recorded, varying",)))


# ----------------------------------------------------------------------------------------------------- what they are


@pytest.mark.parametrize("kind", DRAWN)
def test_a_set_is_always_drawn_the_same_whatever_else_is(kind, drawn):
    one = drawn(kind)
    again, other = (recorded.draw(kind, one.name, seed) for seed in (3, 4))
    for field in range(4):
        np.testing.assert_array_equal(stacked(one)[field], stacked(again)[field])
    assert not np.array_equal(stacked(one)[1], stacked(other)[1])


@pytest.mark.parametrize("kind", DRAWN)
def test_projections_are_projections(kind, drawn):
    _, _, policy, N = stacked(drawn(kind))
    np.testing.assert_allclose(N @ N, N, atol=1e-12)
    np.testing.assert_allclose(N, N.transpose(0, 2, 1), atol=1e-12)
    assert np.isfinite(policy).all()


@pytest.mark.parametrize("kind", [*RECORDED, "wide kernels", "coming to rest"])
def test_actions_are_what_constraints_leave_of_them(kind, drawn):
    _, actions, policy, N = stacked(drawn(kind))
    scale = np.abs(policy).max()
    np.testing.assert_allclose(actions, np.einsum("nij,nj->ni", N, policy), rtol=0, atol=1e-12 * scale)
    np.testing.assert_allclose(actions, np.einsum("nij,nj->ni", N, actions), rtol=0, atol=1e-12 * scale)


@pytest.mark.parametrize(
    ("kind", "least", "most"),
    [("recorded, switching", 2, 3), ("recorded, one each", 1, 1), ("recorded, half free", 1, 1),
     ("recorded, varying", 10, 999)],
)  # fmt: skip
def test_constraints_of_recorded_movements_change_as_their_kind_says(kind, least, most, drawn):
    data = drawn(kind)
    for demo in data.demonstrations:
        assert least <= len(np.unique(demo.truth.projections.round(9), axis=0)) <= most
    free = [np.allclose(demo.truth.projections, np.eye(demo.actions.shape[1])) for demo in data.demonstrations]
    assert sum(free) == (len(free) // 2 if kind == "recorded, half free" else 0)


def test_normals_that_vary_do_so_slowly_and_in_space(drawn):
    data = drawn("recorded, varying")
    for demo in data.demonstrations:
        assert demo.states.shape[1] == demo.actions.shape[1] == 3
        turns = np.linalg.norm(np.diff(demo.truth.projections, axis=0), axis=(1, 2)) / np.sqrt(2)
        assert 0 < np.arcsin(np.minimum(turns, 1)).max() < np.radians(45)
        assert np.arcsin(np.minimum(turns, 1)).mean() < np.radians(10)


def test_a_third_coordinate_has_the_speed_of_its_own_way(drawn):
    for demo in drawn("recorded, varying").demonstrations:
        way = np.trapezoid(demo.truth.policy[:, 2], demo.times)
        assert way == pytest.approx(demo.states[-1, 2] - demo.states[0, 2], abs=0.1 * np.ptp(demo.states[:, 2]))


def test_rows_in_a_heap_are_the_same_rows(drawn):
    data = drawn("recorded, rows shuffled")
    [heap] = data.demonstrations
    states, _, _ = uc.stack(data.test)
    assert heap.times is None
    assert not data.grouped
    assert not np.array_equal(heap.states, states)
    np.testing.assert_array_equal(np.sort(heap.states, axis=0), np.sort(states, axis=0))
    inside = drawn("recorded, shuffled inside")
    for mixed, demo in zip(inside.demonstrations, inside.unspoiled, strict=True):
        np.testing.assert_array_equal(np.sort(mixed.states, axis=0), np.sort(demo.states, axis=0))
        assert not np.array_equal(mixed.states, demo.states)


@pytest.mark.parametrize(("kind", "count"), [("one bad sample", 1), ("1 % bad samples", 5)])
def test_so_many_samples_are_bad_and_no_others(kind, count, drawn):
    for index in range(2):
        data = drawn(kind, index)
        wrong = np.concatenate(
            [one.actions - two.actions for one, two in zip(data.demonstrations, data.unspoiled, strict=True)]
        )
        assert len(wrong) == 480
        assert (wrong != 0).any(axis=1).sum() == count


@pytest.mark.parametrize("decibels", [50, 10])
def test_noise_is_as_far_below_the_signal_as_the_protocol_says(decibels):
    made = simulated.capl(np.random.default_rng(0), decibels)
    for demo in made.demonstrations:
        signal = np.einsum("nij,nj->ni", demo.truth.projections, demo.truth.policy)
        ratio = (signal**2).mean() / ((demo.actions - signal) ** 2).mean()
        assert 10 * np.log10(ratio) == pytest.approx(decibels, abs=2)
    assert [len(made.demonstrations), len(made.test)] == [40, 10]


def test_wide_kernels_are_nearly_dependent(drawn):
    data = drawn("wide kernels")
    assert np.linalg.cond(data.policy.features(data.demonstrations[0].states)) > 1e8


def test_a_wall_holds_only_who_pushes_into_it(drawn):
    _, _, policy, N = stacked(drawn("one-sided contact"))
    held = np.abs(N - np.eye(2)).max(axis=(1, 2)) > 1e-9
    normals = np.linalg.eigh(N[held])[1][:, :, 0]
    assert 0.05 < held.mean() < 0.95
    turned = normals * np.sign(np.einsum("ni,ni->n", normals, policy[held]))[:, None]
    states = np.concatenate([demo.states for demo in drawn("one-sided contact").demonstrations])[held]
    assert (np.einsum("ni,ni->n", turned, states) > 0.1 - 1e-9).all()  # on the far side, where the wall stands


def test_the_normal_of_the_hood_is_a_function_of_where_the_sponge_is():
    demos = simulated.curved_hood(np.random.default_rng(0)).demonstrations
    for demo in demos:
        normals = np.linalg.eigh(demo.truth.projections)[1][:, :, 0]
        slopes = normals[:, :2] / normals[:, 2:]  # linear in the position on a paraboloid
        design = np.column_stack([demo.states[:, :2], np.ones(len(demo))])
        residual = np.linalg.lstsq(design, slopes, rcond=None)[1]
        assert (residual < 1e-18).all()


def test_plates_are_tilted_by_5_to_30_degrees_and_velocities_those_of_positions(drawn):
    data = drawn("tilted plates")
    cosines = [np.sqrt(1.0 - one.truth.projections[0][2, 2]) for one in data.demonstrations]
    assert all(5.0 <= np.degrees(np.arccos(one)) <= 30.0 for one in cosines)
    for one in data.demonstrations:
        off = one.actions - np.vecdot(one.truth.projections, one.truth.policy[:, None, :])
        assert np.median(np.linalg.norm(off, axis=1)) < 0.02 * np.median(np.linalg.norm(one.actions, axis=1))


@pytest.mark.parametrize("kind", ["tilted plates", "near-parallel planes"])
def test_the_default_learner_is_not_behind_where_each_demonstration_has_its_plane(kind, drawn):
    data = drawn(kind)
    chosen = data.fit(uc.Robust())
    safe = (
        uc.nupe(chosen.with_learner(learner), data.test)
        for learner in (uc.Direct(), uc.Hybrid(threshold=0, softness=0.1))
    )
    assert uc.nupe(chosen, data.test) < 1.1 * min(safe)


def test_speeds_differ_by_a_factor_for_each_demonstration():
    demos = simulated.unequal_speeds(np.random.default_rng(0)).demonstrations
    factors = []
    for demo in demos:
        along = np.einsum("nij,nj->ni", demo.truth.projections, demo.truth.policy)
        factors.append((along * demo.actions).sum() / (along**2).sum())
    assert max(factors) / min(factors) > 1.5


@pytest.mark.parametrize(
    ("draw", "tails", "memory"),
    [(simulated.student_noise, 5.0, 0.0), (simulated.correlated_noise, 3.0, 0.9)],
)
def test_noise_has_heavy_tails_or_a_memory(draw, tails, memory):
    noise = []
    for seed in range(8):
        for demo in draw(np.random.default_rng(seed)).demonstrations:
            noise.append(demo.actions - np.einsum("nij,nj->ni", demo.truth.projections, demo.truth.policy))
    errors = np.array(noise)
    kurtosis = (errors**4).mean() / (errors**2).mean() ** 2
    lagged = (errors[:, 1:] * errors[:, :-1]).mean() / (errors**2).mean()
    assert kurtosis > tails - 0.5 if tails > 3 else abs(kurtosis - 3) < 0.5
    assert lagged == pytest.approx(memory, abs=0.1)


# ------------------------------------------------------------------------------------------------- what is made of them


@needs_movements
def test_the_twelve_are_those_that_were_asked_for(result):
    sets = result.tables["sets"]
    assert len(sets) == 12
    keys = [(one["kind"], one["policy"]) for one in sets]
    assert len(set(keys)) == 6
    for kind, name, policy in ((one["kind"], one["name"], one["policy"]) for one in sets):
        assert (kind, name) in recorded.listed(3, TWELVE, 2)
        assert policy in judging.policies(kind)


def is_local(row):
    return not row["policy"] and row["kind"] != "one plane for all"


def test_a_default_that_chose_its_models_badly_is_seen_by_the_widest():
    one = {"nupe": {"robust": 2.0, "direct": 4.0, "softened hybrid": 3.0, "softened hybrid, widest fields": 1.0}}
    assert summary.to_safe(one) == 2.0


@pytest.mark.parametrize(("own", "best", "ratio"), [(1e-16, 1e-21, 1.0), (4e-8, 1e-9, 4.0), (3e-3, 1e-3, 3.0)])
def test_errors_finer_than_any_recording_are_none(own, best, ratio):
    one = {"kind": "a", "policy": "", "name": "b", "nupe": {"robust": own, "direct": own}, "best": best, "floor": best}
    (row,) = summary.by_kind([{**one, "cost": None, **dict.fromkeys(summary.KNOWLEDGE)}])
    assert row["to_best"] == pytest.approx(ratio)


@needs_movements
def test_the_table_is_what_its_data_sets_say(result):
    for row in result.tables["kinds"]:
        mine = [one for one in result.tables["sets"] if (one["kind"], one["policy"]) == (row["kind"], row["policy"])]
        assert row["sets"] == 2
        for method in (*judging.LEARNERS, "robust"):
            product = mine[0]["nupe"][method] * mine[1]["nupe"][method]
            assert row[method] == pytest.approx(product ** (1 / 2))
        local = [f"{name}, widest fields" for name in judging.SAFE] if is_local(row) else []
        safe = [min(one["nupe"][name] for name in (*judging.SAFE, *local)) for one in mine]
        ratios = [one["nupe"]["robust"] / error for one, error in zip(mine, safe, strict=True)]
        assert row["to_safe"] == pytest.approx((ratios[0] * ratios[1]) ** (1 / 2))
        assert (row["worst_to_safe"], row["worst"]) == max(zip(ratios, [one["name"] for one in mine], strict=True))
        assert row["behind"] == sum(ratio > 1.1 for ratio in ratios) / 2
        to_best = [one["nupe"]["robust"] / one["best"] for one in mine]
        assert row["to_best"] == pytest.approx((to_best[0] * to_best[1]) ** (1 / 2))
        if row["kind"] == "recorded, shuffled inside":
            assert row["worst_cost"] == max(one["cost"] for one in mine)
            assert row["grown"] == sum(one["cost"] > 1.5 for one in mine) / 2
        else:
            assert row["cost"] is row["grown"] is None


@needs_movements
def test_the_error_of_direct_learning_is_that_of_least_squares_by_hand(result):
    [one] = [
        one
        for one in result.tables["sets"]
        if (one["kind"], one["policy"], one["name"])
        == ("recorded, half free", "parametric", recorded.listed(3, ("recorded, half free",))[0][1])
    ]
    data = recorded.draw("recorded, half free", one["name"], 3)
    states, actions, velocities, _ = stacked(data)
    groups = np.repeat(np.arange(len(data.demonstrations)), [len(demo) for demo in data.demonstrations])
    features = uc.ParametricPolicy(learner="direct").fit(states, actions, groups=groups).features_(states)
    norm = ((velocities - velocities.mean(axis=0)) ** 2).sum()
    for observed, found in ((actions, one["nupe"]["direct"]), (velocities, one["floor"])):
        fitted = features @ np.linalg.lstsq(features, observed, rcond=None)[0]
        assert ((fitted - velocities) ** 2).sum() / norm == pytest.approx(found, rel=1e-6)


@needs_movements
def test_the_best_candidate_is_no_worse_than_any_learner_but_may_not_be_the_default_itself(result):
    for one in result.tables["sets"]:
        errors = {name: error for name, error in one["nupe"].items() if name not in ("robust", "hybrid")}
        assert one["best"] <= min(errors.values())
        assert one["best_candidate"] in errors or one["best_candidate"].startswith("softness ")


OFF = np.array([0.0, 0.1])


class Knower:
    """A policy that is right but for a tenth in the second action, and says how sure it is."""

    def __init__(self, truth, free):
        self._truth = truth
        self.solution_ = type("Solution", (), {"determined_share": 0.5, "free": free})

    def __call__(self, states):
        return self._truth + OFF

    def uncertainty(self, states):
        noise, undetermined = np.full((len(states), 2), 0.04), np.full((len(states), 2), 0.01)
        undetermined[:2] = 1.0
        return uc.learners.Uncertainty(noise, undetermined, np.hypot(noise, undetermined))


def test_knowledge_is_counted_where_it_is_claimed():
    policy, N = np.arange(20.0).reshape(10, 2), np.tile(np.diag([1.0, 0.0]), (10, 1, 1))
    demo = uc.Demonstration(np.zeros((10, 1)), policy * [1, 0], truth=uc.Truth(policy, N))
    data = recorded.DataSet("one plane for all", "#1", [demo], [demo])
    found = judging.knowledge(Knower(policy, np.linspace(0, 0.9, 10)), data, None)
    # Of ten states eight are determined. The second action is wrong by more than 1.96 × 0.0412 there, and held by the
    # wide intervals of the two others; nothing ever moves along it.
    assert found == {
        "determined": 0.5,
        "known": pytest.approx(0.8),
        "held": 0.5,
        "held_hidden": pytest.approx(0.2),
        "said_free": pytest.approx(0.45),
        "told_free": None,
    }


def test_intervals_on_recorded_movements_should_hold_what_the_features_make_of_them():
    policy = np.arange(20.0).reshape(10, 2)
    demo = uc.Demonstration(np.zeros((10, 1)), policy, truth=uc.Truth(policy, np.tile(np.eye(2), (10, 1, 1))))
    data = recorded.DataSet("recorded, one each", "x", [demo], [demo])
    found = judging.knowledge(Knower(policy, np.ones(10)), data, lambda states: policy + OFF)
    assert (found["held"], found["told_free"], found["said_free"], found["held_hidden"]) == (1.0, 1.0, None, None)


def test_what_is_undone_costs_nothing():
    data = recorded.draw("two demonstrations", "#1", 3)
    assert judging.judged(replace(data, unspoiled=data.demonstrations))["cost"] == pytest.approx(1.0)


def test_a_mean_of_nothing_is_nothing():
    assert summary.geometric([]) is None
    assert summary.geometric([1.0, 4.0]) == pytest.approx(2.0)


# ------------------------------------------------------------------------------------------------------ how it is told


@needs_movements
def test_headlines_say_what_the_table_says(result):
    said = recorded.headlines(result)
    [half] = [one for one in result.tables["kinds"] if (one["kind"], one["policy"]) == ("recorded, half free", "")]
    assert f"half free {half['to_safe']:.2f}" in said[0]
    assert "with the parametric policy" in said[1]
    assert said[2].startswith("over all 4 kinds: robust nUPE ")
    assert any(line.startswith("95 % intervals of robust") for line in said)
    assert said[-1].startswith("one plane for all: ")


@needs_movements
def test_what_was_missing_is_said(result):
    absent = replace(result, tables={**result.tables, "missing": [{"source": "signs"}]})
    assert recorded.headlines(absent)[-1].startswith("left out, for the recordings are not on this machine: signs. Set")


@needs_movements
def test_the_page_has_a_picture_and_the_numbers_of_the_table(result, browser, tmp_path):
    page = report.page(result)
    references = References()
    references.feed(page)
    assert references.found == []
    assert len(opened(browser, page, tmp_path)) == 1
    for one in result.tables["kinds"]:
        assert f"<td>{html.number(one['to_safe'])}</td>" in page


def test_without_the_other_benchmark_the_command_for_it_is_given(tmp_path):
    [said] = commands._beside("recorded", tmp_path)
    assert said == (
        f"regimes: no {tmp_path / 'regimes.json'}; 'unconstrain reproduce regimes --out {tmp_path}' adds its lines here"
    )
    assert commands._beside("table1", tmp_path) == []


def test_a_result_of_another_version_is_no_failure(tmp_path):
    (tmp_path / "regimes.json").write_text('{"name": "regimes", "rows": []}')
    assert commands._beside("recorded", tmp_path) == [
        f"regimes: {tmp_path / 'regimes.json'} is of another version; reproduce it again with --force"
    ]
