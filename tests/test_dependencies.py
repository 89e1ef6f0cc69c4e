"""What is imported is declared."""

import ast
import re
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def declared():
    """Distributions, of dependencies and of all extras, and the extras they are asked for, by their plain names."""
    wanted = [*PROJECT["dependencies"], *(one for extra in PROJECT["optional-dependencies"].values() for one in extra)]
    return {plain(name) for one in wanted for name in re.findall(r"[\w.-]+", re.split(r"[<>=~!;]", one)[0])}


def plain(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def imported():
    """Top-level modules of others, each with a file that imports it; ``require_extra("module", ...)`` imports too."""
    found = {}
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [node.module] if node.level == 0 else []
            elif isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("require_extra", "import_module"):
                names = [one.value for one in node.args[:1] if isinstance(one, ast.Constant) and one.value[:1] != "."]
            else:
                continue
            found |= {name.partition(".")[0]: path.relative_to(ROOT) for name in names}
    return {name: path for name, path in found.items() if name not in sys.stdlib_module_names | {"unconstrain"}}


def test_everything_imported_is_declared():
    brought_by = packages_distributions()
    missing = {
        name: str(path)
        for name, path in imported().items()
        if not {plain(one) for one in brought_by.get(name, [name])} & declared()
    }
    assert not missing


def test_the_walk_sees_plain_lazy_and_optional_imports():
    assert {"numpy", "joblib", "mujoco", "h5py"} <= imported().keys()
