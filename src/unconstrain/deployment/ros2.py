"""A policy as a ROS 2 package: a node around the C source, and a loop in Python for where there is no ROS."""

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from ..base.arrays import Array
from ..base.display import bare, speed_of, with_unit
from ..base.errors import SettingError
from ..base.files import put_folder, workshop
from ..models import ClosedForm, spaces
from .c99 import c_name, c_source, speed_limit
from .description import CENTRED, Description
from .filling import filled, own_version

DISTRIBUTIONS = ("Humble", "Jazzy", "Rolling")
"""Of ROS 2, whose interfaces the node is written for."""

Messages = Literal["joints", "pose"]
"""Where states come from and velocities go to."""

_MESSAGES = {
    "joints": ("sensor_msgs/JointState", "std_msgs/Float64MultiArray"),
    "pose": ("geometry_msgs/PoseStamped", "geometry_msgs/TwistStamped"),
}
"""Messages that come in and go out."""

_ACCELERATION = re.compile(r"(?i)accel|ddot|(^|[^a-z])(acc([^a-z]|$)|dd)|[a-z]dd[_.]?\d|/ ?s(\^|\*\*)?[2²]|/s/s")
"""What a column of accelerations is called, or its unit: ``"qdd1"``, ``"x_ddot"``, ``"acc_x"``, ``"u1 (m/s^2)"``."""

_JOINT = re.compile(r"(?i)joint|axis|slide|rail|(^|[^a-z])[qj]_?\d")
"""What a column of joints is called, also where these are lengths."""

_OWN = "the names of the robot's own joints, in this order, as in its messages, such as [elbow_joint, wrist_joint]"
_SET = {"joints": f"Set `joints` to {_OWN}. Until then the node rests. As written they are the recorded columns"}
_SET["pose"] = "Taken as x, y and z of the pose, in the frame `frame`, are"

_PLACES = {
    "package.xml": "package.xml",
    "CMakeLists.txt": "CMakeLists.txt",
    "README.md": "README.md",
    "node.cpp": "src/{name}_node.cpp",
    "parameters.yaml": "config/{name}.yaml",
    "launch.py": "launch/{name}.launch.py",
    "loop.py": "scripts/{name}_loop.py",
}
"""Where in the package a template belongs."""


def export_ros2(
    form: ClosedForm,
    policy: Callable[[Array], Array],
    folder: str | os.PathLike[str],
    name: str | None,
    described: Description,
    messages: Messages | None = None,
) -> Messages:
    """Write a package with a node that takes each state to a velocity, in place of a folder that is there.

    Node and loop limit the speed, stop where the support of the data ends, and stop when no state comes.
    """
    package = c_name(Path(os.path.realpath(folder)).name if name is None else name).lower()
    names, units = [*map(bare, described.states)], {described.units.get(name) for name in described.states}
    lengths = len(names) == 3 and units <= {"m", "cm", "mm"} and not any(map(_JOINT.search, names))
    places = lengths or [name[-1:].lower() for name in names] == ["x", "y", "z"]
    kind: Messages = messages or ("pose" if places else "joints")
    _check(form, kind, described)
    fill = _words(package, form, described, kind)
    fill |= {"limit": repr(max(1e-9, speed_limit(form, policy, described)))} | _plane(form, fill)
    with workshop(folder) as made:
        made.joinpath("new").mkdir()
        root = made / "new"
        source = c_source(form, package, policy, described, f"{package}.c")
        parts = {place.format(name=package): filled(f"ros2_{part}", fill) for part, place in _PLACES.items()}
        parts[f"include/{package}/messages.hpp"] = filled(f"ros2_{kind}.hpp", fill)
        parts[f"include/{package}/{package}.h"] = source.header
        parts[f"src/{package}.c"] = source.source
        for place, text in parts.items():
            (root / place).parent.mkdir(parents=True, exist_ok=True)
            (root / place).write_text(text)
        put_folder(root, folder)
    return kind


def _words(package: str, form: ClosedForm, described: Description, kind: Messages) -> dict[str, str]:
    received, sent = _MESSAGES[kind]
    used = sorted({each.split("/")[0] for each in (received, sent)})
    units = {described.units.get(column, "") for column in described.states}
    joints = ", ".join(map(json.dumps, described.states))
    return {
        "name": package,
        "NAME": package.upper(),
        "version": own_version(),
        "distributions": ", ".join(DISTRIBUTIONS),
        "depends": "\n".join(f"  <depend>{each}</depend>" for each in used),
        "find": "\n".join(f"find_package({each} REQUIRED)" for each in used),
        "targets": " ".join(f"${{{each}_TARGETS}}" for each in used),
        "own": f"joints: [{joints}]  # {_OWN}" if kind == "joints" else "frame: base_link",
        "set": f"{_SET[kind]}: {', '.join(described.states)}.",
        "joints": joints,
        "state_message": received,
        "command_message": sent,
        "comment": "\n".join(f"# {line}" for line in described.comment()),
        "about": "\n".join(line if line[0] == " " else f"- {line}" for line in described.comment()),
        "n": str(form.columns),
        "d": str(form.sizes[1]),
        "scale": {"mm": "1000.0", "cm": "100.0", "deg": "57.29578"}.get("".join(units), "1.0"),
    }


def _plane(form: ClosedForm, fill: dict[str, str]) -> dict[str, str]:
    """What takes the normal of a plane that a guided policy is told of; other policies need not know it."""
    parts = {"plane": "ros2_plane.cpp", "normal": "ros2_plane.py", "told": "ros2_plane.yaml"}
    if form.correction is None:
        return dict.fromkeys(parts, "") | {"call": "step(state.data(), ", "step_of": "policy.step"}
    said = {word: filled(part, fill) for word, part in parts.items()}
    return said | {"call": "under(state.data(), plane_.data(), ", "step_of": "told(policy)"}


def _check(form: ClosedForm, kind: Messages, described: Description) -> None:
    n, d, _ = form.columns, *form.sizes[1:]
    if any(isinstance(factor, spaces.Sphere) for factor in form.embedding.space.factors):
        raise SettingError("ros2: states hold an orientation; the node takes joints, or the position of a pose.")
    if described.lines.get("centring") == CENTRED:
        raise SettingError(
            "ros2: states are relative to the mean of each demonstration (--centre), which the node cannot know. Learn "
            "without it; or export it as C, ONNX or JavaScript, and subtract that mean from states."
        )
    if n != d or _of_second_order(described):
        raise SettingError(
            f"ros2: got {n} states ({', '.join(described.states)}) and {d} actions ({', '.join(described.actions)}), "
            "expected positions and their velocities, which the node commands: accelerations are wrong there. Export "
            "it as C, ONNX or JavaScript for a controller that takes such actions, or learn velocities of positions."
        )
    if kind == "pose" and (n, d) != (3, 3):
        raise SettingError(f"ros2: got {n} states and {d} actions, expected three of each for the position of a pose.")


def _of_second_order(described: Description) -> bool:
    """Whether columns, by names or units, are accelerations, or velocities among the states."""
    plain = [bare(name) for name in described.states]
    called = [with_unit(name, described.units.get(name)) for name in described.actions]
    named = {bare(name) for name in called}.intersection(f"a{name}" for name in plain)
    return bool(named or {*plain}.intersection(map(speed_of, plain)) or any(map(_ACCELERATION.search, called)))
