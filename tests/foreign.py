"""Small files laid out as the programs of others lay them out."""

import json

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

STEPS = np.arange(30)
STATES = np.column_stack([np.cos(STEPS / 9), np.sin(STEPS / 9), STEPS / 30])
ACTIONS = np.gradient(STATES, axis=0)
"""A movement of thirty samples that each of them holds."""


def lasa(strokes):
    """A cell of structs, as the handwriting data is saved."""
    cell = np.empty((1, len(strokes)), dtype=object)
    for at, (states, times) in enumerate(strokes):
        cell[0, at] = {"pos": states.T, "vel": np.gradient(states, axis=0).T, "t": times[None]}
    return {"demos": cell, "dt": 0.1}


def robomimic(path, simulated=False, demos=3):
    with h5py.File(path, "w") as file:
        data = file.create_group("data")
        data.attrs["env_args"] = json.dumps({"env_name": "Wipe", "env_kwargs": {"control_freq": 20}})
        for at in range(demos):
            demo = data.create_group(f"demo_{at}")
            demo["actions"], demo["states"] = ACTIONS, np.ones((30, 11))
            demo.attrs["num_samples"] = 30
            if not simulated:
                demo["obs/robot0_eef_pos"], demo["next_obs/robot0_eef_pos"] = STATES, STATES + 1
        file["mask/train"] = np.array([b"demo_0", b"demo_2"])
    return path


def lerobot(root, version, episodes=3):
    frames = {
        "observation.state": pa.FixedSizeListArray.from_arrays(np.tile(STATES, (episodes, 1)).ravel(), 3),
        "action": pa.array(np.tile(ACTIONS, (episodes, 1)).astype(np.float32).tolist()),
        "timestamp": np.tile(STEPS / 30, episodes).astype(np.float32),
        "episode_index": np.repeat(np.arange(episodes), 30),
        "task_index": np.repeat(np.arange(episodes) % 2, 30),
    }
    (root / "meta").mkdir(parents=True)
    feature = {"dtype": "float32", "shape": [3], "names": {"axes": ["x", "y", "z"]}}
    info = {"codebase_version": version, "fps": 30, "features": {"observation.state": feature, "action": {}}}
    (root / "meta" / "info.json").write_text(json.dumps(info))
    table = pa.table(frames)
    chunk = root / "data" / "chunk-000"
    chunk.mkdir(parents=True)
    if version == "v3.0":
        pq.write_table(table, chunk / "file-000.parquet")
        pq.write_table(
            pa.table({"task_index": [0, 1], "task": ["wipe the table", "stir"]}), root / "meta" / "tasks.parquet"
        )
        (root / "meta" / "episodes").mkdir()
        pq.write_table(pa.table({"episode_index": [0], "length": [30]}), root / "meta" / "episodes" / "a.parquet")
        return root
    for at in range(episodes):
        pq.write_table(table.slice(30 * at, 30), chunk / f"episode_{at:06d}.parquet")
    tasks = [{"task_index": at, "task": task} for at, task in enumerate(["wipe the table", "stir"])]
    (root / "meta" / "tasks.jsonl").write_text("\n".join(map(json.dumps, tasks)))
    return root


def bag(path, kind, steps=STEPS, topics=("/joint_states", "/pose", "/tf")):
    """Joints, a pose and two frames of transforms at 50 Hz."""
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    is_first = kind == "bag"
    types = get_typestore(Stores.ROS1_NOETIC if is_first else Stores.ROS2_HUMBLE)
    if "tf2_msgs/msg/TFMessage" not in types.types:
        types.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
    packages = ("builtin_interfaces", "std_msgs", "geometry_msgs", "sensor_msgs", "tf2_msgs")
    made = [name for package in reversed(packages) for name in types.types if name.startswith(package)]
    of = {name.rpartition("/")[2]: types.types[name] for name in made}
    write = types.serialize_ros1 if is_first else types.serialize_cdr

    def header(at):
        nanoseconds = 1_700_000_000_000_000_000 + 20_000_000 * at
        stamp = of["Time"](sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
        return of["Header"](**({"seq": at} if is_first else {}), stamp=stamp, frame_id="base")

    def messages(at):
        point, turn = STATES[at].tolist(), of["Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
        pose = of["Pose"](position=of["Point"](*point), orientation=turn)
        yield "/joint_states", of["JointState"](header(at), ["a", "b", "c"], STATES[at], ACTIONS[at], np.empty(0))
        yield "/pose", of["PoseStamped"](header(at), pose)
        moved = of["Transform"](translation=of["Vector3"](*point), rotation=turn)
        yield "/tf", of["TFMessage"]([of["TransformStamped"](header(at), frame, moved) for frame in ("tool", "hand")])

    plugins = {"db3": rosbag2.StoragePlugin.SQLITE3, "mcap": rosbag2.StoragePlugin.MCAP}
    opened = rosbag1.Writer(path) if is_first else rosbag2.Writer(path, version=9, storage_plugin=plugins[kind])
    with opened as writer:
        added = {
            topic: writer.add_connection(topic, message.__msgtype__, typestore=types)
            for topic, message in messages(0)
            if topic in topics
        }
        for at in steps.tolist():
            stamp = 1_700_000_000_500_000_000 + 20_000_000 * at
            for topic, message in messages(at):
                if topic in topics:
                    writer.write(added[topic], stamp, bytes(write(message, message.__msgtype__)))
    return path
