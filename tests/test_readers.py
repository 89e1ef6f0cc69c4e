"""Files become recordings, or one clear error."""

from __future__ import annotations

import io
import os
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from recorded import DATA, needs_data
from unconstrain.base.errors import ReadError, SettingError, UnconstrainError
from unconstrain.recordings.demonstration import Recording
from unconstrain.recordings.readers import read
from unconstrain.recordings.readers.clocks import find_clock_of
from unconstrain.recordings.readers.table import unique_names

one_folder = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def to_file(content: str | bytes, name: str = "wipe.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return to_file


def seconds(stamps: np.ndarray, name: str) -> np.ndarray:
    return find_clock_of(stamps, name).seconds(stamps)


def only(recordings: list[Recording]) -> Recording:
    [recording] = recordings
    return recording


# ------------------------------------------------------------------------------------------------------------ text


def test_a_table_is_one_recording_called_as_its_file(write: Write) -> None:
    recording = only(read(write("t,x,y\n0,1,2\n0.1,3,4.5e-1\n")))
    assert recording.name == "wipe"
    assert recording.columns == ("x", "y")
    np.testing.assert_array_equal(recording.values, [[1, 2], [3, 0.45]])
    np.testing.assert_array_equal(recording.times, [0, 0.1])


def test_without_a_column_of_times_there_are_none(write: Write) -> None:
    assert only(read(write("x,y\n1,2\n"))).times is None


@pytest.mark.parametrize("delimiter", [",", "\t", ";", ", "])
def test_comma_tab_and_semicolon_separate(write: Write, delimiter: str) -> None:
    recording = only(read(write(f"x{delimiter}y\n1{delimiter}2\n")))
    assert recording.columns == ("x", "y")
    np.testing.assert_array_equal(recording.values, [[1, 2]])


def test_a_delimiter_inside_quotes_does_not_count(write: Write) -> None:
    recording = only(read(write('"x, y, or z";b\n1;"2"\n')))
    assert recording.columns == ("x, y, or z", "b")
    np.testing.assert_array_equal(recording.values, [[1, 2]])


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_byte_order_mark_line_ends_blank_lines_and_comments_do_no_harm(write: Write, end: str) -> None:
    lines = ["# robot 7", "", '"x" , "y"', "1,2", "  # pause", "", " ", "3,4", "", ""]
    recording = only(read(write(b"\xef\xbb\xbf" + end.join(lines).encode())))
    assert recording.columns == ("x", "y")
    np.testing.assert_array_equal(recording.values, [[1, 2], [3, 4]])


def test_the_header_that_savetxt_writes_as_a_comment_is_one(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    np.savetxt(path, [[0, 1, 2], [1, 3, 4]], delimiter=",", header="t,x,y")
    recording = only(read(path))
    assert recording.columns == ("x", "y")
    np.testing.assert_array_equal(recording.values, [[1, 2], [3, 4]])


def test_equal_names_of_columns_are_told_apart(write: Write) -> None:
    assert only(read(write("x,y,x,x,x.1\n1,2,3,4,5\n"))).columns == ("x", "y", "x.2", "x.3", "x.1")


def test_unnamed_columns_are_numbered_and_empty_unnamed_ones_left_out(write: Write) -> None:
    assert only(read(write(",x,\n0,5,\n1,6,\n"))).columns == ("column1", "x")


def test_empty_cells_are_nan(write: Write) -> None:
    np.testing.assert_array_equal(only(read(write("x,y\n1, \n,4\n"))).values, [[1, np.nan], [np.nan, 4]])


def test_a_column_of_words_is_left_out(write: Write) -> None:
    recording = only(read(write("x,surface,y\n1,flat,2\n3,,4\n")))
    assert recording.columns == ("x", "y")


def test_digits_with_underscores_are_words(write: Write) -> None:
    assert only(read(write("x,day\n1,2019_02_14\n"))).columns == ("x",)


@pytest.mark.parametrize("name", ["demo", "Trial", "bout", "group", "EPISODE", "run", "demonstration"])
def test_a_column_called_like_one_tells_demonstrations_apart(write: Write, name: str) -> None:
    first, second = read(write(f"x,{name},t\n1,B,0\n2,A,0\n3,B,1\n"))
    assert (first.name, second.name) == ("B", "A")
    assert first.columns == ("x",)
    np.testing.assert_array_equal(first.values, [[1], [3]])
    np.testing.assert_array_equal(first.times, [0, 1])


def test_group_and_time_can_be_named(write: Write) -> None:
    path = write("surface,demo,clock_ms,x\n7,1,0,5\n7.5,1,0,6\n7,1,20,7\n")
    first, second = read(path, group="surface", time="clock_ms")
    assert (first.name, second.name) == ("7", "7.5")
    assert first.columns == ("demo", "x")
    np.testing.assert_allclose(first.times, [0, 0.02])


def test_a_column_named_as_time_is_no_group_and_the_other_way_round(write: Write) -> None:
    path = write("run,t,x\n1,5,2\n2,6,3\n")
    assert only(read(path, time="run")).columns == ("t", "x")
    assert [recording.name for recording in read(path, group="t")] == ["5", "6"]


def test_many_groups_over_many_rows_keep_their_rows(write: Write) -> None:
    rows = [(index % 37, index) for index in range(45_000)]
    recordings = read(write("run,x\n" + "\n".join(f"{run},{x}" for run, x in rows)))
    assert [recording.name for recording in recordings] == [str(run) for run in range(37)]
    for run, recording in enumerate(recordings):
        np.testing.assert_array_equal(recording.values[:, 0], np.arange(run, 45_000, 37))


def test_equal_names_of_recordings_are_told_apart(write: Write) -> None:
    first, second = write("x,y\n1,2\n", "wipe.csv"), write("x;y\n1;2\n", "wipe.tsv")
    assert [recording.name for recording in read([first, second])] == ["wipe", "wipe.1"]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("x,y\n1,2\n3,up\n", "wipe.csv, line 3, column 'y': got 'up', expected a number as elsewhere in this column."),
        ("# a\n\nx,y\n1,2\n\n3,4,5\n", "wipe.csv, line 6: got 3 cells, expected 2 as in the header."),
        ("", "wipe.csv: the file is empty, expected a header and rows of numbers."),
        ("# only this\n\n", "wipe.csv: the file is empty"),
        ("x,y\n", "wipe.csv: a header but no rows, expected at least one row of numbers."),
        ("x,y\na,b\n", "wipe.csv: no column of numbers; it has x, y. Expected a header, then rows of numbers"),
        ("x,run\n1,A\n2,\n", "wipe.csv, line 3, column 'run': empty, expected the name of a demonstration."),
        (b"x,y\n1,\xff\n", "wipe.csv: not UTF-8 text (invalid start byte). Save it as a CSV file in UTF-8."),
        ('x,y\n1,2\n"1",' + "9" * 200_000, "wipe.csv: not a table of comma-separated values (field larger than field"),
        (",".join(f"c{i}" for i in range(50)) + "\n" + "w," * 49 + "w", "c29 and 20 more."),
    ],
)
def test_what_is_no_table_is_refused_with_its_place(write: Write, content: str | bytes, sentence: str) -> None:
    with pytest.raises(ReadError) as caught:
        read(write(content))
    assert sentence in str(caught.value)


def test_a_bad_cell_far_down_names_its_line(write: Write) -> None:
    content = "x\n" + "1\n" * 60_000 + "oops\n" + "2\n" * 10
    with pytest.raises(ReadError, match=r"line 60002, column 'x': got 'oops'"):
        read(write(content))


def test_a_column_that_does_not_exist_lists_those_that_do(write: Write) -> None:
    with pytest.raises(ReadError, match=r"no column 'clock' for time; it has x, y\."):
        read(write("x,y\n1,2\n"), time="clock")


def test_words_that_are_no_times_are_refused_if_asked_for_and_said_otherwise(write: Write) -> None:
    path = write("time,x\nnoon,1\n")
    recording = only(read(path))
    assert recording.times is None
    assert [(remark.code, remark.column) for remark in recording.remarks] == [("dropped-column", "time")]
    with pytest.raises(
        ReadError, match=r"column 'time': got 'noon', expected a number or a time as ISO 8601 writes it"
    ):
        read(path, time="time")


# ------------------------------------------------------------------------------------------------------------ times


@pytest.mark.parametrize("unit", [1, 1e3, 1e6, 1e9])
def test_stamps_since_1970_become_seconds_from_the_start(unit: float) -> None:
    stamps = np.round((1_498_556_243.98 + np.array([0, 0.02, 0.04])) * unit) if unit > 1 else np.array([0, 0.02, 0.04])
    np.testing.assert_allclose(seconds(stamps, "stamp"), [0, 0.02, 0.04], atol=1e-6 if unit != 1e3 else 1e-3)


@pytest.mark.parametrize(
    ("name", "unit"), [("t", 1), ("t_s", 1), ("time_ms", 1e-3), ("time[us]", 1e-6), ("T (ns)", 1e-9)]
)
def test_the_name_tells_the_unit(name: str, unit: float) -> None:
    np.testing.assert_allclose(seconds(np.array([0.0, 5.0]), name), [0, 5 * unit])


def test_stamps_that_are_all_missing_stay_missing() -> None:
    assert np.isnan(seconds(np.array([np.nan]), "t")).all()


@given(st.lists(st.sampled_from(["x", "x.1", "x.2", "y", "x.1.1"]), max_size=12))
def test_unique_names_differ_and_leave_first_ones_alone(names: list[str]) -> None:
    unique = unique_names(names)
    assert len(set(unique)) == len(names)
    for name in set(names):
        assert unique[names.index(name)] == name


# -------------------------------------------------------------------------------------------------------------- npz


def archive(path: Path, **arrays: object) -> Path:
    np.savez(path, **arrays)  # type: ignore[arg-type]
    return path


def test_an_archive_is_split_by_its_groups(tmp_path: Path) -> None:
    states, actions = np.arange(6).reshape(3, 2), np.ones((3, 1), dtype=np.float32)
    path = archive(tmp_path / "a.npz", states=states, actions=actions, times=[0, 0, 1], groups=["p", "q", "p"])
    first, second = read(path)
    assert (first.name, second.name) == ("p", "q")
    assert first.columns == ("x1", "x2", "u1")
    np.testing.assert_array_equal(first.values, [[0, 1, 1], [4, 5, 1]])
    np.testing.assert_array_equal(first.times, [0, 1])


def test_an_archive_without_groups_is_called_as_its_file(tmp_path: Path) -> None:
    recording = only(read(archive(tmp_path / "a.npz", states=np.eye(2), actions=np.eye(2))))
    assert (recording.name, recording.times) == ("a", None)


def test_arrays_of_an_archive_can_be_named(tmp_path: Path) -> None:
    path = archive(tmp_path / "a.npz", states=np.eye(2), actions=np.eye(2), trial=[4, 5], clock_ms=[0, 10])
    first, second = read(path, group="trial", time="clock_ms")
    assert (first.name, second.name) == ("4", "5")
    np.testing.assert_allclose(second.times, [0.01])


@pytest.mark.parametrize(
    ("arrays", "sentence"),
    [
        ({"weights": np.ones((2, 2), complex)}, "it holds weights (2, 2). Expected a NumPy archive, as from numpy.sav"),
        ({}, "holds nothing."),
        ({"states": np.eye(2), "actions": np.eye(3)}, "2 rows of states, but 3 of actions; expected as many."),
        (
            {"states": np.ones(2), "actions": np.eye(2)},
            "states is float64 of shape (2,), expected real numbers in 2 di",
        ),
        ({"states": np.eye(2), "actions": np.full((2, 1), "a")}, "actions is <U1 of shape (2, 1), expected real"),
        ({"states": np.empty((0, 2)), "actions": np.empty((0, 2))}, "shape (0, 2), expected real numbers in 2 dimens"),
        (
            {"states": np.eye(2), "actions": np.eye(2), "times": np.eye(2)},
            "times is float64 of shape (2, 2), expected one f",
        ),
        ({"states": np.eye(2), "actions": np.eye(2), "groups": [1j, 2]}, "expected one for each sample"),
        (
            {"states": np.eye(2), "actions": np.eye(2), "groups": np.array([{}, {}])},
            "it holds Python objects, which would run code",
        ),
    ],
)
def test_another_archive_is_refused_with_its_contents(tmp_path: Path, arrays: dict[str, object], sentence: str) -> None:
    with pytest.raises(ReadError) as caught:
        read(archive(tmp_path / "a.npz", **arrays))
    assert sentence in str(caught.value)


def test_damaged_text_of_groups_is_refused(tmp_path: Path) -> None:
    broken = np.array([0x7FFFFFFF, 65], dtype=np.uint32).view("<U1")
    with pytest.raises(ReadError, match="group holds damaged text"):
        read(archive(tmp_path / "a.npz", states=np.eye(2), actions=np.eye(2), groups=broken))


class Bomb:
    """Runs something when unpickled."""

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, ("unpickled",)


def test_nothing_is_ever_unpickled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "a.npz"
    path.write_bytes(pickle.dumps(Bomb()))
    with pytest.raises(ReadError, match="cannot be read"):
        read(path)
    np.savez(path, states=np.array([Bomb()], dtype=object), actions=np.eye(1))
    with pytest.raises(ReadError, match="cannot be read"):
        read(path)
    assert not (tmp_path / "unpickled").exists()


# ---------------------------------------------------------------------------------------------------- which reader


def test_a_pattern_stands_for_what_it_matches_unless_a_file_is_called_so(write: Write, tmp_path: Path) -> None:
    for name in ("wipe_2.csv", "wipe_1.csv", "stir_1.csv"):
        write("x,y\n1,2\n", name)
    assert [found.name for found in read(tmp_path / "wipe_?.csv")] == ["wipe_1", "wipe_2"]
    assert [found.name for found in read([f"{tmp_path}/stir_*", tmp_path / "wipe_[2].csv"])] == ["stir_1", "wipe_2"]
    write("x,y\n3,4\n", "wipe_[2].csv")
    assert only(read(tmp_path / "wipe_[2].csv")).values.tolist() == [[3.0, 4.0]]
    with pytest.raises(ReadError, match=r"none_\*\.csv: no such file"):
        read(tmp_path / "none_*.csv")


def test_content_decides_where_the_suffix_does_not(tmp_path: Path, write: Write) -> None:
    assert only(read(write("x,y\n1,2\n", "wipe.log"))).columns == ("x", "y")
    npz = archive(tmp_path / "a.npz", states=np.eye(2), actions=np.eye(2))
    assert only(read(npz.rename(tmp_path / "a.data"))).columns == ("x1", "x2", "u1", "u2")


@pytest.mark.parametrize("content", [b"", b"\x93NUMPI\x01", b"plain words", b"a,b\0"])
def test_an_unknown_format_lists_the_known_ones(write: Write, content: bytes) -> None:
    with pytest.raises(ReadError, match=r"of a known format\. Supported are \.npz, .*\.parquet, .*\.mat, .*\.csv, "):
        read(write(content, "wipe.xyz"))


def test_missing_files_folders_and_nothing_at_all_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match=r"gone\.csv: no such file"):
        read(tmp_path / "gone.csv")
    with pytest.raises(ReadError, match="a folder without a file to read"):
        read(str(tmp_path))
    with pytest.raises(SettingError, match="got no file to read"):
        read([])
    with pytest.raises(SettingError, match="got 't' for both group and time"):
        read(tmp_path / "a.csv", group="t", time="t")


@pytest.mark.parametrize("name", ["wipe.csv", "wipe.unknown"])
def test_a_file_that_may_not_be_opened_is_one_clear_error(
    write: Write, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = write("x,y\n1,2\n", name)

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(ReadError, match=r"could not be read \(Permission denied\)"):
        read(path)


# --------------------------------------------------------------------------------------------------- arbitrary bytes


def saved(**arrays: object) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


GOOD = saved(states=np.eye(3), actions=np.ones((3, 2)), times=np.arange(3.0), groups=np.array(["a", "b", "a"]))
damaged = st.builds(
    lambda edits, end: bytes({**dict(enumerate(GOOD)), **edits}[at] for at in range(end)),
    st.dictionaries(st.integers(0, len(GOOD) - 1), st.integers(0, 255), max_size=6),
    st.integers(0, len(GOOD)),
)
scraps = st.text(st.sampled_from('txdemo019.-+e_,;\t\n\r"# \0é\ufeff'), max_size=80).map(str.encode)


@settings(one_folder, max_examples=400)
@given(
    content=st.one_of(st.binary(max_size=200), damaged, scraps, st.sampled_from([GOOD])),
    suffix=st.sampled_from([".csv", ".npz", ".bin"]),
)
@pytest.mark.filterwarnings("ignore")
def test_any_bytes_give_recordings_or_one_of_our_errors(tmp_path: Path, content: bytes, suffix: str) -> None:
    path = tmp_path / f"any{suffix}"
    path.write_bytes(content)
    try:
        recordings = read(path)
    except UnconstrainError:
        return
    assert recordings
    for recording in recordings:
        assert recording.values.shape == (len(recording), len(recording.columns))
        assert recording.times is None or recording.times.shape == (len(recording),)


@one_folder
@given(
    table=hnp.arrays(
        np.float64, hnp.array_shapes(min_dims=2, max_dims=2, max_side=6), elements=st.floats(allow_nan=False)
    ),
    delimiter=st.sampled_from(",;\t"),
    end=st.sampled_from(["\n", "\r\n"]),
)
def test_any_table_of_numbers_comes_back_exactly(tmp_path: Path, table: np.ndarray, delimiter: str, end: str) -> None:
    header = delimiter.join(f"c{index}" for index in range(table.shape[1]))
    rows = [delimiter.join(repr(float(value)) for value in row) for row in table]
    path = tmp_path / "table.csv"
    path.write_bytes(end.join([header, *rows]).encode())
    np.testing.assert_array_equal(only(read(path)).values, table)


# ------------------------------------------------------------------------------------------------- real recordings


@needs_data
def test_a_finger_tip_logged_by_ros_reads_with_its_nanoseconds() -> None:
    recording = only(read(DATA / "ccl_trakstar_planar" / "planer_circle.csv"))
    assert recording.columns == ("x", "y", "z", "x.1", "y.1", "z.1", "w")
    again = only(read(DATA / "ccl_trakstar_planar" / "planer_circle_unflipped.csv"))
    np.testing.assert_allclose(recording.times, again.times, atol=1e-6)


@needs_data
def test_the_rim_wiping_reads_as_numpy_reads_it() -> None:
    path = DATA / "lasa_rim_wiping" / "demo_0.csv"
    recording = only(read(path))
    expected = np.loadtxt(path, delimiter=",", skiprows=1)
    np.testing.assert_array_equal(recording.values, expected[:, 1:])
    np.testing.assert_array_equal(recording.times, expected[:, 0])


def test_demonstrations_numbered_by_savetxt_have_short_names(tmp_path):
    table = np.column_stack([np.repeat([0, 1, 12], 4), np.tile(np.arange(4) / 10, 3), np.arange(12.0)])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="demo,t,x", comments="")
    assert [one.name for one in read(tmp_path / "a.csv", group="demo")] == ["0", "1", "12"]
