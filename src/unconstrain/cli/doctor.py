"""What is installed, what is missing, and the command that installs it."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import NamedTuple

EXTRAS = {
    "viz": ("figures and reports", ("jinja2", "matplotlib")),
    "data": ("Parquet, HDF5, public recordings", ("pyarrow", "h5py", "pooch")),
    "formats": ("ROS and Excel files", ("rosbags", "python-calamine")),
    "arm": ("arms from URDF files", ("yourdfpy",)),
    "sim": ("wiping with contact", ("mujoco", "mink", "pillow")),
    "onnx": ("export to ONNX", ("onnx", "onnxruntime")),
    "rerun": ("recordings for the viewer rerun", ("rerun-sdk",)),
    "live": ("policies in the browser", ("viser", "yourdfpy")),
    "cluster": ("learning on many machines", ("dask", "distributed")),
    "arrays": ("learning from tensors", ("array-api-compat",)),
}
"""What each extra serves, and what it brings."""


class Finding(NamedTuple):
    """One line of the table."""

    what: str
    serves: str
    found: str
    fix: str


def examine() -> list[Finding]:
    """Find the versions of Python and the extras, and the back-end that renders the scene."""
    found = [Finding("Python", "everything", platform.python_version(), "")]
    for extra, (serves, packages) in EXTRAS.items():
        versions = {package: _version(package) for package in packages}
        missing = [package for package, number in versions.items() if number is None]
        said = ", ".join(f"{package} {number or 'missing'}" for package, number in versions.items())
        fix = f"pip install 'unconstrain[{extra}]'" if missing else ""
        found.append(Finding(extra, serves, said, fix))
    return [*found, _graphics()]


def _graphics() -> Finding:
    from ..paper.simulation import BACKENDS, backend

    what, serves = "graphics", "pictures of the arm without a screen"
    if _version("mujoco") is None:
        return Finding(what, serves, "needs sim", "pip install 'unconstrain[sim]'")
    works = backend()
    if works is None:
        return Finding(what, serves, "neither EGL nor OSMesa works", f"apt-get install {BACKENDS['egl']} libegl-mesa0")
    return Finding(what, serves, works or "the system's own", "")


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
