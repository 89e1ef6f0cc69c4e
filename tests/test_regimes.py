"""The benchmark of regimes: its rows, its summary, its page."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import mannwhitneyu

import unconstrain as uc
from seen import opened
from test_report import References
from unconstrain.base.errors import SettingError
from unconstrain.cli.printing import print_table
from unconstrain.pages import html
from unconstrain.paper import commands
from unconstrain.paper import pages as report
from unconstrain.paper.experiments import regimes

PLAIN = {"direct", "inconsistency", "hybrid", "hybrid, auto"}
METHODS = PLAIN | {"noise-corrected", "likelihood", "robust", "oracle", "constraints known"}


@pytest.fixture(scope="module")
def result(once):
    """Two of the regimes, so that it does not take long."""
    only = ("limit cycle, random", "limit cycle, half")
    settings = regimes.Settings(trials=2, seed=7001, only=only, noise=(0.0, 0.05), thresholds=11)
    return once("result regimes", lambda: regimes.run(settings))


def test_there_is_a_row_for_each_method_regime_and_noise(result):
    keys = {(row["method"], row["system"], row["constraint"], row["noise"]) for row in result.rows}
    assert len(keys) == len(result.rows) == len(METHODS) * 2 * 2
    assert {row["method"] for row in result.rows} == METHODS


def test_a_regime_alone_has_the_same_data_sets(result):
    settings = replace(result.settings, only=("limit cycle, half",), noise=(0.0,))
    rows = [row for row in result.rows if (row["constraint"], row["noise"]) == ("half", 0.0)]
    assert regimes.run(settings).rows == rows


@pytest.mark.parametrize(
    ("only", "count"), [((), 24), (("arm",), 6), (("half",), 3), (("half", "arm, half", "pendulum, none"), 4)]
)
def test_regimes_can_be_chosen_by_system_constraint_or_both(only, count):
    assert len(regimes._regimes(only)) == count


def test_a_regime_that_does_not_exist_lists_those_that_do():
    with pytest.raises(SettingError, match=r"got 'arms', expected a system \(limit cycle, pendulum, arm\), a constr"):
        regimes.run(regimes.Settings(only=("half", "arms")))


def test_the_oracle_is_one_times_the_oracle_and_the_hybrid_one_times_the_paper(result):
    assert all(row["to_oracle"] == pytest.approx(1.0) for row in result.rows if row["method"] == "oracle")
    assert all(one["to_paper"] == pytest.approx(1.0) for one in result.tables["summary"] if one["method"] == "hybrid")


def test_the_summary_is_what_its_rows_say(result):
    for one in result.tables["summary"]:
        ratios, to_paper = [], []
        for row in result.rows:
            if (row["method"], row["noise"]) == (one["method"], one["noise"]):
                [paper] = [
                    other["nupe_geometric"]
                    for other in result.rows
                    if other["method"] == "hybrid"
                    and all(other[key] == row[key] for key in ("system", "constraint", "noise"))
                ]
                to_paper.append(row["nupe_geometric"] / paper)
                ratios.append((row["to_oracle"], f"{row['system']}, {row['constraint']}"))
        assert one["regimes"] == len(ratios) == 2
        assert one["to_paper"] == pytest.approx(np.prod(to_paper) ** (1 / 2))
        assert one["to_oracle"] == pytest.approx((ratios[0][0] * ratios[1][0]) ** (1 / 2))
        assert (one["worst_to_oracle"], one["worst"]) == max(ratios)


def test_only_where_some_samples_are_free_and_some_not_are_they_told_apart(result):
    for row in result.rows:
        tells = row["method"] == regimes.DEFAULT
        assert (row["auc_mean"] is not None) == (tells and row["constraint"] == "half")
        assert row["auc_mean"] is None or 0.95 < row["auc_mean"] <= 1.0
        assert (row["coverage_mean"] is not None) == tells


def test_95_percent_intervals_hold_about_that(result):
    held = {noise: [] for noise in result.settings.noise}
    for row in result.rows:
        if row["method"] == regimes.DEFAULT:
            held[row["noise"]].append(row["coverage_mean"])
    assert 0.85 < min(held[0.05]) < max(held[0.05]) < 0.99
    assert min(held[0.0]) > 0.85  # no model is trusted to be as exact as it is there


def test_with_known_constraints_linear_policies_are_recovered():
    rng, turn = np.random.default_rng(5), np.array([[-0.3, 1.0], [-1.0, -0.3]])
    demos = []
    for _ in range(6):
        lines = uc.constraints.SwitchingLine.random(rng, 1.0, 2)
        demos += uc.rollout(lambda states: states @ turn.T, rng.uniform(-1, 1, (1, 2)), 30, 0.03, [lines])
    for policy in (uc.ParametricPolicy(uc.Affine()), uc.LocallyLinearPolicy(1.0)):
        policy.fit_demonstrations(demos)
        assert regimes._knowing(policy, demos, demos)[0] < 1e-10
        assert uc.nupe(policy.with_learner(uc.Direct()), demos) > 0.01


def test_noise_is_a_share_of_the_policys_spread():
    rng = np.random.default_rng(0)
    training, _ = regimes.demonstrate("limit cycle", "random", rng)
    policies = np.concatenate([demo.truth.policy for demo in training])
    noisy = regimes.with_noise(training, 0.1, rng)
    added = np.concatenate([one.actions - two.actions for one, two in zip(noisy, training, strict=True)])
    assert added.std() == pytest.approx(0.1 * np.sqrt(policies.var(axis=0).mean()), rel=0.05)


@pytest.mark.parametrize(
    ("scores", "labels", "area"),
    [([1, 2, 3, 4], [0, 0, 1, 1], 1.0), ([4, 3, 2, 1], [0, 0, 1, 1], 0.0), ([1, 1, 1], [0, 1, 1], 0.5),
     ([1, 3, 2, 4], [0, 0, 1, 1], 0.75)],
)  # fmt: skip
def test_the_area_is_the_share_of_pairs_in_the_right_order(scores, labels, area):
    assert regimes.area_under_curve(np.array(scores, float), np.array(labels, bool)) == pytest.approx(area)


def test_the_area_is_the_statistic_of_mann_and_whitney():
    rng = np.random.default_rng(5)
    for decimals in (1, 2, 8):  # with many ties, and with few
        scores, labels = np.round(rng.random(200), decimals), rng.random(200) < 0.3
        pairs = mannwhitneyu(scores[labels], scores[~labels]).statistic
        area = pairs / (labels.sum() * (~labels).sum())
        assert regimes.area_under_curve(scores, labels) == pytest.approx(area, abs=1e-12)


@pytest.fixture
def both(monkeypatch):
    """A result with the arm, from made-up figures: the learner that knows its Jacobian has a tenth of the others'."""

    def made_up(settings, system, constraint, seed):
        methods = sorted(METHODS) + ([regimes.JACOBIAN] if system == "arm" else [])
        drawn = np.random.default_rng(seed).uniform(1.0, 2.0, (len(methods), 6)) * [
            [0.1 if one == regimes.JACOBIAN else 1.0] for one in methods
        ]
        return [dict(zip(methods, map(tuple, drawn.tolist()), strict=True)) for _ in settings.noise]

    monkeypatch.setattr(regimes, "trial", made_up)
    return regimes.run(regimes.Settings(trials=3, only=("arm, 1", "arm, 1-2-3", "pendulum, none"), noise=(0.0, 0.05)))


def test_who_knows_the_jacobian_is_in_a_table_of_its_own_and_in_no_comparison(both):
    known = both.tables["jacobian_known"]
    assert [(row["system"], row["constraint"], row["noise"]) for row in known] == [
        ("arm", held, noise) for held in ("1", "1-2-3") for noise in (0.0, 0.05)
    ]
    assert {row["method"] for row in known} == {regimes.JACOBIAN}
    assert max(row["nupe_median"] for row in known) <= 0.2
    assert {row["method"] for row in both.rows} == {one["method"] for one in both.tables["summary"]} == METHODS
    said = [line for line in regimes.headlines(both) if line.startswith(f"{regimes.JACOBIAN}, arm, ")]
    assert len(said) == len(known)
    assert f"{100 * known[0]['nupe_median']:.4f}e-2" in said[0]


def test_the_page_shows_it_apart(both, result):
    cells = [html.number(100.0 * row["nupe_median"]) for row in both.tables["jacobian_known"]]
    before, _, after = report.page(both).partition("With the kinematics known")
    assert all(f"<td>{cell}</td>" in after and f"<td>{cell}</td>" not in before for cell in cells)
    assert result.tables["jacobian_known"] == []  # nothing in the plane has kinematics
    assert "have no kinematics to know" in report.page(result)


@pytest.mark.slow
def test_the_arms_policy_is_better_known_with_its_jacobian(monkeypatch):
    by_arm = regimes._by_arm  # of a third of the demonstrations, the benefit is as plain
    monkeypatch.setattr(regimes, "_by_arm", lambda held, count, rng: by_arm(held, 3 * count // 10, rng))
    [found] = regimes.trial(regimes.Settings(noise=(0.05,)), "arm", "1-2-3", np.random.SeedSequence(7001))
    assert found[regimes.JACOBIAN][0] < 0.6 * found[regimes.DEFAULT][0]


def test_noise_is_on_actions_and_states_are_those_of_the_roll_out():
    training, _ = regimes.demonstrate("pendulum", "random", np.random.default_rng(0))
    for noisy, exact in zip(regimes.with_noise(training, 0.1, np.random.default_rng(1)), training, strict=True):
        assert (noisy.states == exact.states).all()
        assert (noisy.actions != exact.actions).all()


def test_the_table_prints_what_is_not_known_as_a_dash(result, capsys):
    print_table(*commands.summary(result))
    assert capsys.readouterr().out.count("oracle") >= 4


def test_headlines_say_each_noise_level(result):
    said = regimes.headlines(result)
    assert sum(line.startswith("noise ") for line in said) == 2
    assert "95 % intervals of robust" in said[-1]


def test_its_headlines_are_shown_beside_the_recorded_movements(result, tmp_path):
    (tmp_path / "regimes.json").write_text(json.dumps(result.to_json()))
    assert commands._beside("recorded", tmp_path) == [f"regimes, {line}" for line in regimes.headlines(result)]


def test_the_page_has_a_picture_for_each_noise_and_the_numbers_of_the_summary(result, browser, tmp_path):
    page = report.page(result)
    references = References()
    references.feed(page)
    assert references.found == []
    assert len(opened(browser, page, tmp_path)) == 2
    for one in result.tables["summary"]:
        assert f"<td>{html.number(one['to_oracle'])}</td>" in page
