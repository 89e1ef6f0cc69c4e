"""``unconstrain export``: a policy where it is used."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, NamedTuple

import click

import unconstrain as uc

from ..base.errors import SettingError
from .reading import fitted_policy
from .writing import check_outputs, option_for_force


class Target(NamedTuple):
    """What a file is called, the method of a policy that writes it, and which options that takes."""

    what: str
    method: str
    takes: tuple[str, ...]


TARGETS = {
    ".c": Target("C source", "export_c", ("name", "single", "notes")),
    ".onnx": Target("ONNX graph", "export_onnx", ("single", "notes")),
    ".js": Target("JavaScript module", "export_javascript", ()),
}
"""By the suffix of the file."""


@click.command(
    epilog="\b\nExample:\n  unconstrain export wipe.npz -o wipe.c --float\n  unconstrain export wipe.npz --ros2 wipe"
)
@click.argument("policy", type=click.Path())
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="File that ends in .c, .onnx or .js.")
@click.option("--ros2", type=click.Path(file_okay=False), help="Folder for a ROS 2 package with a node.")
@click.option("--name", help="C, ROS 2: what all names begin with; by default as the file or folder is called.")
@click.option("--float", "single", is_flag=True, help="Compute in single precision.")
@click.option(
    "--messages",
    type=click.Choice(["joints", "pose"]),
    help="ROS 2: what states are; by default a pose where they are called x, y, z.",
)
@option_for_force
def export(
    policy: str,
    output: str | None,
    ros2: str | None,
    name: str | None,
    single: bool,
    messages: Literal["joints", "pose"] | None,
    force: bool,
) -> None:
    """Write POLICY as C, ONNX, JavaScript or a ROS 2 package."""
    kind = "" if output is None else Path(output).suffix.lower()
    header = str(Path(output).with_suffix(".h")) if output is not None and kind == ".c" else None
    _check(output, kind, ros2, name, single)
    check_outputs((output, header, ros2), (policy,), force)
    learnt, notes = fitted_policy(policy, uc.Policy | uc.Guided), uc.storage.load_notes(policy)
    if output is not None:
        target, options = TARGETS[kind], {"name": name, "single": single, "notes": notes}
        getattr(learnt, target.method)(output, **{option: options[option] for option in target.takes})
        click.echo(f"{target.what}: {output}")
    if header is not None:
        click.echo(f"header: {header}")
    if ros2 is not None:
        learnt.export_ros2(ros2, name, messages=messages, notes=notes)
        click.echo(f"ROS 2 package: {ros2}")


def _check(output: str | None, kind: str, ros2: str | None, name: str | None, single: bool) -> None:
    if output is None and ros2 is None:
        raise SettingError("export: got nothing to write to, expected -o FILE (.c, .onnx, .js) or --ros2 FOLDER.")
    if output is not None and kind not in TARGETS:
        raise SettingError(
            f"{output}: got the suffix {kind!r}, expected .c for C source, .onnx for an ONNX graph, or .js for a "
            "JavaScript module."
        )
    if name is not None and kind != ".c" and ros2 is None:
        raise SettingError(f"--name: belongs to C source and to ROS 2, got {output}.")
    if single and (output is None or "single" not in TARGETS[kind].takes):
        raise SettingError("--float: belongs to C source and ONNX graphs; all else computes in double precision.")
