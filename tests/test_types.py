"""A type checker sees the classes behind the names, and refuses what they do not take."""

from pathlib import Path

import pytest

import unconstrain as uc

mypy = pytest.importorskip("mypy.api")

SEEN = {
    "policy": "unconstrain.policies.local.LocallyLinearPolicy",
    "policy.predict(X)": "numpy.ndarray",
    "policy.uncertainty(X).total": "numpy.ndarray",
    "policy.solution_": "unconstrain.learners.solution.Solution",
    "policy.solution_.believed": "unconstrain.learners.solution.Belief",
    "uc.rollout(policy, [0.0, 1.0], 10, 0.1)": "unconstrain.recordings.demonstration.Demonstration",
    "uc.read('a.csv')": "list[unconstrain.recordings.demonstration.Recording]",
    "uc.prepare(uc.read('a.csv'))": "list[unconstrain.recordings.demonstration.Demonstration]",
    "uc.save(policy, 'p.npz')": "None",
    "uc.load('p.npz')": "unconstrain.policies.base.Policy",
    "uc.storage.load_notes('p.npz')": "dict[str, Any]",
    "uc.metrics.cpe(policy, [])": "float",
    "uc.robust.Robust()": "unconstrain.learners.robust.learner.Robust",
    "uc.constraints.Plane(np.ones(3))": "unconstrain.constraints.known.Plane",
    "uc.Hybrid(alpha=0.1)": "unconstrain.learners.hybrid.Hybrid",
    "uc.Folds(5).set_params(count=3)": "unconstrain.training.folds.Folds",
    "uc.preparation.Recipe()": "unconstrain.recordings.preparation.recipes.Recipe",
    "uc.errors.SettingError('')": "unconstrain.base.errors.SettingError",
    "uc.ParametricPolicy(learner=Mine()).fit_demonstrations([])": "unconstrain.policies.parametric.ParametricPolicy",
    "uc.__version__": "str",
}

USER = """
from dataclasses import dataclass

import numpy as np

import unconstrain as uc


@dataclass(frozen=True)
class Mine(uc.Learner):
    share: float = 0.5

    def learn(self, training: uc.Training) -> uc.Solution:
        return uc.Hybrid(alpha=self.share).learn(training)


X = np.zeros((20, 2))
policy = uc.LocallyLinearPolicy(variance=1.0, learner=uc.Robust()).fit(X, X, groups=np.zeros(20))
"""

REFUSED = {
    "uc.LocallyLinearPolicy(varaince=3)": 'Unexpected keyword argument "varaince"',
    "uc.LocallyLinearPolicy(learner=3)": 'Argument "learner" to "LocallyLinearPolicy" has incompatible type "int"',
    "uc.Hybird()": 'Module has no attribute "Hybird"',
    "uc.Folds(count='x')": 'Argument "count" to "Folds" has incompatible type "str"',
    "uc.Learner()": 'Cannot instantiate abstract class "Learner" with abstract attribute "learn"',
    "uc.Hybrid().alhpa": '"Hybrid" has no attribute "alhpa"',
}


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """What ``mypy --strict`` says of two files, by file and line."""
    folder = tmp_path_factory.mktemp("types")
    user, wrong = folder / "user.py", folder / "wrong.py"
    user.write_text(USER + "".join(f"reveal_type({expression})\n" for expression in SEEN))
    wrong.write_text("import unconstrain as uc\n" + "".join(f"{line}\n" for line in REFUSED))
    options = ["--strict", "--no-error-summary", "--cache-dir", str(folder / "cache"), "--config-file", ""]
    out, err, _ = mypy.run([*options, str(user), str(wrong)])
    assert err == ""
    lines = [line.removeprefix(f"{folder}/").split(":", 2) for line in out.splitlines()]
    return {(file, int(number)): text for file, number, text in reversed(lines)}


@pytest.mark.parametrize(("expression", "kind"), SEEN.items())
def test_a_type_checker_sees_the_classes(said, expression, kind):
    number = len(USER.splitlines()) + 1 + list(SEEN).index(expression)
    assert said["user.py", number].startswith(f' note: Revealed type is "{kind}')


@pytest.mark.parametrize(("line", "sentence"), REFUSED.items())
def test_a_type_checker_refuses_what_is_not_there(said, line, sentence):
    assert sentence in said["wrong.py", 2 + list(REFUSED).index(line)]


def test_nothing_else_is_complained_of(said):
    complaints = {place for place, text in said.items() if not text.startswith(" note: ")}
    assert complaints == {("wrong.py", number) for number in range(2, 2 + len(REFUSED))}


def test_the_package_says_that_it_has_types():
    assert Path(uc.__file__).with_name("py.typed").exists()
