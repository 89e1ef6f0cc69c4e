"""What objects say of themselves, in a terminal and in a notebook."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn import config_context

import unconstrain as uc
from samples import draw, samples_of
from unconstrain.base.display import percent
from unconstrain.learners import Belief, Judged
from unconstrain.risks import FoldedMoments, standard_risk

DATA = draw()
POLICY = uc.LocallyLinearPolicy(0.5, learner=uc.Robust()).fit(DATA.states, DATA.actions, groups=DATA.groups)
TIMES = np.linspace(0.0, 4.0, 90)
MOMENTS = uc.gather(np.ones((90, 3)), DATA.actions)

SAID = [
    (
        uc.Demonstration(DATA.states, DATA.actions, TIMES, name="wipe_3"),
        "Demonstration('wipe_3', 90 samples, 2 states, 2 actions, 4 s)",
    ),
    (uc.Demonstration([[1.0]], [[1.0]]), "Demonstration('', 1 sample, 1 state, 1 action)"),
    (uc.Recording(("x", "y"), DATA.states, TIMES, "wipe_3.csv"), "Recording('wipe_3.csv', 90 rows, 2 columns, 4 s)"),
    (uc.Recording((), np.zeros((0, 0)), np.zeros(0)), "Recording('', 0 rows, 0 columns)"),
    (uc.Truth(DATA.policy, DATA.projections), "Truth(90 samples, 2 actions)"),
    (MOMENTS, "Moments(1 model, 2 actions, 3 features, weight=90)"),
    (standard_risk(MOMENTS), "Quadratic(1 problem, 6 weights)"),
    (FoldedMoments((MOMENTS,) * 3, range(2)), "FoldedMoments(3 folds, 2 held out, 1 model, 2 actions, 3 features)"),
    (FoldedMoments((), range(0)), "FoldedMoments(0 folds, 0 held out)"),
    (POLICY.training_, "Training(2 states, 2 actions, 10 folds by demonstration, samples kept)"),
    (replace(POLICY.training_, kept=None), "Training(2 states, 2 actions, 10 folds by demonstration, sums alone)"),
    (POLICY.training_.model, "Model(Affine features, ReceptiveFields(10 centres in 2 dimensions, variance=0.5))"),
    (samples_of(DATA), "Samples(90 samples, 2 states, 2 actions, 3 features, 1 model)"),
    (uc.Affine(), "Affine()"),
    (uc.Affine(np.ones(3)), "Affine(centred and scaled in 3 dimensions)"),
    (uc.Polynomial(3), "Polynomial(degree=3)"),
    (uc.Polynomial(2, np.ones(3)), "Polynomial(degree=2, centred and scaled in 3 dimensions)"),
    (uc.NormalisedRBF.grid(-1, 1, 5, width=0.4), "NormalisedRBF(25 centres in 2 dimensions, variance=0.04)"),
    (POLICY.fields_, "ReceptiveFields(10 centres in 2 dimensions, variance=0.5)"),
    (POLICY.closed_form(), "ClosedForm(2 states, 2 actions, 10 models)"),
    (
        uc.Solution(np.zeros((2, 1, 2)), np.array([2, 1]), 2, np.zeros(2), method="hybrid"),
        "Solution(hybrid, 2 models, 75% of 4 directions determined)",
    ),
    (
        Belief(0.0213, 0.01, 0.25, np.ones(8), np.zeros(1), np.zeros(1)),
        "Belief(noise=0.0213, misfit=0.01, 25% of 8 samples free)",
    ),
    (
        Judged(0.2, 0.01, 0.02, 0.05, np.zeros((1, 2, 3))),
        "Judged(risk=0.05, loss=0.2, variance=0.01, bias=0.02)",
    ),
    (
        Belief(0.0213, 0.01, 0.0, np.ones(8), np.zeros(1), np.zeros(1), undecided_share=0.5),
        "Belief(noise=0.0213, misfit=0.01, 0% of 8 samples free, 50% free or always held alike)",
    ),
]


@pytest.mark.parametrize(("one", "line"), SAID, ids=lambda one: type(one).__name__)
def test_it_says_what_it_is_in_one_line(one, line):
    assert repr(one) == line
    assert len(line) < 120


@pytest.mark.parametrize("one", [one for one, _ in SAID], ids=lambda one: type(one).__name__)
def test_it_is_a_small_table_in_a_notebook(one):
    html = one._repr_html_()
    assert html.startswith(f"<table><thead><tr><th>{type(one).__name__}</th></tr></thead>")
    assert html.count("<tr>") == html.count("</tr>") > 0
    assert "array" not in html


def test_a_solution_says_what_was_learnt():
    solution = POLICY.solution_
    line = repr(solution)
    assert line.startswith(f"Solution({solution.method}, 10 models, ")
    assert line.endswith(f"of 60 directions determined, noise={solution.noise:.3g})")


def test_names_are_text_in_a_notebook():
    demo = uc.Demonstration([[1.0]], [[1.0]], name="<script>alert(1)</script>")
    assert "<script>" not in demo._repr_html_()
    assert "&lt;script&gt;" in demo._repr_html_()


def test_a_long_name_is_shortened():
    demo = uc.Demonstration([[1.0]], [[1.0]], name="/a/very/long/way/" * 20 + "wipe.csv")
    assert repr(demo) == "Demonstration('/a/very/long/way//a/…y/long/way/wipe.csv', 1 sample, 1 state, 1 action)"


def test_a_fitted_policy_says_what_was_learnt_below_its_settings():
    fresh = uc.LocallyLinearPolicy(0.5)
    assert POLICY.solution_._repr_html_() in POLICY._repr_html_()
    assert POLICY.solution_._repr_html_() in POLICY._repr_mimebundle_()["text/html"]
    assert "<th>Solution</th>" not in fresh._repr_html_()
    with config_context(display="text"):
        assert set(POLICY._repr_mimebundle_()) == {"text/plain"}


def test_a_policy_shows_its_settings_without_their_arrays():
    policy = uc.ParametricPolicy(uc.NormalisedRBF.grid(-1, 1, 5), "robust")
    assert " ".join(repr(policy).split()) == (
        "ParametricPolicy(features=NormalisedRBF(25 centres in 2 dimensions, variance=0.25), learner='robust')"
    )


def test_a_share_is_all_or_none_of_something_only_where_it_is():
    shares = [0.0, 1e-12, 0.004, 0.006, 0.124, 0.994, 0.996, 1.0 - 1e-12, 1.0, 1.004, -0.004, -0.3]
    said = ["0%", "0%", "<1%", "1%", "12%", "99%", ">99%", "100%", "100%", ">99%", "<1%", "-30%"]
    assert [percent(share) for share in shares] == said
    assert percent(float("nan")) == "nan%"
