"""``unconstrain export``: a policy where it is used."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any, Literal, NamedTuple

import click

import unconstrain as uc

from ..base.errors import SettingError
from .informing import GUIDE, MARK, MOVES, RAN, verdict_of
from .printing import option_for_json, say_judged
from .reading import fitted_policy, of_words
from .writing import check_outputs, option_for_force


class Target(NamedTuple):
    """What a file is called, the method of a policy that writes it, which options that takes, and what to do next."""

    what: str
    method: str
    takes: tuple[str, ...]
    next: str


_NEXT_C = "Stop the robot where {name}_support() is near 0. "
_NEXT_C += "Let it test itself where it will run:\ncc -std=c99 -D{NAME}_SELF_TEST {file} -lm -o test && ./test"
_NEXT_ONNX = "Run it on a recorded state, and compare with 'policy.predict'."
_NEXT_ROS2 = "colcon build, then colcon test; let it run with the robot held still first."

_UNIT = " Units: messages are in metres or radians, and 'scale' in {}/config makes them the policy's: 1.0 as written, "
_UNIT += "1000.0 for millimetres, 100.0 for centimetres, 57.29578 for degrees."

_MEANT = {"pose": "pose ({} as x, y, z; --messages joints for joints)"}
_MEANT["joints"] = "joints (set 'joints' in its config to the robot's own names, for {}; --messages pose for a pose)"

_CENTRED = " States as measured: it takes them relative to the mean of a demonstration; first subtract that."

TARGETS = {
    ".c": Target("C source", "export_c", ("name", "single", "notes"), _NEXT_C),
    ".onnx": Target("ONNX graph", "export_onnx", ("single", "notes"), _NEXT_ONNX),
    ".js": Target("JavaScript module", "export_javascript", ("notes",), "Import 'policy' and 'support' from it."),
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
@of_words("--messages", "joints pose", "ROS 2: what states are; by default a pose where they are x, y, z or lengths.")
@option_for_force
@option_for_json
def export(
    policy: str,
    output: str | None,
    ros2: str | None,
    name: str | None,
    single: bool,
    messages: Literal["joints", "pose"] | None,
    force: bool,
    as_json: bool,
) -> None:
    """Write POLICY as C, ONNX, JavaScript or a ROS 2 package."""
    kind = "" if output is None else Path(output).suffix.lower()
    header = str(Path(output).with_suffix(".h")) if output is not None and kind == ".c" else None
    _check(output, kind, ros2, name, single)
    check_outputs((output, header, ros2), (policy,), force)
    learnt, notes = fitted_policy(policy), uc.storage.load_notes(policy)
    notes["units"] = uc.Recipe.from_dict(notes.get("recipe", {})).units(notes.get("units", {}))  # as recorded, if old
    found, limits = verdict_of(learnt, notes), _limits(notes, ros2)
    judged = found._replace(doubt=f"{limits} {found.doubt}".rstrip())
    notes |= {MARK: f"{judged.mark.name.lower()}. {judged.said} Do not trust: {judged.doubt}"}
    notes |= dict.fromkeys((RAN, MOVES, GUIDE))
    written, then = dict[str, str](), _NEXT_ROS2
    if ros2 is not None:
        taken = learnt.export_ros2(ros2, name, messages=messages, notes=notes)
        names = ", ".join(uc.Recipe.from_dict(notes.get("recipe", {})).states or ["the states"])
        written |= {"messages": taken if as_json else _MEANT[taken].format(names), "ROS 2 package": ros2}
    if output is not None:
        target, options = TARGETS[kind], {"name": name, "single": single, "notes": notes}
        called = getattr(learnt, target.method)(output, **{option: options[option] for option in target.takes}) or ""
        then = target.next.format(NAME=called.upper(), name=called, file=shlex.quote(output))
        written[target.what] = output
    if header is not None:
        written["header"] = header
    if judged.mark is uc.evaluation.verdicts.Mark.BAD:
        then = f"It is not to be trusted as it is: {judged.next.rstrip('.')}. To try it all the same: {then}"
    first, *more = found.said.rstrip(".").split(". ")
    said = f"{'. '.join([first, *(one for one in more if 'un from' in one)])}. ('unconstrain info' says all.)"
    short = judged if as_json else found._replace(said=said, trust="", doubt=limits)
    say_judged(short._replace(next=then), written, as_json)


def _limits(notes: dict[str, Any], ros2: str | None) -> str:
    """Where a policy on a robot is not to be trusted, and in which unit it is, where nobody has said it."""
    recipe = uc.Recipe.from_dict(notes.get("recipe", {}))
    of_states = {notes.get("units", {}).get(name) for name in recipe.states or ("",)}
    unit = "" if ros2 is None or of_states in ({"mm"}, {"cm"}, {"m"}, {"deg"}, {"rad"}) else _UNIT.format(ros2)
    return f"States far from all data, where its support is near 0.{_CENTRED * recipe.centre}{unit}"


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
