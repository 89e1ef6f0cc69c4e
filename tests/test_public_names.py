"""What ``import unconstrain`` promises."""

import ast
import doctest
import inspect
import os
import pickle
import re
import subprocess
import sys
from importlib import import_module, metadata
from pathlib import Path

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.base.former import _NOW


@pytest.mark.parametrize("name", uc.__all__)
def test_each_public_name_is_there(name):
    assert getattr(uc, name) is not None
    assert name in dir(uc)


STUB = ast.parse(Path(uc.__file__).with_suffix(".pyi").read_text())
HOMES = [
    (name.name, node.module)
    for node in STUB.body
    if isinstance(node, ast.ImportFrom)
    for name in node.names
    if node.module
]


@pytest.mark.parametrize(("name", "home"), HOMES)
def test_a_public_name_is_public_at_home_too(name, home):
    module = import_module(f"unconstrain.{home}")
    assert getattr(uc, name) is getattr(module, name)
    assert name in module.__all__


def test_a_name_that_does_not_exist_is_answered_with_those_that_do():
    with pytest.raises(AttributeError) as caught:
        uc.LocalyLinearPolicy  # noqa: B018
    assert str(caught.value).startswith("module 'unconstrain' has no attribute 'LocalyLinearPolicy'; it has ")
    assert "LocallyLinearPolicy" in str(caught.value)


ROOMS = {
    name: f"unconstrain.{home}"
    for name, home in {
        "cluster": "training.cluster",
        "constraints": "constraints",
        "datasets": "paper.datasets",
        "errors": "base.errors",
        "experiments": "paper.experiments",
        "learners": "learners",
        "metrics": "evaluation.metrics",
        "models": "models",
        "motion": "motion",
        "policies": "policies",
        "preparation": "recordings.preparation",
        "readers": "recordings.readers",
        "robust": "learners.robust",
        "spaces": "models.spaces",
        "storage": "storage",
        "systems": "paper.systems",
        "writers": "recordings.writers",
    }.items()
}


def printed(code):
    """What a fresh interpreter prints."""
    environment = os.environ | {"PYTHONPATH": str(Path(uc.__file__).parents[1])}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    return done.stdout


def test_modules_are_there_without_further_import():
    code = "import unconstrain as uc\nfor name in {names}: print(name, getattr(uc, name).__name__)"
    assert dict(map(str.split, printed(code.format(names=list(ROOMS))).splitlines())) == ROOMS


@pytest.mark.parametrize("former", _NOW)
def test_a_module_is_the_same_under_its_former_name(former):
    assert import_module(f"unconstrain.{former}") is import_module(f"unconstrain.{_NOW[former]}")


def test_a_module_inside_a_package_that_moved_is_the_same_too():
    from unconstrain.robust.noise import noise_by_differences

    assert noise_by_differences is uc.robust.noise_by_differences
    assert import_module("unconstrain.report.table1") is import_module("unconstrain.paper.pages.table1")


def test_a_former_name_that_never_was_is_not_found():
    with pytest.raises(ModuleNotFoundError, match=r"unconstrain\.learners\.robust\.nothing"):
        import_module("unconstrain.robust.nothing")


def test_former_names_work_in_a_fresh_interpreter():
    code = "from unconstrain.robust.noise import noise_by_differences as it; from unconstrain import robust; "
    assert printed(code + "print(it is robust.noise_by_differences)") == "True\n"


def test_what_was_imported_under_a_former_name_is_pickled_under_its_own():
    from unconstrain.features import NormalisedRBF
    from unconstrain.robust.learner import Robust

    stored = pickle.dumps((NormalisedRBF, Robust(steps=3)))
    assert b"unconstrain.features" not in stored
    assert pickle.loads(stored) == (uc.NormalisedRBF, uc.Robust(steps=3))


def test_what_was_pickled_under_a_former_name_is_found():
    stored = pickle.dumps(uc.KMeansRBF(3), protocol=0).replace(b"unconstrain.models.features", b"unconstrain.features")
    assert b"unconstrain.features" in stored
    assert pickle.loads(stored) == uc.KMeansRBF(3)


def test_importing_the_package_imports_nothing_heavy():
    code = "import sys; before = set(sys.modules); import unconstrain; print(*(set(sys.modules) - before))"
    imported = printed(code).split()
    assert {name for name in imported if name.startswith("unconstrain")} == {
        "unconstrain",
        "unconstrain.base",
        "unconstrain.base.former",
    }
    assert not {"numpy", "scipy", "sklearn", "click", "rich"} & set(imported)


def test_the_version_is_that_of_the_installed_package():
    try:
        version = metadata.version("unconstrain")
    except metadata.PackageNotFoundError:
        pytest.skip("unconstrain is on the path, not installed, and so has no version")
    assert uc.__version__ == version


def test_every_error_of_ours_is_of_one_family():
    errors = [getattr(uc.errors, name) for name in uc.errors.__all__]
    assert all(issubclass(error, uc.UnconstrainError | UserWarning) for error in errors)
    assert issubclass(uc.errors.SettingError, ValueError)
    assert issubclass(uc.errors.MissingExtraError, ImportError)


API = (Path(__file__).parents[1] / "docs" / "api.rst").read_text("utf-8")
REFERENCE = re.findall(r"^   ([A-Za-z_][\w.]*)$", API, re.MULTILINE)


def named(name):
    """What a name in the reference stands for."""
    found, place = uc, "unconstrain"
    for part in name.split("."):
        place = f"{place}.{part}"
        found = getattr(found, part, None) or import_module(place)
    return found


def test_the_reference_has_every_public_name():
    assert [name for name in uc.__all__ if name not in REFERENCE] == []
    assert {"ParametricPolicy.export_ros2", "motion.orbit.Orbit"} <= {*REFERENCE}


@pytest.mark.parametrize("name", REFERENCE)
def test_each_name_of_the_reference_has_an_example_that_runs_as_printed(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some write files
    example = doctest.DocTestParser().get_doctest(inspect.getdoc(named(name)), {"np": np, "uc": uc}, name, None, 0)
    assert example.examples
    said = []
    doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS).run(example, out=said.append)
    assert not said, "".join(said)
