"""The exported ROS 2 package, built and driven at the level of messages, without ROS."""

import subprocess
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from threading import Event
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from samples import draw
from unconstrain.base.errors import SettingError

MOCK = Path(__file__).parent / "ros2"
STRICT = ["-O2", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror"]
REAL_TIME = ["rate=1e9", "timeout=0.01"]


def learnt(n, columns=None):
    data = draw(samples=300, policy=lambda x: np.sin(x @ np.eye(n)[::-1]) + 0.1 * x, dimensions=n)
    centres = np.random.default_rng(1).uniform(-1, 1, (50, n))
    policy = uc.LocallyLinearPolicy(0.5 * n / 3, centres=centres, learner=uc.Direct()).fit(data.states, data.actions)
    return policy, data.states, {"recipe": {"states": columns or [f"q{i}" for i in range(n)]}}


def node_of(policy, notes, folder, **settings):
    """The node as a program that is driven by lines."""
    policy.export_ros2(folder / "wiping", notes=notes, **settings)
    include = [f"-I{folder}/wiping/include", f"-I{folder}/wiping/include/wiping", f"-I{MOCK}"]
    subprocess.run(["gcc", "-std=c99", *STRICT, "-c", "wiping/src/wiping.c", "-o", "p.o"], cwd=folder, check=True)
    pose = ["-DPOSE"] if "pose_stamped" in (folder / "wiping/include/wiping/messages.hpp").read_text() else []
    sources = ["wiping/src/wiping_node.cpp", f"{MOCK}/drive.cpp", "p.o"]
    command = ["g++", "-std=c++17", *STRICT, *pose, *include, *sources, "-lm", "-o", "node"]
    subprocess.run(command, cwd=folder, check=True)

    def drive(*lines, parameters=()):
        text = "".join(f"{line}\n" for line in lines)
        done = subprocess.run([folder / "node", *parameters], input=text, capture_output=True, text=True, check=True)
        topics, *answers = done.stdout.splitlines()
        return topics, answers, done.stderr

    return drive


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    policy, states, notes = learnt(7)
    return policy, states, node_of(policy, notes, tmp_path_factory.mktemp("arm"))


def state(x):
    return "state " + " ".join(repr(float(value)) for value in x)


NAMES = "names " + " ".join(f"q{i}" for i in range(7))


def numbers(line):
    return np.array(line.split(), float)


def test_the_node_commands_what_the_policy_says_whatever_the_order_of_the_joints(arm):
    policy, states, drive = arm
    near = states[policy.support(states) > 0.05][:5]
    turned = [6, 0, 3, 2, 1, 5, 4]
    lines = ["names other " + " ".join(f"q{i}" for i in turned)]
    lines += ["state 99 " + state(x[turned]).removeprefix("state ") for x in near]
    topics, answers, said = drive(*lines, parameters=[*REAL_TIME, "velocity_limit=1e3", "command_topic=/arm/commands"])
    assert topics == "~/state /arm/commands"
    assert_allclose([numbers(line) for line in answers], policy(near), atol=1e-12)
    assert said == ""


def test_the_node_shortens_what_is_too_fast(arm):
    policy, states, drive = arm
    x = states[policy.support(states) > 0.05][0]
    wanted = policy(x[None])[0]
    _, [line], _ = drive(NAMES, state(x), parameters=[*REAL_TIME, "velocity_limit=0.05"])
    assert_allclose(numbers(line), 0.05 * wanted / np.linalg.norm(wanted), atol=1e-12)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ([NAMES, state(np.full(7, 30.0))], "far from all data"),
        ([NAMES, "state nan 0 0 0 0 0 0"], "far from all data"),
        ([NAMES.replace("q3", "elbow"), state(np.zeros(7))], "not of this policy"),
        ([NAMES, "state 0 0 0"], "not of this policy"),
    ],
)
def test_the_node_stops_where_it_cannot_know(arm, lines, said):
    _, [line], errors = arm[2](*lines, parameters=REAL_TIME)
    assert_array_equal(numbers(line), 0.0)
    assert said in errors


def test_the_node_stops_once_when_no_state_comes(arm):
    policy, states, drive = arm
    x = states[policy.support(states) > 0.05][0]
    _, [moving, rest, nothing], said = drive(NAMES, state(x), "silence", "silence", parameters=REAL_TIME)
    assert numbers(moving).any()
    assert_array_equal(numbers(rest), 0.0)
    assert nothing == "none"
    assert said.count("no state has come") == 1


def test_the_node_keeps_its_rate(arm):
    policy, states, drive = arm
    x = states[policy.support(states) > 0.05][0]
    _, answers, _ = drive(NAMES, state(x), state(x), parameters=["rate=5"])
    assert answers[1] == "none" != answers[0]


def test_a_command_takes_less_than_fifty_microseconds(arm):
    policy, states, drive = arm
    x = states[policy.support(states) > 0.05][0]
    _, [_, nanoseconds], _ = drive(NAMES, state(x), "time 2001", parameters=REAL_TIME)
    assert float(nanoseconds) < 50e3


def test_a_pose_is_taken_in_its_frame_and_in_metres(tmp_path):
    policy, states, notes = learnt(3, ["tool_x", "tool_y", "tool_z"])
    drive = node_of(policy, notes, tmp_path)
    near = states[policy.support(states) > 0.05][:3]
    lines = ["frame map", state(near[0] / 1000), "frame base_link", *(state(x / 1000) for x in near)]
    _, [elsewhere, *answers], said = drive(*lines, parameters=[*REAL_TIME, "scale=1000", "velocity_limit=1"])
    assert elsewhere.split() == ["0", "0", "0", "base_link"]
    assert "not of this policy" in said
    assert_allclose([numbers(line.removesuffix("base_link")) for line in answers], policy(near) / 1000, atol=1e-14)


def test_the_package_says_what_it_needs(tmp_path):
    policy, _, notes = learnt(3, ["x", "y", "z"])
    policy.export_ros2(tmp_path / "My-Wiping", notes=notes | {"units": dict.fromkeys("xyz", "mm")})
    root = tmp_path / "My-Wiping"
    package = ET.parse(root / "package.xml").getroot()
    assert package.findtext("name") == "my_wiping"
    assert {each.text for each in package.findall("depend")} == {"rclcpp", "geometry_msgs"}
    assert "find_package(geometry_msgs REQUIRED)" in (root / "CMakeLists.txt").read_text()
    assert "scale: 1000.0" in (root / "config" / "my_wiping.yaml").read_text()
    assert "states: x (mm), y (mm), z (mm)" in (root / "README.md").read_text()
    for file in ("launch/my_wiping.launch.py", "scripts/my_wiping_loop.py"):
        compile((root / file).read_text(), file, "exec")
    assert "@" not in (root / "src" / "my_wiping_node.cpp").read_text()


def test_what_is_long_stays_one_item_of_the_list_in_the_readme(tmp_path):
    policy, _, notes = learnt(3, ["x", "y", "z"])
    notes |= {"sources": [f"wipe_{k}.csv" for k in range(30)]}
    policy.export_ros2(tmp_path / "wipe", notes=notes)
    listed = (tmp_path / "wipe" / "README.md").read_text().partition("- ")[2].partition("\n\n")[0]
    items = f"\n{listed}".split("\n- ")
    named = policy.describe(policy.closed_form(), notes).whole
    assert len(items) == len(named)
    assert any("\n  " in item for item in items)


def loop_of(folder):
    """The loop in Python beside a node."""
    spec = spec_from_file_location("wiping_loop", folder / "wiping" / "scripts" / "wiping_loop.py")
    loop = module_from_spec(spec)
    spec.loader.exec_module(loop)
    return loop


def looped(loop, policy, states):
    """What the loop commands at states, when then none comes, and at its end."""
    loop.RATE, loop.TIMEOUT = 1e4, 0.02
    at, left, commanded, late = iter(states), iter(range(len(states) + 1, -1, -1)), [], Event()
    loop.run(policy, lambda: next(at, None) if len(commanded) < len(states) else late.wait(1), commanded.append,
             lambda: next(left) > 0)  # fmt: skip
    return commanded


def aimed(kind):
    """A policy whose speed grows with the distance, local or one model, guided or not, as a file keeps it."""
    data = draw(samples=300, policy=lambda x: np.array([0.5, 0.0, 0.0]) - x, dimensions=3)
    width, _, guided = kind.partition(" ")
    if width == "parametric":
        policy = uc.ParametricPolicy(uc.Affine(), "direct")
    else:
        policy = uc.LocallyLinearPolicy({"local": 2.0, "affine": np.inf}.get(width, width), learner="direct")
    policy.fit(data.states, data.actions)
    if not guided:
        return policy
    down = uc.rollout(lambda x: -x, np.random.default_rng(0).uniform(-1, 1, (6, 3)), 60, 0.1)
    return uc.Guided(policy, [0.0, 0.0, 0.0], demonstrations=down)


@pytest.mark.parametrize("kind", ["parametric", "parametric guided", "local", "affine", "cubic", "local guided"])
def test_the_loop_in_python_is_that_of_the_node(kind, tmp_path):
    uc.save(aimed(kind), tmp_path / "p.npz", notes={"recipe": {"states": ["x", "y", "z"]}})
    policy = uc.load(tmp_path / "p.npz", object)
    drive, loop = node_of(policy, uc.storage.load_notes(tmp_path / "p.npz"), tmp_path), loop_of(tmp_path)
    rng = np.random.default_rng(1)
    states = np.concatenate([width * rng.uniform(-1, 1, (8, 3)) for width in (0.1, 1.0, 2.0, 4.0)])
    states = np.concatenate([states, np.full((1, 3), 1e4), np.full((1, 3), np.nan), [[np.inf, 0.0, 0.0]]])
    for normal in (None, [0.0, 2.0, 1.0])[: 1 + ("guided" in kind)]:
        parameters = [*REAL_TIME] if normal is None else [*REAL_TIME, "normal=0,2,1"]
        lines = ["frame base_link", *map(state, states), state(states[0]), "silence"]
        _, answers, _ = drive(*lines, parameters=parameters)
        node = np.array([numbers(line.removesuffix("base_link")) for line in answers])
        loop.NORMAL = normal
        commanded = looped(loop, policy, [*states, states[0]])
        assert_allclose(commanded, [*node, np.zeros(3)], atol=1e-12)
        speeds = np.linalg.norm(node, axis=1)
        assert_array_equal(speeds[[*range(16), *range(-5, 0)]] > 0, [True] * 16 + [False] * 3 + [True, False])
        assert speeds.max() <= loop.VELOCITY_LIMIT * (1 + 1e-12) < np.linalg.norm(policy(states[-3:-2]))
        if normal is not None:
            assert np.abs(node @ normal).max() < 1e-12


def test_the_loop_in_python_rests_while_nothing_is_read_goes_on_and_says_what_went_wrong(tmp_path):
    policy, _, notes = learnt(3, ["x", "y", "z"])
    policy.export_ros2(tmp_path / "wiping", notes=notes)
    loop, commanded = loop_of(tmp_path), []
    loop.RATE, loop.TIMEOUT = 1e4, 0.02
    told = iter(
        [np.zeros(3), TimeoutError("nothing came"), None, np.zeros(2), np.zeros(3), OSError("the robot is off")]
    )

    def read():
        found = next(told)
        if isinstance(found, Exception):
            raise found
        return found

    with pytest.raises(OSError, match="the robot is off"):
        loop.run(policy, read, commanded.append)
    assert [velocity.any() for velocity in commanded] == [True, False, False, False, True, False]


def test_the_node_takes_no_normal_that_is_none(tmp_path):
    drive = node_of(aimed("parametric guided"), {"recipe": {"states": ["x", "y", "z"]}}, tmp_path)
    with pytest.raises(subprocess.CalledProcessError) as refused:
        drive("frame base_link", parameters=["normal=0,0,0"])
    assert "normal: expected 3 numbers, not all zero" in refused.value.stderr


def test_the_loop_in_python_commands_the_same_and_rests_at_the_end(tmp_path):
    policy, states, notes = learnt(3, ["x", "y", "z"])
    policy.export_ros2(tmp_path / "wiping", notes=notes)
    loop = loop_of(tmp_path)
    loop.RATE, loop.VELOCITY_LIMIT = 1e4, 0.5
    near = states[policy.support(states) > 0.05][:4]
    at, commanded = iter([*near, np.full(3, 50.0)]), []
    left = iter(range(5, -1, -1))
    loop.run(policy, lambda: next(at), commanded.append, running=lambda: next(left) > 0)
    wanted = policy(near)
    share = np.minimum(1.0, 0.5 / np.linalg.norm(wanted, axis=1, keepdims=True))
    assert_allclose(commanded, [*(wanted * share), np.zeros(3), np.zeros(3)], atol=1e-12)
    with pytest.raises(NotImplementedError, match="how the state of your robot is read"):
        loop.read()


def test_an_orientation_is_refused(tmp_path):
    data = draw(samples=60, policy=lambda x: x, dimensions=4)
    unit = data.states / np.linalg.norm(data.states, axis=1, keepdims=True)
    turning = uc.ParametricPolicy(uc.Affine(), "direct", space=uc.spaces.Sphere())
    turning.fit(unit, data.actions[:, :3])
    with pytest.raises(SettingError, match="states hold an orientation"):
        turning.export_ros2(tmp_path / "turning")
    assert not list(tmp_path.iterdir())


def test_actions_that_are_no_velocities_are_refused(tmp_path):
    data = draw(samples=300, policy=lambda x: -x, dimensions=4)
    policy = uc.ParametricPolicy(uc.Affine(), "direct").fit(data.states, data.actions[:, :2])
    refused_as = "4 states .* 2 actions .* accelerations are wrong there. Export it as C, ONNX"
    for messages in (None, "joints", "pose"):
        with pytest.raises(SettingError, match=refused_as):
            policy.export_ros2(tmp_path / "reach", messages=messages)
    policy.export_c(tmp_path / "reach.c")
    assert not (tmp_path / "reach").exists()


@pytest.mark.parametrize(
    ("recipe", "units"),
    [
        ({"states": ["x", "y"], "actions": ["ax", "ay"]}, {}),
        ({"states": ["x", "vx"], "actions": ["vx", "ax"]}, {}),
        ({"states": ["x", "vx"]}, {}),
        ({"states": ["q1", "q2"], "actions": ["qdd1", "qdd2"]}, {}),
        ({"states": ["x", "y"], "actions": ["x_ddot", "y_ddot"]}, {}),
        ({"states": ["x", "y"], "actions": ["acc_x", "acc_y"]}, {}),
        ({"states": ["x", "y"], "actions": ["u1 [m/s^2]", "u2 [m/s^2]"]}, {}),
        ({"states": ["x", "y"], "actions": ["u1", "u2"]}, {"u1": "rad/s²", "u2": "rad/s²"}),
    ],
)
def test_accelerations_are_known_by_names_and_units(tmp_path, recipe, units):
    policy, _, _ = learnt(2)
    with pytest.raises(SettingError, match="accelerations are wrong"):
        policy.export_ros2(tmp_path / "reach", notes={"recipe": recipe, "units": units})


@pytest.mark.parametrize(
    ("recipe", "units"),
    [
        ({"states": ["x", "y"], "actions": ["vx", "vy"]}, {"vx": "m/s"}),
        ({"states": ["pos1", "pos2"]}, {}),
        ({"states": ["q1", "q2"], "actions": ["qd1", "qd2"]}, {}),
        ({"states": ["x [mm]", "y [mm]"], "actions": ["dx [mm/s]", "dy [mm/s]"]}, {}),
        ({"states": ["observation.state.0", "observation.state.1"], "actions": ["action.0", "action.1"]}, {}),
    ],
)
def test_velocities_are_taken_whatever_they_are_called(tmp_path, recipe, units):
    policy, _, _ = learnt(2)
    policy.export_ros2(tmp_path / "reach", notes={"recipe": recipe, "units": units})
    assert (tmp_path / "reach" / "README.md").exists()


def test_actions_of_arrays_are_not_called_velocities(tmp_path):
    pandas = pytest.importorskip("pandas")
    data = draw(samples=300, policy=lambda x: -x, dimensions=2)
    frame = pandas.DataFrame(data.states, columns=["x", "y"])
    policy = uc.ParametricPolicy(uc.Affine(), "direct").fit(frame, data.actions)
    told = policy.describe(policy.closed_form()).whole
    assert (told["states"], told["actions"]) == ("x, y", "u1, u2")
