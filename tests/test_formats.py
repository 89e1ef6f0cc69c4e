"""Files as others lay them out: MATLAB, HDF5 of robot learning, LeRobot, JSON, Excel, ROS, C3D, folders."""

from __future__ import annotations

import json
import zipfile
from itertools import pairwise

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from foreign import ACTIONS, STATES, STEPS, bag, lasa, lerobot, robomimic
from recorded import DATA as RECORDED
from recorded import needs_data
from unconstrain.base.errors import ReadError, SettingError, UnconstrainError
from unconstrain.recordings.preparation.recipes import complete_recipe
from unconstrain.recordings.readers import parquet, read_blocks
from unconstrain.recordings.readers.mat5 import read_mat5


def names(recordings):
    return [recording.name for recording in recordings]


def guessed(recording):
    recipe = complete_recipe(uc.Recipe(), recording)
    return recipe.states, recipe.actions or recipe.differentiate


# NumPy


@pytest.mark.parametrize("lies", [False, True])
def test_one_array_is_read_whichever_way_it_lies(tmp_path, lies):
    np.save(tmp_path / "a.npy", STATES.T if lies else STATES)
    [recording] = uc.read(tmp_path / "a.npy", columns=("x", "y", "z"))
    assert_array_equal(recording.values, STATES)
    assert recording.columns == ("x", "y", "z")
    assert [remark.code for remark in recording.remarks] == ["orientation"] * lies
    assert_array_equal(np.concatenate([part.values for part in read_blocks(tmp_path / "a.npy")]), STATES)


def test_an_array_in_parts_holds_demonstrations(tmp_path):
    np.save(tmp_path / "a.npy", np.stack([STATES, 2 * STATES]))
    first, second = uc.read(tmp_path / "a.npy")
    assert_array_equal(second.values, 2 * first.values)


def test_arrays_of_an_archive_with_one_length_are_columns(tmp_path):
    np.savez(tmp_path / "a.npz", q=STATES, dq=ACTIONS.T, t=STEPS * 0.1, gain=3.0, odd=np.zeros(7))
    [recording] = uc.read(tmp_path / "a.npz")
    assert guessed(recording) == (("q1", "q2", "q3"), ("dq1", "dq2", "dq3"))
    assert_array_equal(recording.select(["dq1", "dq2", "dq3"]), ACTIONS)
    assert_allclose(recording.times, STEPS * 0.1)
    assert recording.attributes["gain"] == 3.0
    assert [(remark.code, remark.column) for remark in recording.remarks] == [("dropped-column", "odd")]


def test_an_archive_may_say_where_episodes_end(tmp_path):
    np.savez(tmp_path / "a.npz", obs=STATES, actions=ACTIONS, episode_ends=np.array([10, 30]))
    first, second = uc.read(tmp_path / "a.npz")
    assert_array_equal(second.select(["obs1", "obs2", "obs3"]), STATES[10:])
    assert (len(first), first.remarks) == (10, ())
    assert guessed(first) == (("obs1", "obs2", "obs3"), ("actions1", "actions2", "actions3"))


def test_columns_of_what_has_no_names_can_be_named(tmp_path):
    np.savez(tmp_path / "a.npz", demo_1=np.ones((20, 2)).cumsum(axis=0), demo_2=np.ones((30, 2)).cumsum(axis=0))
    found = uc.read(tmp_path / "a.npz")
    assert [(one.name, one.columns) for one in found] == [
        (f"a/demo_{number}", ("column1", "column2")) for number in (1, 2)
    ]
    assert {one.columns for one in uc.read(tmp_path / "a.npz", columns=("x", "y"))} == {("x", "y")}
    scipy.io.savemat(tmp_path / "b.mat", {"A": np.ones((20, 2)).cumsum(axis=0)})
    assert uc.read(tmp_path / "b.mat", columns=("x", "y"))[0].columns == ("x", "y")
    with pytest.raises(ReadError, match="got 1 names of columns"):
        uc.read(tmp_path / "b.mat", columns=("x",))
    with pytest.raises(SettingError, match="says itself what its columns are called"):
        uc.read(lerobot(tmp_path / "set", "v3.0"), columns=("x", "y"))


@pytest.mark.parametrize("axis", [0, 2])
def test_an_array_of_demonstrations_may_have_them_first_or_last(tmp_path, axis):
    scipy.io.savemat(tmp_path / "a.mat", {"all": np.stack([STATES, 2 * STATES], axis=axis)})
    first, second = uc.read(tmp_path / "a.mat")
    assert_array_equal(first.values, STATES)
    assert_array_equal(second.values, 2 * STATES)


@pytest.mark.parametrize("lengths", [(30, 30), (30, 20)])
def test_numbered_arrays_of_an_archive_are_demonstrations(tmp_path, lengths):
    np.savez(tmp_path / "a.npz", **{f"demo_{at}": STATES[:length] for at, length in enumerate(lengths)})
    assert [len(each) for each in uc.read(tmp_path / "a.npz")] == list(lengths)


def in_container(path, **arrays):
    if path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            file.update(arrays)
    elif path.suffix == ".npz":
        np.savez(path, **arrays)
    else:
        scipy.io.savemat(path, arrays)
    return path


DEEP = np.stack([STATES, 2 * STATES, 3 * STATES])
STAMPS = STEPS * 0.1


@pytest.mark.parametrize("suffix", [".npz", ".h5", ".mat"])
@pytest.mark.parametrize("clock", [STAMPS, STAMPS[None], np.stack([STAMPS] * 3), np.stack([STAMPS] * 3)[:, :, None]])
@pytest.mark.parametrize("more", [{}, {"label": np.arange(3)}])
def test_demonstrations_in_one_array_share_a_clock_or_have_one_each(tmp_path, suffix, clock, more):
    found = uc.read(in_container(tmp_path / f"a{suffix}", q=DEEP, t=clock, **more))
    assert [one.columns for one in found] == [("q1", "q2", "q3")] * 3
    for recording, states in zip(found, DEEP, strict=True):
        assert_array_equal(recording.values, states)
        assert_array_equal(recording.times, STAMPS)


def test_what_has_as_many_samples_goes_along_with_demonstrations_in_one_array(tmp_path):
    force = np.outer([1.0, 2.0, 3.0], STAMPS)
    path = in_container(tmp_path / "a.npz", q=DEEP.transpose(0, 2, 1), f=force, ticks=STAMPS)
    _, second, _ = uc.read(path, time="ticks")
    assert second.columns == ("q1", "q2", "q3", "f")
    assert_array_equal(second.values, np.column_stack([DEEP[1], force[1]]))
    assert_array_equal(second.times, STAMPS)


@pytest.mark.parametrize("suffix", [".npz", ".h5", ".mat"])
@pytest.mark.parametrize("axes", [(0, 1, 2), (0, 2, 1), (1, 2, 0)])
def test_arrays_of_like_demonstrations_are_columns_of_the_same(tmp_path, suffix, axes):
    states, actions = np.tile(DEEP, (1, 2, 1)), np.tile(-DEEP[:, :, :2], (1, 2, 1))
    path = in_container(tmp_path / f"a{suffix}", states=states.transpose(axes), actions=actions.transpose(axes))
    found = uc.read(path)
    by_name = suffix == ".h5"  # which keeps no other order
    assert by_name or [one.columns for one in found] == [("x1", "x2", "x3", "u1", "u2")] * 3
    for one, *parts in zip(found, states, actions, strict=True):
        assert_array_equal(one.values, np.column_stack(parts[::-1] if by_name else parts))


@pytest.mark.parametrize("suffix", [".npz", ".h5", ".mat"])
def test_a_number_for_each_demonstration_does_not_hide_them(tmp_path, suffix):
    assert len(uc.read(in_container(tmp_path / f"a{suffix}", q=DEEP, success=np.arange(3)))) == 3


@pytest.mark.parametrize("suffix", [".npz", ".h5", ".mat"])
@pytest.mark.parametrize(
    "stamps", [STAMPS[1:], STAMPS[::-1], np.sin(STEPS), np.ones(len(STEPS)), np.stack([STAMPS, STAMPS, -STAMPS])]
)
def test_what_is_no_clock_of_demonstrations_in_one_array_is_refused(tmp_path, suffix, stamps):
    with pytest.raises(
        ReadError, match="t does not increase as a clock, or not with the samples of the rest"
    ) as caught:
        uc.read(in_container(tmp_path / f"a{suffix}", q=DEEP, t=stamps))
    assert f"q {DEEP.shape}" in str(caught.value)
    assert f"t {stamps.shape}. Give a stamp for each sample" in str(caught.value)


@pytest.mark.parametrize(
    "deep", [np.tile(np.eye(3), (len(STEPS), 1, 1)), np.ones((len(STEPS), 20, 25)), np.ones((len(STEPS), 60, 80))]
)
def test_samples_beside_an_array_for_each_of_them_stay_samples(tmp_path, deep):
    [recording] = uc.read(in_container(tmp_path / "a.npz", deep=deep, pos=STATES, x=STEPS, t=STAMPS))
    assert recording.columns == ("pos1", "pos2", "pos3", "x")


# MATLAB


@pytest.mark.parametrize("packed", [False, True])
def test_a_cell_of_structs_holds_demonstrations(tmp_path, packed):
    strokes = [(STATES[:, :2] * k, STEPS * 0.1) for k in (1, 2, 3)]
    scipy.io.savemat(tmp_path / "a.mat", lasa(strokes), do_compression=packed)
    recordings = uc.read(tmp_path / "a.mat")
    assert names(recordings) == ["a/demos_1", "a/demos_2", "a/demos_3"]
    for recording, (states, times) in zip(recordings, strokes, strict=True):
        assert guessed(recording) == (("pos1", "pos2"), ("vel1", "vel2"))
        assert_array_equal(recording.select(["pos1", "pos2"]), states)
        assert_array_equal(recording.times, times)


def test_variables_of_one_length_are_columns_and_a_rate_makes_times(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"q": STATES, "note": "wiping", "fs": 50, "x": {"force": STEPS[:, None]}})
    recordings = uc.read(tmp_path / "a.mat")
    assert names(recordings) == ["a", "a/x"]
    assert_allclose(recordings[0].times, STEPS / 50)
    assert recordings[0].attributes["note"] == "wiping"


def test_version_7_3_is_read_as_version_5_is(tmp_path):
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        held = file.create_group("#refs#")
        cell = []
        for at in (1, 2):
            stroke = held.create_group(f"s{at}")
            stroke["pos"], stroke["t"] = STATES * at, STEPS[:, None] * 0.1  # as columns first, so the other way round
            cell.append(stroke.ref)
        file.create_dataset("demos", data=np.array(cell, dtype=h5py.ref_dtype)[:, None])
    with (tmp_path / "a.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    first, second = uc.read(tmp_path / "a.mat")
    assert_array_equal(second.select(["pos1", "pos2", "pos3"]), 2 * STATES)
    assert_allclose(first.times, STEPS * 0.1)


def same(mine, scipys):
    if isinstance(mine, list):
        for one, other in zip(mine, scipys.reshape(-1, order="F"), strict=True):
            same(one, other)
    elif isinstance(mine, dict):
        for name, member in mine.items():
            same(member, scipys[name] if scipys[name].dtype != object else scipys[name].item())
    elif isinstance(mine, str):
        assert mine == "".join(scipys.reshape(-1))
    else:
        assert_array_equal(mine, scipys)
        assert mine.dtype == scipys.dtype


@pytest.mark.parametrize("packed", [False, True])
def test_version_5_is_read_as_scipy_reads_it(tmp_path, packed):
    kinds = {f"a{kind}": np.arange(12).reshape(3, 4).astype(kind) for kind in ("i1", "u2", "i4", "u8", "f4", "f8")}
    cell = np.empty((2, 2), dtype=object)
    cell[:] = [[np.eye(2), "word"], [STATES, np.zeros((2, 3, 4))]]
    scipy.io.savemat(tmp_path / "a.mat", {**kinds, "cell": cell, "deep": {"b": {"c": STATES}}}, do_compression=packed)
    mine, scipys = read_mat5((tmp_path / "a.mat").read_bytes()), scipy.io.loadmat(tmp_path / "a.mat")
    assert set(mine) == {*kinds, "cell", "deep"}
    for name, value in mine.items():
        same(value, scipys[name])


@needs_data
def test_the_handwriting_is_read_with_its_strokes():
    for path in sorted((RECORDED / "lasa_handwriting").glob("*.mat"))[:3]:
        recordings = uc.read(path)
        assert len(recordings) >= 7
        for recording in recordings:
            assert guessed(recording) == (("pos1", "pos2"), ("vel1", "vel2"))
            assert np.abs(np.gradient(recording.values[:, 0], recording.times) - recording.values[:, 2]).max() < 50


# HDF5


def test_robomimic_holds_a_demonstration_a_group_with_its_observations_beside_the_actions(tmp_path):
    path = robomimic(tmp_path / "a.hdf5")
    recordings = uc.read(path)
    assert names(recordings) == ["data/demo_0", "data/demo_1", "data/demo_2"]
    demonstrations = uc.prepare(recordings[0], uc.Recipe(states="robot0_eef_pos", actions="actions"))
    assert_array_equal(demonstrations[0].states, STATES)
    assert_array_equal(demonstrations[0].actions, ACTIONS)
    assert_allclose(recordings[0].times, STEPS / 20)
    assert recordings[0].attributes["num_samples"] == 30


@pytest.mark.parametrize(("asked", "kept"), [("train", [0, 2]), ("1", [1]), ("1-2", [1, 2]), ("demo_0", [0])])
def test_episodes_are_chosen_by_lists_numbers_ranges_and_names(tmp_path, asked, kept):
    path = robomimic(tmp_path / "a.hdf5")
    assert names(uc.read(path, episodes=(asked,))) == [f"data/demo_{at}" for at in kept]
    with pytest.raises(ReadError, match="no demonstration is left"):
        uc.read(path, episodes=("9",))


def test_the_state_of_a_simulator_is_not_taken_for_that_of_the_movement(tmp_path):
    recording = uc.read(robomimic(tmp_path / "a.hdf5", simulated=True))[0]
    with pytest.raises(UnconstrainError, match="states="):
        guessed(recording)
    told = complete_recipe(uc.Recipe("states"), recording)
    assert (len(told.states), told.actions) == (11, ("actions1", "actions2", "actions3"))


def test_minari_has_one_observation_after_the_last_action(tmp_path):
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        for at in range(2):
            file[f"episode_{at}/observations"] = np.vstack([STATES, STATES[-1:]])
            file[f"episode_{at}/actions"] = ACTIONS
            file[f"episode_{at}/infos/qpos"] = np.ones((31, 2))
    recordings = uc.read(tmp_path / "a.hdf5")
    assert names(recordings) == ["episode_0", "episode_1"]
    [demonstration] = uc.prepare(recordings[0])
    assert_array_equal(demonstration.states, STATES)
    assert_array_equal(demonstration.actions, ACTIONS)


def test_d4rl_ends_episodes_where_it_says(tmp_path):
    ends = np.zeros((2, 90), dtype=bool)
    ends[0, 29] = ends[1, 59] = True
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        file["observations"], file["actions"] = np.tile(STATES, (3, 1)), np.tile(ACTIONS, (3, 1))
        file["terminals"], file["timeouts"], file["rewards"] = *ends, np.zeros(90)
        file["next_observations"] = np.zeros((90, 3))
    recordings = uc.read(tmp_path / "a.hdf5")
    assert names(recordings) == ["0", "1", "2"]
    assert all(np.array_equal(each.select(["observations1"]), STATES[:, :1]) for each in recordings)
    assert not any(name.startswith("next") for name in recordings[0].columns)


def test_aloha_has_joints_beside_actions_and_no_pictures(tmp_path):
    with h5py.File(tmp_path / "episode_7.hdf5", "w") as file:
        file["action"], file["observations/qpos"], file["observations/qvel"] = STATES, STATES, ACTIONS
        file["observations/images/top"] = np.zeros((30, 4, 4, 3), dtype=np.uint8)
        file.attrs["sim"] = False
    [recording] = uc.read(tmp_path / "episode_7.hdf5")
    assert guessed(recording) == (("qpos1", "qpos2", "qpos3"), ("qvel1", "qvel2", "qvel3"))


def test_groups_of_one_movement_are_side_by_side(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["action/joint_velocity"], file["robot/joint_position"] = ACTIONS, STATES
        file["robot/time"] = STEPS * 0.1
    [recording] = uc.read(tmp_path / "a.h5", time="robot.time")
    assert_array_equal(recording.select(["robot.joint_position2", "action.joint_velocity1"])[:, 0], STATES[:, 1])
    assert_allclose(recording.times, STEPS * 0.1)


# LeRobot


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_lerobot_data_sets_are_read_by_episodes(tmp_path, version, monkeypatch):
    monkeypatch.setattr(parquet, "BLOCK_ROWS", 20)
    recordings = uc.read(lerobot(tmp_path / "set", version))
    assert names(recordings) == ["0", "1", "2"]
    assert [each.attributes["task"] for each in recordings] == ["wipe the table", "stir", "wipe the table"]
    states = tuple(f"observation.state.{axis}" for axis in "xyz")
    assert guessed(recordings[0]) == (states, ("action1", "action2", "action3"))
    assert complete_recipe(uc.Recipe("observation.state", "action"), recordings[0]).states == states
    for recording in recordings:
        assert_array_equal(recording.select(states), STATES)
        assert_allclose(recording.times, STEPS / 30, atol=1e-6)


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_lerobot_episodes_and_tasks_are_chosen(tmp_path, version):
    root = lerobot(tmp_path / "set", version)
    assert names(uc.read(root, episodes=("1-2",))) == ["1", "2"]
    assert names(uc.read(root, task="wipe the table")) == ["0", "2"]
    with pytest.raises(ReadError, match="no demonstration is left"):
        uc.read(root, task="dance")


# JSON


@pytest.mark.parametrize("nested", [False, True])
@pytest.mark.parametrize("lines", [False, True])
def test_records_are_rows(tmp_path, nested, lines):
    records = [
        {"t": k * 0.1, "tag": "a", **({"pos": {"x": x, "y": y}} if nested else {"pos": [x, y]})}
        for k, (x, y, _) in enumerate(STATES)
    ]
    text = "\n".join(map(json.dumps, records)) if lines else json.dumps({"by": "me", "frames": records})
    (tmp_path / "a.json").write_text(text)
    [recording] = uc.read(tmp_path / "a.json")
    assert_allclose(recording.times, STEPS * 0.1)
    assert_array_equal(recording.select(["pos.x", "pos.y"] if nested else ["pos1", "pos2"]), STATES[:, :2])
    assert recording.attributes.get("by") == (None if lines else "me")


def test_columns_and_lists_of_demonstrations(tmp_path):
    columns = {"t": (STEPS * 0.1).tolist(), "pos": STATES.tolist(), "vel": [None, *ACTIONS[1:, 0].tolist()]}
    (tmp_path / "a.json").write_text(json.dumps([columns, columns]))
    first, second = uc.read(tmp_path / "a.json")
    assert_array_equal(first.values, second.values)
    assert np.isnan(first.select(["vel"])[0]).all()
    (tmp_path / "b.json").write_text(json.dumps(STATES.tolist()))
    assert_array_equal(uc.read(tmp_path / "b.json")[0].values, STATES)


@pytest.mark.parametrize(
    "text", ["{", "[1, 2", '{"a": "b"}', "[" * 100_000, "[]", '[{"a": 1e999}, {"a": "b"}]', "null"]
)
def test_json_without_numbers_is_refused(tmp_path, text):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(ReadError, match=r"a\.json"):
        uc.read(tmp_path / "a.json")


# Excel

SPREADSHEET = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
RELATIONS = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
PACKAGE = "http://schemas.openxmlformats.org/package/2006"


def workbook(path, **sheets):
    """The least that is a workbook."""

    def cell(value):
        return f'<c t="inlineStr"><is><t>{value}</t></is></c>' if isinstance(value, str) else f"<c><v>{value}</v></c>"

    kind = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"
    ids = list(enumerate(sheets, start=1))
    with zipfile.ZipFile(path, "w") as book:
        part = f'<Override PartName="/xl/workbook.xml" ContentType="{kind}"/>'
        book.writestr("[Content_Types].xml", f'<Types xmlns="{PACKAGE}/content-types">{part}</Types>')
        root = f'<Relationship Id="r" Type="{RELATIONS}/officeDocument" Target="xl/workbook.xml"/>'
        book.writestr("_rels/.rels", f'<Relationships xmlns="{PACKAGE}/relationships">{root}</Relationships>')
        listed = "".join(f'<sheet name="{name}" sheetId="{at}" r:id="r{at}"/>' for at, name in ids)
        book.writestr(
            "xl/workbook.xml",
            f'<workbook xmlns="{SPREADSHEET}" xmlns:r="{RELATIONS}"><sheets>{listed}</sheets></workbook>',
        )
        targets = "".join(
            f'<Relationship Id="r{at}" Type="{RELATIONS}/worksheet" Target="worksheets/{name}.xml"/>'
            for at, name in ids
        )
        book.writestr(
            "xl/_rels/workbook.xml.rels", f'<Relationships xmlns="{PACKAGE}/relationships">{targets}</Relationships>'
        )
        for name, rows in sheets.items():
            data = "".join(f"<row>{''.join(map(cell, row))}</row>" for row in rows)
            book.writestr(
                f"xl/worksheets/{name}.xml",
                f'<worksheet xmlns="{SPREADSHEET}"><sheetData>{data}</sheetData></worksheet>',
            )
    return path


def test_sheets_with_a_table_are_recordings(tmp_path):
    table = np.column_stack([STEPS * 0.1, STATES[:, :2]]).tolist()
    head = [["Recorded by", "me"], ["time", "x", "y"], ["s", "mm", "mm"]]
    path = workbook(tmp_path / "a.xlsx", one=head + table, notes=[["no", "numbers"]], two=[["t", "x", "y"], *table])
    first, second = uc.read(path)
    assert names([first, second]) == ["a/one", "a/two"]
    for recording in (first, second):
        assert recording.columns == ("x", "y")
        assert_array_equal(recording.values, STATES[:, :2])
        assert_allclose(recording.times, STEPS * 0.1)
    assert first.units == {"x": "mm", "y": "mm"}
    assert names(uc.read(path, topic="two")) == ["a"]
    with pytest.raises(ReadError, match="no sheet 'three'; it has one, notes, two"):
        uc.read(path, topic="three")


@pytest.mark.parametrize("entry", ["[Content_Types].xml", "something.else"])
def test_any_other_zip_is_refused_in_words(tmp_path, entry):
    with zipfile.ZipFile(tmp_path / "a.xlsx", "w") as book:
        book.writestr(entry, "<Types/>")
    with pytest.raises(ReadError, match=r"a\.xlsx: cannot be read"):
        uc.read(tmp_path / "a.xlsx")


# ROS


@pytest.mark.parametrize("kind", ["bag", "db3", "mcap"])
def test_a_topic_of_ros_is_a_recording(tmp_path, kind):
    folder = bag(tmp_path / (f"a.{kind}" if kind == "bag" else "a"), kind)
    inside = [] if kind == "bag" else list(folder.glob(f"*.{kind}"))
    for path in (folder, *inside):
        [joints] = uc.read(path, topic="joint_states")
        assert guessed(joints) == (
            ("position.a", "position.b", "position.c"),
            ("velocity.a", "velocity.b", "velocity.c"),
        )
        assert_array_equal(joints.select(["position.b", "velocity.c"]), np.column_stack([STATES[:, 1], ACTIONS[:, 2]]))
        assert_allclose(joints.times, STEPS * 0.02, atol=1e-9)
    [pose] = uc.read(folder, topic="/pose")
    assert guessed(pose) == (tuple(f"pose.position.{axis}" for axis in "xyz"), "savgol")
    assert names(uc.read(folder, topic="/tf")) == ["a/tool", "a/hand"]
    [tool] = uc.read(folder, topic="/tf:tool")
    assert_array_equal(tool.select(["transform.translation.x"]), STATES[:, :1])


@pytest.mark.parametrize(
    ("topic", "sentence"),
    [
        (None, r"several topics; say which with topic=: /joint_states \(sensor_msgs/msg/JointState\)"),
        ("/gone", "no topic '/gone'; it has /joint_states"),
        ("/tf:foot", "no frame 'foot'; it has tool, hand"),
    ],
)
def test_which_topic_is_asked_for(tmp_path, topic, sentence):
    with pytest.raises(ReadError, match=sentence):
        uc.read(bag(tmp_path / "a.bag", "bag"), topic=topic)


# C3D


def test_motion_capture_is_read_as_another_library_wrote_it(tmp_path):
    import ezc3d

    points = np.ones((4, 2, 30))
    points[:3, 0], points[:3, 1] = STATES.T, 2 * STATES.T
    residuals = np.zeros((1, 2, 30))
    residuals[0, 1, 5:8] = -1
    content = ezc3d.c3d()
    for group, name, value in (
        *(("POINT", "RATE", [100.0]), ("POINT", "UNITS", ["mm"]), ("POINT", "LABELS", ["hand", "tool"])),
        *(("ANALOG", "RATE", [1000.0]), ("ANALOG", "LABELS", ["fz"])),
    ):
        content["parameters"][group][name]["value"] = value
    content["data"]["points"], content["data"]["meta_points"]["residuals"] = points, residuals
    content["data"]["analogs"] = np.arange(300.0)[None, None]
    content.write(str(tmp_path / "a.c3d"))
    [recording] = uc.read(tmp_path / "a.c3d")
    assert recording.columns == ("hand.X", "hand.Y", "hand.Z", "tool.X", "tool.Y", "tool.Z", "fz")
    assert_allclose(recording.values[:, :3], STATES, rtol=1e-6, atol=1e-7)
    assert_array_equal(np.flatnonzero(np.isnan(recording.values[:, 3])), [5, 6, 7])
    assert_allclose(recording.values[:, 6], np.arange(300.0).reshape(30, 10).mean(axis=1))
    assert_allclose(recording.times, STEPS / 100)
    assert recording.units["tool.Z"] == "mm"


# Folders


def test_a_folder_of_files_of_one_kind_is_a_data_set(tmp_path):
    for at in range(3):
        (tmp_path / f"demo_{at}.csv").write_text("t,x,y\n" + "".join(f"{k},{k},{at}\n" for k in range(9)))
    (tmp_path / "README.txt").write_text("recorded on 3 days")
    assert names(uc.read(tmp_path)) == ["demo_0", "demo_1", "demo_2"]
    np.save(tmp_path / "more.npy", STATES)
    with pytest.raises(ReadError, match=r"several kinds \(1 \.txt, 3 \.csv, 1 \.npy\); say which, such as"):
        uc.read(tmp_path)


# Damage


def damaged(content, seed):
    """Some bytes changed, some left out, the end cut off."""
    rng = np.random.default_rng(seed)
    harmed = bytearray(content)
    for at in rng.integers(0, min(len(harmed), 2000), rng.integers(1, 6)):
        harmed[at] = rng.integers(256)
    start = int(rng.integers(0, len(harmed)))
    return bytes(harmed[:start] + harmed[start + int(rng.integers(0, 40)) :])[: int(rng.integers(1, len(harmed) + 1))]


@pytest.mark.parametrize("suffix", ["mat", "hdf5", "parquet", "json", "xlsx", "mcap", "npy"])
def test_damaged_files_give_recordings_or_one_of_our_errors(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    if suffix == "mat":
        scipy.io.savemat(path, lasa([(STATES, STEPS)] * 2), do_compression=True)
    elif suffix == "hdf5":
        robomimic(path)
    elif suffix == "parquet":
        pq.write_table(pa.table({"t": STEPS, "x": STATES[:, 0]}), path)
    elif suffix == "json":
        path.write_text(json.dumps({"t": STEPS.tolist(), "x": STATES.tolist()}))
    elif suffix == "xlsx":
        workbook(path, one=[["t", "x"], *STATES[:, :2].tolist()])
    elif suffix == "npy":
        np.save(path, STATES)
    else:
        path.write_bytes(next(bag(tmp_path / "bag", "mcap").glob("*.mcap")).read_bytes())
    content = path.read_bytes()
    assert content
    for seed in range(40):
        path.write_bytes(damaged(content, seed))
        try:
            recordings = uc.read(path, topic="joint_states" if suffix == "mcap" else None)
        except UnconstrainError:
            continue
        for recording in recordings:
            assert recording.values.shape == (len(recording), len(recording.columns))
            assert recording.times is None or all(one <= other for one, other in pairwise([0, len(recording.times)]))
