"""Published recordings: found, checked, fetched only if allowed, and cut into what they show."""

from __future__ import annotations

import csv
import functools
import hashlib
import http.server
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pooch
import pytest

from recorded import DATA, RIM, needs_rim
from unconstrain.base.errors import MissingExtraError, ReadError
from unconstrain.paper.datasets import (
    WipingBout,
    contours,
    load_contour,
    load_fingertip,
    load_hand_tracks,
    load_handwriting,
    load_rim_wiping,
    rim,
)
from unconstrain.paper.datasets.files import DATA_VARIABLE, Source
from unconstrain.paper.datasets.hands import SIGNS
from unconstrain.paper.datasets.handwriting import SHAPES


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, and no local copy."""
    monkeypatch.setattr(pooch, "os_cache", lambda name: tmp_path / "cache" / name)
    monkeypatch.delenv(DATA_VARIABLE, raising=False)
    return tmp_path / "cache" / "unconstrain"


@pytest.fixture
def published(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder on a server of this machine, in place of the one on the internet."""

    class Silent(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_: object) -> None:
            pass

    folder = tmp_path / "published"
    folder.mkdir()
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Silent, directory=folder)) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        monkeypatch.setattr(rim, "SOURCE", Source(rim.SOURCE.folder, f"http://127.0.0.1:{server.server_port}/"))
        yield folder
        server.shutdown()
        thread.join()


# --------------------------------------------------------------------------------------------------- where it is


def test_without_a_copy_both_ways_to_one_are_told(cache: Path) -> None:
    with pytest.raises(ReadError) as caught:
        load_rim_wiping()
    assert f"{rim.RIM_FILE} is not on this machine (looked in {cache / rim.RIM_FILE})" in str(caught.value)
    assert "allow the download with download=True" in str(caught.value)
    assert f"set UNCONSTRAIN_DATA to a folder that holds a copy of {rim.SOURCE.url}{rim.RIM_FILE}" in str(caught.value)


def test_without_pooch_only_the_download_needs_it(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pooch", None)
    with pytest.raises(ReadError, match=r"looked in no folder"):
        load_rim_wiping()
    with pytest.raises(MissingExtraError, match=r"pip install 'unconstrain\[data\]'"):
        load_rim_wiping(download=True)


@pytest.mark.parametrize("folder", [".", "lasa_rim_wiping"])
def test_a_local_copy_is_found_and_checked(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: str
) -> None:
    local = tmp_path / "local" / folder
    local.mkdir(parents=True)
    (local / rim.RIM_FILE).write_bytes(b"something else")
    monkeypatch.setenv(DATA_VARIABLE, str(tmp_path / "local"))
    found = hashlib.sha256(b"something else").hexdigest()
    with pytest.raises(
        ReadError, match=f"its SHA-256 is {found}, expected {rim.SOURCE.sha256(rim.RIM_FILE)}: damaged, or another"
    ):
        load_rim_wiping()


def test_a_download_with_the_wrong_checksum_is_refused_and_not_kept(cache: Path, published: Path) -> None:
    (published / rim.RIM_FILE).write_bytes(b"tampered")
    with pytest.raises(ReadError, match=r"could not be downloaded from http://127.* hash .* does not match"):
        load_rim_wiping(download=True)
    assert not (cache / rim.RIM_FILE).exists()


def test_a_download_that_is_not_there_is_one_clear_error(cache: Path, published: Path) -> None:
    with pytest.raises(ReadError, match=r"could not be downloaded from .*404 .*Try again, or set UNCONSTRAIN_DATA"):
        load_rim_wiping(download=True)


@needs_rim
def test_a_download_is_kept_and_used_without_asking_again(cache: Path, published: Path) -> None:
    (published / rim.RIM_FILE).write_bytes((RIM / rim.RIM_FILE).read_bytes())
    first = load_rim_wiping(download=True)
    (published / rim.RIM_FILE).unlink()
    again = load_rim_wiping()
    assert (cache / rim.RIM_FILE).is_file()
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.demonstration.states, other.demonstration.states)


# ----------------------------------------------------------------------------------------------------- what it is


@pytest.fixture
def bouts(monkeypatch: pytest.MonkeyPatch) -> dict[str, WipingBout]:
    monkeypatch.setenv(DATA_VARIABLE, str(DATA))
    return {bout.name: bout for bout in load_rim_wiping()}


@pytest.fixture
def annotations() -> dict[str, dict[str, str]]:
    with (RIM / "bouts.csv").open() as file:
        return {row["bout"]: row for row in csv.DictReader(file)}


def numbers(row: dict[str, str], *names: str) -> list[float]:
    return [float(row[name]) for name in names]


@needs_rim
def test_the_recordings_are_those_of_the_converted_tables() -> None:
    tracks = rim._load_rim(RIM / rim.RIM_FILE)
    assert len(tracks) == 6
    for index, track in enumerate(tracks):
        table = np.loadtxt(RIM / f"demo_{index}.csv", delimiter=",", skiprows=1)
        np.testing.assert_allclose(track.positions, table[:, 1:4], atol=1e-6)
        assert track.interval == pytest.approx(np.diff(table[:, 0]).mean(), rel=1e-6)


@needs_rim
def test_rows_and_tilts_are_those_annotated(annotations: dict[str, dict[str, str]]) -> None:
    for bout in rim.RIM_BOUTS:
        row = annotations[bout.name]
        assert [bout.recording, bout.start, bout.stop] == [int(row[key]) for key in ("demo", "start", "stop")]
        assert bout.tilt == row["group"]
    assert len(annotations) == len(rim.RIM_BOUTS)


@needs_rim
def test_both_normals_are_those_annotated(bouts: dict[str, WipingBout], annotations: dict[str, dict[str, str]]) -> None:
    for name, bout in bouts.items():
        row = annotations[name]
        np.testing.assert_allclose(bout.plane_normal, numbers(row, "nx", "ny", "nz"), atol=2e-6)
        np.testing.assert_allclose(bout.tool_normal, numbers(row, "toolnx", "toolny", "toolnz"), atol=2e-6)
        angle = np.degrees(np.arccos(bout.plane_normal @ bout.tool_normal))
        assert angle == pytest.approx(float(row["angle_plane_tool_deg"]), abs=1e-4)


@needs_rim
def test_all_bouts_go_round_the_same_way(bouts: dict[str, WipingBout]) -> None:
    for bout in bouts.values():
        demonstration = bout.demonstration
        arms = demonstration.states - demonstration.states.mean(axis=0)
        assert (np.cross(arms, demonstration.actions) @ bout.plane_normal).mean() > 0


@needs_rim
def test_velocities_are_tangent_to_the_flat_rim_and_add_up_to_the_way(bouts: dict[str, WipingBout]) -> None:
    for name, bout in bouts.items():
        demonstration = bout.demonstration
        assert demonstration.times is not None
        np.testing.assert_allclose(np.diff(demonstration.times), 0.05)
        way = np.trapezoid(demonstration.actions, demonstration.times, axis=0)
        np.testing.assert_allclose(way, demonstration.states[-1] - demonstration.states[0], atol=4e-3)
        if name.startswith("A"):
            off = np.linalg.norm(demonstration.actions @ bout.plane_normal) / np.linalg.norm(demonstration.actions)
            assert off < 0.04


@needs_rim
def test_the_bout_wiped_backwards_is_turned_round(bouts: dict[str, WipingBout]) -> None:
    states = bouts["C1"].demonstration.states
    track = rim._load_rim(RIM / rim.RIM_FILE)[3]
    np.testing.assert_array_equal(states[-1], track.positions[350])


@needs_rim
def test_rate_and_centring_can_be_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DATA_VARIABLE, str(DATA))
    for bout in load_rim_wiping(rate=10, centre=True):
        assert bout.demonstration.times is not None
        np.testing.assert_allclose(np.diff(bout.demonstration.times), 0.1)
        np.testing.assert_allclose(bout.demonstration.states.mean(axis=0), 0, atol=1e-12)


# ----------------------------------------------------------------------------------------- handwriting, signs, contours

HANDWRITING, HANDS, CONTOURS = DATA / "lasa_handwriting", DATA / "libras_hand", DATA / "kuleuven_contour"
needs_handwriting = pytest.mark.skipif(not HANDWRITING.is_dir(), reason=f"no handwriting in {DATA}")
needs_hands = pytest.mark.skipif(not HANDS.is_dir(), reason=f"no tracks of hands in {DATA}")
needs_contours = pytest.mark.skipif(not CONTOURS.is_dir(), reason=f"no contours in {DATA}")


@pytest.fixture
def local(monkeypatch: pytest.MonkeyPatch) -> None:
    """The copies beside the clone."""
    monkeypatch.setenv(DATA_VARIABLE, str(DATA))


@needs_handwriting
def test_every_shape_of_the_folder_has_seven_strokes_that_end_at_the_origin(local: None) -> None:
    assert set(SHAPES) == {path.stem for path in HANDWRITING.glob("*.mat")}
    for shape in SHAPES:
        strokes = load_handwriting(shape, every=1)
        assert [len(stroke) for stroke in strokes] == [1000] * 7
        assert all(np.abs(stroke.states[-1]).max() < 1e-6 for stroke in strokes)


@needs_handwriting
def test_velocities_of_handwriting_add_up_to_the_way(local: None) -> None:
    for stroke in load_handwriting("Sine", every=1):
        way = np.trapezoid(stroke.actions, stroke.times, axis=0)
        np.testing.assert_allclose(way, stroke.states[-1] - stroke.states[0], atol=0.02 * np.ptp(stroke.states))


@needs_handwriting
def test_one_sample_in_so_many_is_kept(local: None) -> None:
    whole, thinned = (load_handwriting("Angle", every=every)[3] for every in (1, 50))
    np.testing.assert_array_equal(thinned.states, whole.states[::50])
    np.testing.assert_array_equal(thinned.times, whole.times[::50])


@needs_hands
def test_tracks_are_those_of_the_table_with_the_slopes_of_a_cubic(local: None) -> None:
    table = np.loadtxt(HANDS / "movement_libras.csv", delimiter=",")
    assert sorted(SIGNS) == sorted(set(table[:, -1].astype(int)))
    tracks = load_hand_tracks(6)
    rows = table[table[:, -1] == 6]
    assert len(tracks) == len(rows) == 24
    for track, row in zip(tracks, rows, strict=True):
        np.testing.assert_array_equal(track.states, row[:-1].reshape(45, 2))
        around = slice(20 - 3, 20 + 4)
        slope = np.polyfit(track.times[around] - track.times[20], track.states[around], 3)[-2]
        np.testing.assert_allclose(track.actions[20], slope, atol=1e-9)
        assert track.times[-1] == pytest.approx(7 * 44 / 45)


@needs_hands
def test_circles_are_drawn_the_same_way_round_but_for_one(local: None) -> None:
    arms = [(track.states - track.states.mean(axis=0), track.actions) for track in load_hand_tracks(6)]
    turns = [np.sign((arm[:, 0] * speed[:, 1] - arm[:, 1] * speed[:, 0]).mean()) for arm, speed in arms]
    assert abs(sum(turns)) == 22


@needs_contours
@pytest.mark.filterwarnings("ignore:rest")  # as some did for a second, before they began
def test_contours_pass_where_the_tracker_was(local: None) -> None:
    for setup in contours.SETUPS:
        for take, demonstration in enumerate(load_contour(setup, rate=10), 1):
            table = np.loadtxt(CONTOURS / f"data_demo_{setup}_{take}.dat", skiprows=1)
            steps = np.diff(demonstration.times)
            np.testing.assert_allclose(steps, 0.1)
            nearest = np.linalg.norm(demonstration.states[:, None] - table[None, ::5, 1:4], axis=2).min(axis=1)
            assert nearest.max() < 0.01
            way = np.trapezoid(demonstration.actions, demonstration.times, axis=0)
            np.testing.assert_allclose(way, demonstration.states[-1] - demonstration.states[0], atol=0.03)


FINGERTIP = DATA / "ccl_trakstar_planar" / "planer_circle.csv"


@pytest.mark.skipif(not FINGERTIP.is_file(), reason=f"no {FINGERTIP}")
def test_a_fingertip_does_not_jump_across_the_tracker(local: None) -> None:
    table = np.loadtxt(FINGERTIP, delimiter=",", skiprows=1)
    assert np.linalg.norm(np.diff(table[:, 1:4], axis=0), axis=1).max() > 0.5
    demonstration = load_fingertip()
    assert len(demonstration) == pytest.approx(len(table), abs=3)
    assert np.linalg.norm(np.diff(demonstration.states, axis=0), axis=1).max() < 0.05
    way = np.trapezoid(demonstration.actions, demonstration.times, axis=0)
    np.testing.assert_allclose(way, demonstration.states[-1] - demonstration.states[0], atol=0.02)


@pytest.mark.parametrize(
    ("file", "load"),
    [
        ("lasa_handwriting/Angle.mat", lambda: load_handwriting("Angle")),
        ("libras_hand/movement_libras.csv", lambda: load_hand_tracks(1)),
        ("kuleuven_contour/data_demo_a_1.dat", lambda: load_contour("a")),
        ("ccl_trakstar_planar/planer_circle.csv", load_fingertip),
    ],
)
def test_what_is_not_the_published_file_is_refused(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: str, load: Callable[[], object]
) -> None:
    monkeypatch.setenv(DATA_VARIABLE, str(tmp_path))
    with pytest.raises(ReadError, match=f"{Path(file).name} is not on this machine"):
        load()
    (tmp_path / file).parent.mkdir()
    (tmp_path / file).write_text("1")
    with pytest.raises(ReadError, match=r"its SHA-256 is [0-9a-f]{64}, expected [0-9a-f]{64}: damaged, or another"):
        load()


def test_the_signs_cannot_be_downloaded_and_say_so(cache: Path) -> None:
    with pytest.raises(ReadError, match=r"Set UNCONSTRAIN_DATA to a folder that holds a copy of movement_libras.csv"):
        load_hand_tracks(1)
