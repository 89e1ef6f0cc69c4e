"""Where the table in a text is: metadata, several rows of names, units, delimiters, decimals, breaks, clocks."""

import bz2
import gzip
import lzma

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from unconstrain.base.errors import ReadError
from unconstrain.recordings.readers import cells, lines, read_blocks
from unconstrain.recordings.readers.layout import find_layout

PATH = np.column_stack([np.arange(40) * 0.02, np.cos(np.arange(40) / 9), np.sin(np.arange(40) / 9)]).round(5)
"""Times, x, y of a short movement."""


def rows(delimiter=",", table=PATH, decimal=".", end=""):
    return "".join(delimiter.join(f"{v:.5f}".replace(".", decimal) for v in row) + f"{end}\n" for row in table)


@pytest.fixture
def read(tmp_path):
    def read(text, name="move.csv", **told):
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
        return uc.read(tmp_path / name, **told)

    return read


@pytest.fixture
def only(read):
    def only(text, name="move.csv", **told):
        [recording] = read(text, name, **told)
        return recording

    return only


def codes(recording):
    return [remark.code for remark in recording.remarks]


def same(recording, columns=("x", "y")):
    assert recording.columns == columns
    assert_array_equal(recording.values, PATH[:, 1:])
    assert_allclose(recording.times, PATH[:, 0], atol=1e-9)


# Delimiters and decimals


@pytest.mark.parametrize("delimiter", [",", "\t", ";", "|", " ", "   ", " \t", ", "])
@pytest.mark.parametrize("end", ["", "trailing"])
def test_cells_are_separated_in_any_way(only, delimiter, end):
    trail = delimiter.strip(" ") if end else ""
    same(only(delimiter.join(["t", "x", "y"]) + "\n" + rows(delimiter, end=trail)))


@pytest.mark.parametrize("delimiter", [";", "\t", " "])
def test_a_decimal_comma_is_one_where_something_else_separates(only, delimiter):
    same(only(delimiter.join(["time", "x", "y"]) + "\n" + rows(delimiter, decimal=",")))


def test_what_savetxt_writes_is_read(only, tmp_path):
    np.savetxt(tmp_path / "a.txt", PATH, header="t x y")
    same(only((tmp_path / "a.txt").read_text(), "a.txt"))


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_encodings_and_ends_of_lines(only, encoding, end):
    same(only(("t,x,y\n" + rows()).replace("\n", end).encode(encoding)))


def test_a_header_of_an_older_encoding_is_read_but_not_a_table(only):
    recording = only("t,x [°],y\n".encode("cp1252") + rows().encode())
    assert (recording.columns, recording.units["x [°]"]) == (("x [°]", "y"), "°")
    with pytest.raises(ReadError, match="not UTF-8"):
        only(b"t,x\n1,2\n2,3\n3,\xff\n")


@pytest.mark.parametrize(("pack", "suffix"), [(gzip, ".gz"), (bz2, ".bz2"), (lzma, ".xz")])
def test_packed_text_is_read_and_called_without_its_suffixes(only, read, pack, suffix):
    packed = pack.compress(("t,x,y\n" + rows()).encode())
    recording = only(packed, f"move.csv{suffix}")
    assert recording.name == "move"
    same(recording)
    with pytest.raises(ReadError, match=r"unpacked|could not be read"):
        read(packed[: len(packed) // 2], f"half.csv{suffix}")


# Headers

QUALISYS = "NO_OF_FRAMES\t40\nFREQUENCY\t50\nTIME_STAMP\t2024-01-01, 10:00\t12.5\nMARKER_NAMES\thand\ttool\n"
MOTIVE = (
    "Format Version,1.23,Take Name,A 1,Capture Frame Rate,50.0\n\n,,Rigid Body,Rigid Body\n,,Hand,Hand\n,,7,7\n"
    ",,Position,Position\nFrame,Time (Seconds),X,Y\n"
)
TRC = (
    "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tUnits\n50\t50\t40\tmm\n"
    "Frame#\tTime\thand\t\n\t\tX1\tY1\n\n"
)
VICON = "Trajectories\n50\n,,me:hand,,\nFrame,Sub Frame,X,Y\n,,mm,mm\n"
OPENSIM = "Coordinates\nversion=1\nnRows=40\ninDegrees=yes\nendheader\ntime\tx\ty\n"
XSENS = "// Start Time: Unknown\n// Update Rate: 50.0Hz\n// Firmware 4\nPacketCounter\tx\ty\n"


def numbered(delimiter, columns=(0, 1, 2)):
    table = np.column_stack([np.arange(1, 41), PATH])
    return "".join(
        delimiter.join([f"{int(row[0])}", *(f"{row[at + 1]:.5f}" for at in columns)]) + "\n" for row in table
    )


@pytest.mark.parametrize(
    ("header", "delimiter", "columns", "kept"),
    [
        (QUALISYS + "Frame\tTime\thand X\thand Y\n", "\t", (0, 1, 2), ("hand X", "hand Y")),
        (MOTIVE, ",", (0, 1, 2), ("Rigid Body.Hand.7.Position.X", "Rigid Body.Hand.7.Position.Y")),
        (TRC, "\t", (0, 1, 2), ("hand.X1", "hand.Y1")),
        (TRC.replace("\t", ",")[:-1] + ",,,\n", ",", (0, 1, 2), ("hand.X1", "hand.Y1")),
        ("time,x,y\n", ",", None, ("x", "y")),
        (OPENSIM, "\t", None, ("x", "y")),
        (VICON.replace("Sub Frame", "Time").replace(",,mm", ",s,mm"), ",", (0, 1, 2), ("me:hand.X", "me:hand.Y")),
    ],
)
def test_what_stands_above_the_table_is_understood(only, header, delimiter, columns, kept):
    recording = only(header + (rows(delimiter) if columns is None else numbered(delimiter, columns)))
    assert_array_equal(recording.select(kept), PATH[:, 1:])
    assert_allclose(recording.times, PATH[:, 0], atol=1e-9)
    assert "no-header" not in codes(recording)


@pytest.mark.parametrize(("header", "name"), [(VICON.replace("Sub Frame", "Sub"), "move.csv"), (XSENS, "move.txt")])
def test_a_rate_above_the_table_makes_the_times(only, header, name):
    delimiter, columns = (",", (2, 1, 2)) if "Vicon" in header or "Trajectories" in header else ("\t", (1, 2))
    recording = only(header + numbered(delimiter, columns), name)
    assert_allclose(recording.times, np.arange(40) / 50)


def test_markers_are_named_where_only_the_metadata_names_them(only):
    six = np.column_stack([PATH, PATH + 1])
    recording = only(QUALISYS + rows("\t", six), "move.tsv")
    assert recording.columns == ("hand.X", "hand.Y", "hand.Z", "tool.X", "tool.Y", "tool.Z")
    assert_allclose(recording.times, np.arange(40) / 50)


def test_a_row_of_units_is_no_row_and_used(only):
    table = PATH * [1000, 1, 1]
    recording = only("time,x,y\nms,mm,deg\n" + rows(table=table))
    same(recording)
    assert recording.units == {"x": "mm", "y": "deg"}


@pytest.mark.parametrize(("said", "degrees"), [("inDegrees=yes", True), ("inDegrees=no", False), ("", False)])
def test_opensim_tells_which_coordinates_are_in_degrees(only, said, degrees):
    above = f"Coordinates\nversion=1\nnRows=40\nnColumns=3\n{said}\n\nUnits are S.I. units\n\nendheader\n"
    found = only(f"{above}time\tpelvis_tx\tknee_angle_r\n{rows(chr(9))}", "ik.mot")
    assert dict(found.units) == ({"knee_angle_r": "deg"} if degrees else {})
    assert_allclose(found.times, PATH[:, 0])


def test_of_wide_tables_few_lines_are_looked_at(only):
    table = np.column_stack([np.arange(30) * 0.02, np.random.default_rng(0).normal(size=(30, 3000))])
    found = only(f"t,{','.join(f'c{at}' for at in range(3000))}\n{rows(table=table)}")
    assert_allclose(found.values, table[:, 1:], atol=1e-5)


def test_columns_that_are_numbered_in_the_first_row_are_named_so(only):
    recording = only("0,1,2\n" + rows())
    assert recording.columns == ("0", "1", "2")
    assert_array_equal(recording.values, PATH)


def test_the_header_of_r_lacks_the_name_of_the_numbers_of_rows(only):
    text = '"t" "x" "y"\n' + "".join(f'"{k + 1}" {t} {x} {y}\n' for k, (t, x, y) in enumerate(PATH))
    recording = only(text, "move.txt")
    assert_array_equal(recording.select(["x", "y"]), PATH[:, 1:])
    assert_allclose(recording.times, PATH[:, 0])


def test_of_several_rates_the_nearest_counts(only):
    devices = "Devices\n1000\n,,force\nFrame,Sub,Fx\n,,N\n" + "".join(f"1,{k},{k * 0.5}\n" for k in range(9)) + "\n"
    recording = only(devices + VICON.replace("Sub Frame", "Sub") + numbered(",", (2, 1, 2)))
    assert_allclose(recording.times, np.arange(40) / 50)
    assert codes(recording) == ["other-topic"]


def test_a_bad_row_below_the_names_is_no_header(read):
    with pytest.raises(ReadError, match="line 2, column 'x': got 'oops'"):
        read("t,x,y\n0,oops,1\n" + rows())


def test_without_a_header_columns_are_numbered_said_and_can_be_named(only):
    recording = only(rows(" "))
    assert recording.columns == ("column1", "column2", "column3")
    assert "no-header" in codes(recording)
    same(only(rows(" "), columns=("t", "x", "y")))
    with pytest.raises(ReadError, match="got 2 names of columns"):
        only(rows(" "), columns=("x", "y"))


def test_words_beside_numbers_are_no_header(only):
    recording = only("".join(f"{k},base,{k * 0.5}\n" for k in range(9)))
    assert recording.values.shape == (9, 2)


def test_a_second_table_is_said(only):
    recording = only("t,x,y\n" + rows() + "\nDevices\nforce\n" + "".join(f"{k},{k}\n" for k in range(9)))
    assert codes(recording) == ["other-topic"]


# Cells


@pytest.mark.parametrize("word", ["", "NA", "None", "null", "nan", "#N/A"])
def test_cells_that_stand_for_nothing_are_gaps(only, word):
    text = "t,x,y\n" + rows()
    recording = only(text.replace("0.98769", word, 1))
    assert np.isnan(recording.values).sum() == ("0.98769" in text)


def test_cells_of_lists_become_columns(only):
    text = "time,position,v\n" + "".join(f'{t:.5f},"[{x}, {y}]",({x} {y})\n' for t, x, y in PATH)
    recording = only(text)
    assert recording.columns == ("position1", "position2", "v1", "v2")
    assert_array_equal(recording.values[:, :2], PATH[:, 1:])
    ragged = only(text.replace('"[1.0, 0.0]"', '"[1.0]"'))
    assert (ragged.columns, codes(ragged)) == (("v1", "v2"), ["dropped-column"])


def test_labels_are_left_out_silently_and_what_is_not_understood_is_said(only):
    text = "frame_id,when,x\n" + "".join(f"base,on day {k},{k}\n" for k in range(9))
    recording = only(text)
    assert [(remark.code, remark.column) for remark in recording.remarks] == [("dropped-column", "when")]


# Breaks


@pytest.mark.parametrize("gap", ["\n", "\n\n\n", "x,y\n", "\nx,y\n"])
def test_blank_lines_and_a_header_once_more_separate_demonstrations(read, gap):
    part = rows(table=PATH[:, 1:])
    first, second = read("x,y\n" + part + gap + part)
    assert (first.name, second.name) == ("move", "move.1")
    assert_array_equal(first.values, second.values)
    assert codes(first) == ["split"]


def test_blank_lines_that_separate_nothing_are_passed_over(only):
    same(only("t,x,y\n\n" + rows().replace("\n", "\n\n") + "\n\n"))
    half = rows(table=PATH[:20]) + "\n" + rows(table=PATH[20:])
    same(only("t,x,y\n" + half))  # the clock just goes on


@pytest.mark.parametrize("name", ["t", "frame_index", "step"])
def test_a_clock_or_a_count_that_begins_anew_separates_demonstrations(read, name):
    counts = np.arange(40) if name != "t" else PATH[:, 0]
    part = rows(table=np.column_stack([counts, PATH[:, 1:]]))
    demonstrations = read(f"{name},x,y\n" + part * 3)
    assert [len(each) for each in demonstrations] == [40, 40, 40]


def test_rows_in_no_order_are_not_taken_apart(only):
    shuffled = np.random.default_rng(0).permutation(PATH)
    assert len(only("t,x,y\n" + rows(table=shuffled))) == 40


# Blocks


@given(size=st.integers(30, 3000))
def test_blocks_of_a_text_say_what_the_whole_says(tmp_path_factory, size):
    path = tmp_path_factory.mktemp("blocks") / "move.csv"
    path.write_text("t,x,y\n" + rows() * 2 + "# said\n" + rows())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lines, "BLOCK_BYTES", size)
        patch.setattr(lines, "HEAD_BYTES", size)
        patch.setattr(lines, "HEAD_LINES", 5)
        blocks = list(read_blocks(path))
    assert {block.name for block in blocks} == {"move", "move.1", "move.2"}
    assert_array_equal(np.concatenate([block.values for block in blocks]), np.tile(PATH[:, 1:], (3, 1)))


def test_with_and_without_pyarrow_the_same_is_read(read, monkeypatch):
    text = "t;label;x;y\n" + "".join(f"{t};{'ab'[k % 2]};{x};{y}\n" for k, (t, x, y) in enumerate(PATH))
    fast = read(text, group="label")
    monkeypatch.setattr(cells, "_arrow", lambda: None)
    slow = read(text, group="label")
    assert [each.name for each in fast] == [each.name for each in slow] == ["a", "b"]
    for one, other in zip(fast, slow, strict=True):
        assert_array_equal(one.values, other.values)
        assert_array_equal(one.times, other.times)


def test_a_line_without_an_end_is_refused(read, monkeypatch):
    monkeypatch.setattr(lines, "LONGEST_LINE", 1000)
    with pytest.raises(ReadError, match="line 2: is longer than"):
        read("x,y\n" + "1" * (2**19))


def test_no_number_no_layout():
    assert find_layout(["a,b", "c,d", "", "# 1,2"]) is None
