"""What ``import unconstrain`` promises."""

import ast
import os
import subprocess
import sys
from importlib import import_module, metadata
from pathlib import Path

import pytest

import unconstrain as uc


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


def test_importing_the_package_imports_nothing_heavy():
    code = "import sys; before = set(sys.modules); import unconstrain; print(*(set(sys.modules) - before))"
    environment = os.environ | {"PYTHONPATH": str(Path(uc.__file__).parents[1])}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert {name for name in done.stdout.split() if name.startswith("unconstrain")} == {
        "unconstrain",
        "unconstrain.base",
        "unconstrain.base.former",
    }
    assert not {"numpy", "scipy", "sklearn", "click", "rich"} & set(done.stdout.split())


def test_the_version_is_that_of_the_installed_package():
    try:
        version = metadata.version("unconstrain")
    except metadata.PackageNotFoundError:
        pytest.skip("unconstrain is on the path, not installed, and so has no version")
    assert uc.__version__ == version


def test_every_error_of_ours_is_of_one_family():
    errors = [getattr(uc.errors, name) for name in uc.errors.__all__]
    assert all(issubclass(error, uc.UnconstrainError) for error in errors)
    assert issubclass(uc.errors.SettingError, ValueError)
    assert issubclass(uc.errors.MissingExtraError, ImportError)
