"""What is not what it seems is said, with its row and what cures it; what is as it seems is left alone."""

import json
import re
import tracemalloc
import warnings
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

import faults
import unconstrain as uc
from recorded import DATA, RIM, needs_data, needs_rim
from test_cli import call, run, write
from unconstrain.base.errors import SettingError
from unconstrain.recordings.preparation import PreparationWarning, prepare, survey, survey_set, window_used
from unconstrain.recordings.remarks import WARNINGS
from unconstrain.recordings.signals.jumps import glitches, seams, topics
from unconstrain.recordings.signals.stillness import is_noise, noise_share, pauses, rest_at_ends


def codes(recordings, recipe=None):
    """Codes said of each recording, of its numbers of demonstrations apart."""
    return [
        [remark.code for remark in one.warnings if remark.code != "few-demonstrations"]
        for one in survey_set(recordings, recipe)
    ]


def quietly(recordings, recipe):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PreparationWarning)
        return prepare(recordings, recipe)


# ----------------------------------------------------------------------------------------------- faults that are put in


@pytest.mark.parametrize("fault", faults.FAULTS, ids=lambda fault: fault.__name__)
def test_faults_are_found_at_their_rows_and_others_are_not(fault):
    done = faults.tally(fault, 3, seed=7)
    assert done.rows == (3 if "nothing" not in fault.__name__ else 0)
    assert done.false == 0, done.others


@pytest.mark.slow
def test_faults_are_found_in_95_sets_of_100_and_false_ones_in_one_at_most():
    done = [faults.tally(fault, 40, seed=8) for fault in faults.FAULTS]
    assert min(one.found for one in done[2:]) >= 38
    assert sum(one.false for one in done) <= 0.01 * sum(one.sets for one in done)


def test_every_code_is_put_in_but_those_of_readers_and_fits():
    put_in = {fault(np.random.default_rng(0)).code for fault in faults.FAULTS}
    elsewhere = {"rolled-out"}  # which takes the command that writes such: test_said.py
    assert set(WARNINGS) - put_in == {"explains-nothing", "dropped-column", "several-in-one"} | elsewhere


# ------------------------------------------------------------------------------------------------------ real recordings


def strokes():
    for path in sorted((DATA / "lasa_handwriting").glob("*.mat")):
        for number, stroke in enumerate(loadmat(path, simplify_cells=True)["demos"]):
            name = f"{path.stem} {number}"
            yield uc.Recording(("x", "y"), np.asarray(stroke["pos"].T, float), np.asarray(stroke["t"], float), name)


def hands():
    tracks = np.loadtxt(DATA / "libras_hand" / "movement_libras.csv", delimiter=",")[:, :90]
    for number, track in enumerate(tracks):
        yield uc.Recording(("x", "y"), track.reshape(45, 2), 0.16 * np.arange(45), f"hand {number}")


def contours(every=False):
    """Rows where a tracker saw something new, or every row of a clock that is ten times as fast."""
    for path in sorted((DATA / "kuleuven_contour").glob("data_demo_*.dat")):
        table = np.loadtxt(path, skiprows=1)
        table = table[every | np.r_[True, (np.diff(table[:, 1:4], axis=0) != 0).any(axis=1)]]
        yield uc.Recording(("x", "y", "z"), table[:, 1:4], table[:, 0], path.stem)


@needs_data
@pytest.mark.parametrize(("recordings", "every"), [(strokes, 9), (hands, 9), (contours, 3)])
def test_nothing_is_said_of_real_recordings(recordings, every):
    for recording in list(recordings())[::every]:
        assert codes([recording], uc.Recipe(recording.columns, differentiate="savgol")) == [[]], recording.name


@needs_data
def test_a_tracker_that_is_slower_than_its_clock_is_found_in_real_recordings():
    for recording in contours(every=True):
        [found] = codes([recording], uc.Recipe(recording.columns, differentiate="savgol"))
        assert {*found} - {"clock-gap"} == {"stale"}, recording.name  # the stamps of one come in pairs


@pytest.mark.slow
@needs_data
@pytest.mark.parametrize(("recordings", "allowed"), [(strokes, 0), (hands, 3), (contours, 0)])
def test_nothing_is_said_of_any_real_recording(recordings, allowed):
    said = [codes([one], uc.Recipe(one.columns, differentiate="savgol")) for one in recordings()]
    assert sum(one != [[]] for one in said) <= allowed


def of_one_kind():
    """Real movements beside others of their kind: seven strokes of each shape, tracks of one sign, contours."""
    every, signs = list(strokes()), np.loadtxt(DATA / "libras_hand" / "movement_libras.csv", delimiter=",")[:, -1]
    tracks = list(hands())
    yield from (every[first : first + 7] for first in range(0, len(every), 7))
    yield from ([tracks[row] for row in np.flatnonzero(signs == sign)] for sign in np.unique(signs))
    yield list(contours())


def beside(recordings):
    found = survey_set(recordings, uc.Recipe(recordings[0].columns, differentiate="savgol"))
    return [next((one for one in each.warnings if one.code == "columns-differ"), None) for each in found]


@needs_data
def test_real_movements_of_one_kind_have_the_same_columns():
    for recordings in of_one_kind():
        assert beside(recordings) == [None] * len(recordings), recordings[0].name


@needs_data
@pytest.mark.parametrize("sign", [True, False])
def test_of_handwriting_most_files_with_other_columns_are_named_and_no_others(sign):
    named = false = 0
    for recordings in list(of_one_kind())[:30]:
        values = recordings[2].values * [-1.0, 1.0] if sign else recordings[2].values[:, ::-1]
        found = beside([*recordings[:2], replace(recordings[2], values=values), *recordings[3:]])
        named += (
            found[2] is not None and ("the sign of 'x' turned" if sign else "'x' and 'y' exchanged") in found[2].message
        )
        false += sum(one is not None for one in found[:2] + found[3:])
    assert named >= 22
    assert false == 0


@needs_rim
def test_nothing_is_said_of_wiping_but_of_its_quaternions_where_they_are_used():
    recordings = [uc.read(path)[0] for path in sorted(RIM.glob("demo_*.csv"))]
    assert codes(recordings) == [[]] * 5 + [["pause"]]  # two rests between bouts
    turned = [index for index, one in enumerate(recordings) if _turns_sign(one.select(("qx", "qy", "qz", "qw")))]
    assert turned == [2, 4]
    said = codes(recordings, uc.Recipe(("qx", "qy", "qz", "qw"), differentiate="savgol"))
    assert [index for index, one in enumerate(said) if "quaternion-flip" in one] == turned


def _turns_sign(quaternions):
    return bool(((quaternions[1:] * quaternions[:-1]).sum(axis=1) < 0).any())


@needs_data
def test_a_tracker_that_flips_its_hemisphere_leaves_glitches():
    recording = uc.read(DATA / "ccl_trakstar_planar" / "planer_circle.csv")[0]
    assert codes([recording], uc.Recipe(("x", "y", "z"), differentiate="savgol")) == [["glitch"]]


def test_of_many_columns_some_show_that_rows_are_at_two_places():
    track = np.sin(0.02 * np.arange(200)[:, None] + np.arange(350))
    assert topics(track) is None
    assert topics(np.where(np.arange(200)[:, None] % 2, 9.0 + track, track)) == 1


def test_what_is_noise_does_not_depend_on_the_unit():
    walk = np.random.default_rng(0).normal(size=(50, 3)).cumsum(axis=0)
    share = [np.sum(np.diff(one) ** 2) / (2 * 49 * np.var(one)) for one in walk.T]
    for unit in (1e-310, 1e-200, 1.0, 1e200):  # whose squares may be nothing, or more than there is
        assert_allclose(noise_share(walk * unit), share, rtol=1e-6)
    assert_array_equal(noise_share(np.array([[0.1, 0.0], [0.1, 5e-324]])), [1.0, 2.0])


def test_a_wide_table_has_the_glitches_of_its_columns():
    rng = np.random.default_rng(1)
    values = rng.normal(size=(60, 1500)).cumsum(axis=0).cumsum(axis=0)
    values[rng.integers(60, size=700), rng.integers(1500, size=700)] += 100.0
    alone = [(column, one.start, one.stop) for column in range(1500) for one in glitches(values[:, [column]])]
    assert sorted(glitches(values)) == alone
    assert len(alone) > 300


def test_a_look_takes_little_memory_beside_the_recording():
    times = 0.01 * np.arange(100_000)
    track = np.cos(0.3 * times[:, None] + np.arange(6)) + 1e-3 * np.random.default_rng(0).normal(size=(len(times), 6))
    long = uc.Recording(tuple("abcdef"), track, times, "long")
    tracemalloc.start()
    try:
        assert survey(long, uc.Recipe(tuple("abcdef"), differentiate="savgol")).warnings == ()
        assert tracemalloc.get_traced_memory()[1] < 2.2 * track.nbytes
    finally:
        tracemalloc.stop()


# ---------------------------------------------------------------------------------------------------------------- cures

TIMES = np.arange(0, 4, 0.02)
TRACK = np.column_stack([np.cos(1.5 * TIMES), np.sin(1.5 * TIMES)])
MOVED = uc.Recipe(("x", "y"), differentiate="savgol")


def recording(track=TRACK, times=TIMES, columns=("x", "y")):
    return uc.Recording(columns, track, times, "wipe")


def test_a_pause_is_left_out_and_stamps_stay_right():
    track = np.insert(TRACK, [80] * 60, TRACK[80], axis=0)
    times = 0.02 * np.arange(len(track))
    with pytest.warns(PreparationWarning, match=r"pause: 'wipe', row 80: stands still for 6\d of 260 rows .* left out"):
        [demonstration] = prepare(recording(track, times), MOVED)
    gone = ~np.isin(times, demonstration.times)
    assert 58 <= gone.sum() <= 62
    np.testing.assert_allclose(np.flatnonzero(gone).mean(), 110, atol=2)
    speed = np.linalg.norm(demonstration.actions, axis=1)
    np.testing.assert_allclose(speed, 1.5, atol=0.02)
    assert len(quietly(recording(track, times), uc.Recipe(("x", "y"), differentiate="savgol", pauses="keep"))[0]) == 260


def swings(seed, still=350):
    """Twelve demonstrations behind planes, and the same that stand still for so many rows in the middle."""
    rng, bare, held = np.random.default_rng(seed), [], []
    for number in range(12):
        normal, x, rows = rng.standard_normal(3), rng.uniform(-1, 1, 3), []
        normal /= np.linalg.norm(normal)
        for _ in range(150):
            rows.append(x)
            velocity = faults.cycle(x[None])[0]
            x = x + 0.02 * (velocity - normal * (normal @ velocity))
        track = np.insert(np.array(rows), [75] * still, rows[75], axis=0)
        shaken = track + 2e-4 * rng.standard_normal(track.shape)
        moving = np.delete(shaken, np.arange(75, 75 + still), axis=0)
        for recordings, table in ((bare, moving), (held, shaken)):
            recordings.append(uc.Recording(("x", "y", "z"), table, 0.02 * np.arange(len(table)), f"{number}"))
    return bare, held


@pytest.mark.parametrize(("learner", "seeds"), [("robust", 1), ("hybrid", 3)])
def test_pauses_of_seven_tenths_cost_the_policy_next_to_nothing(learner, seeds):
    states = np.random.default_rng(99).uniform(-0.7, 0.7, (500, 3))
    truth = faults.cycle(states)

    def error(recordings):
        policy = uc.LocallyLinearPolicy(learner=learner).fit_demonstrations(quietly(recordings, MOVED_IN_SPACE))
        return ((policy(states) - truth) ** 2).sum() / ((truth - truth.mean(axis=0)) ** 2).sum()

    errors = np.array([list(map(error, swings(seed))) for seed in range(seeds)])
    assert np.exp(np.log(errors[:, 1] / errors[:, 0]).mean()) < 1.3


def test_rest_after_a_sudden_end_costs_the_policy_next_to_nothing():
    """Six tenths of a second, of one in seven demonstrations behind planes; learnt, they cost more than all noise."""
    states, rng = np.random.default_rng(99).uniform(-0.7, 0.7, (500, 3)), np.random.default_rng(1)
    truth, bare, resting = faults.cycle(states), [], []
    for number in range(7):
        normal, x, rows = rng.standard_normal(3) * [0.5, 0.5, 0.3] + [0.0, 0.0, 1.0], rng.uniform(-1, 1, 3), []
        normal /= np.linalg.norm(normal)
        for _ in range(300):
            rows.append(x)
            velocity = faults.cycle(x[None])[0]
            x = x + 0.02 * (velocity - normal * (normal @ velocity))
        track = np.array(rows + rows[-1:] * 30)
        track += 1e-3 * rng.standard_normal(track.shape)
        for recordings, stop in ((bare, 300), (resting, 330 if number == 3 else 300)):
            recordings.append(uc.Recording(("x", "y", "z"), track[:stop], 0.02 * np.arange(stop), f"{number}"))

    def error(recordings, pauses="drop"):
        demos = quietly(recordings, replace(MOVED_IN_SPACE, pauses=pauses))
        return ((uc.LocallyLinearPolicy().fit_demonstrations(demos)(states) - truth) ** 2).sum()

    without = error(bare)
    assert error(resting) < 1.3 * without
    assert error(resting, "keep") > 3.0 * without


MOVED_IN_SPACE = uc.Recipe(("x", "y", "z"), differentiate="savgol")


@pytest.mark.parametrize("shaken", [0.0, 0.4])
@pytest.mark.parametrize(("pace", "found"), [(0.0, True), (0.15, False)])
def test_a_pause_is_found_where_only_what_stands_still_trembles(pace, found, shaken):
    """Some 100 mm/s for 6 seconds, with 3 of another pace in the middle."""
    passed = np.cumsum(np.repeat([0.02, 0.02 * pace, 0.02], [150, 150, 150]))
    track = 95.0 * np.column_stack([np.sin(passed), np.cos(passed)])
    track[150:300] += shaken * np.random.default_rng(0).standard_normal((150, 2))
    bounds = np.array(pauses(track))
    assert bounds.shape == ((1, 2) if found else (0,))
    assert not found or abs(bounds - [150, 300]).max() <= 10


def test_reaches_that_creep_under_noise_do_not_pause():
    share, rng = np.linspace(0, 1, 200), np.random.default_rng(0)
    reach = share[:, None] ** 3 * (10 - 15 * share[:, None] + 6 * share[:, None] ** 2) * [0.8, 0.6]
    assert not [found for _ in range(40) if (found := pauses(reach + 0.03 * rng.standard_normal(reach.shape)))]


def begun_late(seconds, noise=2e-4, rate=50.0):
    """A reach of three seconds, of least jerk, after standing still for some seconds."""
    share = np.linspace(0.0, 1.0, int(3 * rate))[:, None]
    reach = (10 * share**3 - 15 * share**4 + 6 * share**5) * [0.4, 0.2]
    states = np.vstack([np.zeros((int(seconds * rate), 2)), reach])
    return uc.Recording(
        ("x", "y"),
        states + noise * np.random.default_rng(0).standard_normal(states.shape),
        np.arange(len(states)) / rate,
        "late",
    )


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3])
def test_standing_still_before_the_start_is_left_out_and_told_in_seconds(noise):
    recipe, recording = uc.Recipe(("x", "y"), differentiate="savgol"), begun_late(2.0, noise)
    kept = replace(recipe, pauses="keep")
    for some, done in ((recipe, r"left out \(pauses='keep'\)\."), (kept, r"learnt as rest there\.")):
        [told] = [one for one in survey(recording, some).notes if one.code == "rest"]
        found = re.match(rf"stands still for \d+ of 250 rows \((\S+) s\) before it starts, {done}", told.message)
        assert 1.9 < float(found[1]) < 2.5
    with pytest.warns(PreparationWarning, match="left out"):
        begun = uc.prepare([recording], recipe)[0].times[0]
    assert begun == pytest.approx(float(found[1]), abs=0.03)  # the stamps stay
    with pytest.warns(PreparationWarning, match="learnt as rest there"):
        assert uc.prepare([recording], kept)[0].times[0] == 0.0
    assert uc.prepare([begun_late(0.0, noise)], recipe)[0].times[0] == 0.0
    assert not survey(begun_late(0.0, noise), recipe).notes
    assert not survey(begun_late(2.0, noise), replace(recipe, still=0.02)).notes


@pytest.mark.parametrize("noise", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("smooth", [0.0, 0.3])
def test_rest_before_a_start_is_found_whatever_the_speed_after_it(noise, smooth):
    """Round a cycle of 80 mm from starts inside and outside it, of 35 to 400 mm/s, at once or smoothly."""
    rng = np.random.default_rng(0)
    for radius in np.linspace(15.0, 125.0, 9):
        at, path = np.array([radius, 0.0]), list[np.ndarray]()
        for row in range(500):
            path.append(at)
            velocity = at * (1.0 - at @ at / 80.0**2) + 2.2 * np.array([-at[1], at[0]])
            at = at + 0.01 * velocity * min(1.0, 0.01 * row / smooth if smooth else 1.0)
        for seconds in (0.0, 0.4, 0.8, 1.5):
            values = np.vstack([np.tile(path[0], (round(100 * seconds), 1)), path])
            first, last = rest_at_ends(values + noise * rng.standard_normal(values.shape), 0.01)
            assert last == 0
            assert (first > 0) == (seconds > 0)
            assert not first or -1 <= first - round(100 * seconds) <= 30


@pytest.mark.parametrize("window", [0.25, 4.0])
def test_rest_up_to_the_other_end_or_in_a_window_longer_than_all_is_no_error(window):
    rng, rest = np.random.default_rng(0), np.zeros((60, 2))
    for then in (np.cumsum(rng.uniform(0.5, 1.0, (60, 2)), axis=0), rest + 1.0, rest):
        states = np.vstack([rest, then]) + 1e-4 * rng.standard_normal((120, 2))
        recording = uc.Recording(("x", "y"), states, np.arange(120) * 0.02, "w")
        notes = survey(recording, uc.Recipe(("x", "y"), differentiate="savgol", window_s=window)).notes
        assert ("rest" in [one.code for one in notes]) == (then is not rest)


def halted(values, row, rows):
    """The same movement with a stop of so many rows, slowing down and setting off within five each."""
    slow = 0.5 + 0.5 * np.cos(np.linspace(0, np.pi, 5))
    pace = np.concatenate([np.ones(row), slow, np.zeros(rows), slow[::-1], np.ones(len(values) - row)])
    at = np.cumsum(pace)[: np.searchsorted(np.cumsum(pace), len(values) - 1)]
    return np.column_stack([np.interp(at, np.arange(len(values)), column) for column in values.T])


def stops_told(values, rate):
    recording = uc.Recording(("x", "y", "z"), values, np.arange(len(values)) / rate, "wipe")
    found = survey(recording, uc.Recipe(("x", "y", "z"), differentiate="savgol"))
    return [one for one in found.warnings if one.code == "pause"]


def to_and_fro(rate, beside=0.0, noise=0.0, turn_s=2.0):
    t, rng = np.arange(0, 3 * turn_s, 1 / rate), np.random.default_rng(3)
    angle = 2 * np.pi * t / turn_s
    path = np.column_stack([np.cos(angle), beside * np.sin(angle), 0.3 * np.cos(angle)])
    return 0.2 * (path + noise * rng.standard_normal(path.shape))


@pytest.mark.parametrize("rate", [20, 50, 200])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_stop_on_the_way_is_told_with_its_second_and_what_to_do(rate, noise):
    clean = to_and_fro(rate, 1.0, turn_s=4.0)
    values = halted(clean, 3 * rate, round(0.4 * rate))
    values += 0.2 * noise * np.random.default_rng(1).standard_normal(values.shape)
    [said] = stops_told(values, rate)
    start, seconds = map(float, re.search(r"at ([\d.]+) s for ([\d.]+) s", said.message).groups())
    assert 3.0 - 0.2 <= start <= 3.0 + 5 / rate + 0.1
    assert 0.3 <= seconds <= 0.4 + 10 / rate + 0.1
    assert "cut it there: pauses='cut'" in said.message
    [(first, last)] = said.spans
    assert first == said.row
    assert abs((last - first) / rate - seconds) < 0.01
    assert abs(said.row / rate - start) < 0.01


@pytest.mark.parametrize("rate", [20, 50, 200])
@pytest.mark.parametrize("noise", [0.0, 0.002])
@pytest.mark.parametrize("beside", [0.0, 0.1, 1.0])
@pytest.mark.parametrize("turn_s", [1.0, 3.0, 8.0])
def test_turning_points_are_no_stops(rate, noise, beside, turn_s):
    assert not stops_told(to_and_fro(rate, beside, noise, turn_s), rate)


@needs_data
@pytest.mark.parametrize(("recordings", "every"), [(strokes, 3), (contours, 1)])
def test_handwriting_and_contours_do_not_stop_on_the_way(recordings, every):
    for recording in list(recordings())[::every]:
        found = survey(recording, uc.Recipe(recording.columns, differentiate="savgol"))
        assert "pause" not in [one.code for one in found.warnings], recording.name


@needs_rim
def test_rests_between_bouts_of_wiping_are_stops():
    told = [
        [one.message for one in survey(uc.read(path)[0]).warnings if one.code == "pause"]
        for path in sorted(RIM.glob("demo_*.csv"))
    ]
    assert [len(one) for one in told] == [0, 0, 0, 0, 0, 1]
    assert "at 11.9 s for 1 s, 24 s for 0.9 s" in told[5][0]


def of_joints(names, size=40.0, units=None):
    t = np.linspace(0, 4, 200)
    values = size * np.column_stack([np.sin((1 + 0.3 * column) * t) for column in range(len(names))])
    return [
        uc.Recording(tuple(names), (1 + 0.1 * number) * values, t, f"r{number}", units=units or {})
        for number in range(4)
    ]


def about_degrees(recordings, **recipe):
    asked = uc.Recipe(recordings[0].columns, differentiate="savgol", **recipe)
    notes = [[one.message for one in each.notes if one.code == "degrees"] for each in survey_set(recordings, asked)]
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        prepare(recordings, asked)
    assert ([one.message.remark.message for one in said if one.message.remark.code == "degrees"] != []) == any(notes)
    return notes


@pytest.mark.parametrize(
    "names",
    [("q1", "q2"), ("joint_1", "joint_2"), ("shoulder_pan", "elbow_flex"), ("left_elbow", "wrist_roll"),
     ("robot/qpos0", "robot/qpos1"), ("shoulder_lift.pos", "elbow.pos"), ("Knee", "Hip")],
)  # fmt: skip
def test_joints_that_are_all_in_degrees_are_told_with_the_option(names):
    for [said] in about_degrees(of_joints(names)):
        assert "looks like degrees" in said
        assert f"degrees={names}" in said


@pytest.mark.parametrize(
    ("names", "size", "settings"),
    [
        (("x", "y", "z"), 400.0, {}),  # mm
        (("wrist_x", "wrist_y", "wrist.z", "kneeX"), 400.0, {}),  # markers
        (("hip_height", "q", "qx", "qy"), 3.0, {}),
        (("q1", "q2"), 4.5, {}),  # radians, nearly two turns from end to end
        (("wheel_left", "wheel_right"), 400.0, {}),
        (("q1", "q2"), 40.0, {"degrees": ()}),
        (("q1", "q2"), 40.0, {"degrees": ("q1", "q2")}),
    ],
)
def test_positions_wheels_and_joints_of_known_unit_are_not_said_to_be_in_degrees(names, size, settings):
    assert about_degrees(of_joints(names, size), **settings) == [[]] * 4


def test_joints_whose_unit_is_given_are_not_doubted():
    assert about_degrees(of_joints(("q1", "q2"), 40.0, {"q1": "rad", "q2": "rad"})) == [[]] * 4


def test_how_long_a_pause_lasts_is_told_in_seconds():
    late = begun_late(0.0)
    values = np.vstack([late.values[:75], np.repeat(late.values[75:76], 60, axis=0), late.values[75:]])
    paused = uc.Recording(("x", "y"), values, np.arange(len(values)) / 50.0, "paused")
    [told] = survey(paused, uc.Recipe(("x", "y"), differentiate="savgol")).warnings
    assert re.match(r"stands still for \d+ of 210 rows \(1\.[12]\d* s\) in the middle; they are left out", told.message)


def test_a_pause_is_found_where_the_movement_after_it_creeps():
    for number, held in enumerate(swings(5)[1]):  # behind two of these planes hardly anything moves after the pause
        [(start, stop)] = pauses(held.values)
        assert abs(start - 75) <= 3, number
        assert abs(stop - 426) <= 3, number


@pytest.mark.parametrize("cure", ["repair", "drop"])
def test_a_glitch_is_repaired_or_dropped(cure):
    track = TRACK.copy()
    track[70] += [2, -1]
    recipe = uc.Recipe(("x", "y"), differentiate="savgol", glitches=cure)
    [demonstration] = quietly(recording(track), recipe)
    [clean] = prepare(recording(), MOVED)
    np.testing.assert_allclose(demonstration.actions, clean.actions, atol=0.01)
    assert codes([recording(track)], recipe) == [[]]


@pytest.mark.parametrize(("rows", "few"), [([70], True), ([70, 120, 121, 122], True), ([70, 71, 72, 73], False)])
@pytest.mark.parametrize("timeless", [False, True])
def test_few_glitches_in_a_row_are_repaired_unasked_and_said(rows, few, timeless):
    track, clean = TRACK.copy(), uc.prepare(recording(), uc.Recipe(("x", "y"), differentiate="savgol"))[0]
    track[rows, 0] += 2.0
    track[rows[:2], 1] -= 1.0
    if timeless:
        given = uc.Recording(("x", "y", "a", "b"), np.hstack([track, clean.actions]), None, "d")
        recipe, kept = uc.Recipe(("x", "y"), ("a", "b")), uc.Recipe(("x", "y"), ("a", "b"), glitches="keep")
    else:
        given, recipe = recording(track), uc.Recipe(("x", "y"), differentiate="savgol")
        kept = uc.Recipe(("x", "y"), differentiate="savgol", glitches="keep")
    assert recipe.glitches == "auto"
    [found], [as_recorded] = quietly(given, recipe), quietly(given, kept)
    np.testing.assert_array_equal(as_recorded.states, track)
    if few:
        np.testing.assert_allclose(found.states, TRACK, atol=0.01)
        np.testing.assert_array_equal(np.delete(found.states, rows, axis=0), np.delete(TRACK, rows, axis=0))
        np.testing.assert_allclose(found.actions, clean.actions, atol=0.05)
    else:
        np.testing.assert_array_equal(found.states, track)
    [told] = [one for one in survey(given, recipe).warnings if one.code == "glitch"]
    assert (told.row, told.column, told.cured) == (rows[0], "x", few)
    assert ("repaired by a straight line" in told.message) == few
    assert ("all too many in a row to repair: kept" in told.message) != few
    [told] = [one for one in survey(given, kept).warnings if one.code == "glitch"]
    assert told.message.endswith("neighbours; glitches='repair' or glitches='drop'.")


def test_of_glitches_few_and_many_in_a_row_the_few_are_repaired_and_the_many_named():
    track = TRACK.copy()
    track[30] += 2.0
    track[70:82] = 0.0
    [found] = quietly(recording(track), MOVED)
    np.testing.assert_allclose(found.states[30], TRACK[30], atol=0.01)
    np.testing.assert_array_equal(found.states[70:82], 0.0)
    [told] = [one for one in survey(recording(track), MOVED).warnings if one.code == "glitch"]
    assert (told.row, told.cured) == (70, False)
    assert told.message.startswith("13 samples far off their neighbours, 12 too many in a row")


def test_a_cut_at_a_seam_keeps_both_sides_apart():
    other = TRACK[:100] + np.array([5, 3])
    both = recording(np.concatenate([TRACK, other]), 0.02 * np.arange(300))
    [demonstration] = quietly(both, uc.Recipe(("x", "y"), differentiate="savgol", seams="cut"))
    apart = [prepare(recording(track, 0.02 * np.arange(len(track))), MOVED)[0].actions for track in (TRACK, other)]
    np.testing.assert_allclose(demonstration.actions, np.concatenate(apart), atol=1e-9)


@pytest.mark.parametrize("turn", [2 * np.pi, 360.0])
def test_a_crank_that_turns_through_half_a_turn_turns_at_its_speed(turn):
    angle = turn / (2 * np.pi) * ((1.0 + TIMES + np.pi) % (2 * np.pi) - np.pi)
    crank = recording(np.column_stack([angle, np.sin(TIMES)]), columns=("angle", "y"))
    recipe = uc.Recipe(("angle", "y"), differentiate="savgol", angles=("angle",))
    [demonstration] = quietly(crank, recipe)  # degrees are taken in radians
    np.testing.assert_allclose(demonstration.actions[:, 0], 1.0, atol=1e-9)
    assert "angle-wrap" in codes([crank], uc.Recipe(("angle", "y"), differentiate="savgol"))[0]


def test_orientations_are_continuous_where_their_numbers_turn():
    turned = Rotation.from_rotvec(np.outer(2.5 + 0.5 * TIMES, [0.6, 0, 0.8]))
    quaternions, vectors = turned.as_quat(canonical=True), turned.as_rotvec()
    names = ("a", "b", "c", "d")
    for columns, table, setting in (
        (names, quaternions, {"quaternions": names}),
        (names[:3], vectors, {"rotation_vectors": (names[:3],)}),
    ):
        plain = uc.Recipe(columns, differentiate="savgol")
        [[code]] = codes([recording(table, columns=columns)], plain)
        assert code == ("quaternion-flip" if len(columns) == 4 else "rotation-vector-flip")
        [demonstration] = prepare(
            recording(table, columns=columns), uc.Recipe(columns, differentiate="savgol", **setting)
        )
        assert np.abs(np.diff(demonstration.states, axis=0)).max() < 0.02
        rotation = Rotation.from_quat if len(columns) == 4 else Rotation.from_rotvec
        assert (rotation(demonstration.states).inv() * turned).magnitude().max() < 1e-9


def test_settings_that_cure_survive_json_and_are_checked():
    recipe = uc.Recipe(
        ("yaw", "a", "b", "c", "d"),
        differentiate="savgol",
        angles=("yaw",),
        quaternions=(("a", "b", "c", "d"),),
        rotation_vectors=(("a", "b", "c"),),
        glitches="repair",
        pauses="keep",
        sort=True,
    )
    assert uc.Recipe.from_dict(json.loads(json.dumps(recipe.to_dict()))) == recipe
    with pytest.raises(SettingError, match="quaternions: got a, b, expected 4 columns together"):
        uc.Recipe(quaternions=("a", "b"))
    with pytest.raises(SettingError, match="pauses: got 'skip', expected one of drop, keep, cut"):
        uc.Recipe(pauses="skip")
    with pytest.raises(SettingError, match="got 'yaw' as an angle, expected one of the states x, y; add it to them"):
        prepare(recording(), uc.Recipe(("x", "y"), differentiate="savgol", angles=("yaw",)))


def commanded(actions):
    """The track with actions beside it."""
    return recording(np.hstack([TRACK, actions]), columns=("x", "y", "ax", "ay"))


COMMANDED = uc.Recipe(("x", "y"), ("ax", "ay"))
TARGETS = commanded(np.concatenate([TRACK[1:], TRACK[-1:]]))
CHANGES = commanded(np.diff(TRACK, axis=0, append=TRACK[-1:]))


def test_targets_become_the_velocity_of_the_states():
    assert codes([TARGETS], COMMANDED) == [["targets-as-velocities"]]
    [demonstration] = prepare(TARGETS, replace(COMMANDED, action_is="target"))
    np.testing.assert_array_equal(demonstration.actions, prepare(recording(), MOVED)[0].actions)
    assert codes([TARGETS], replace(COMMANDED, action_is="velocity")) == [[]]


def test_differences_are_divided_by_the_interval():
    [demonstration] = prepare(CHANGES, replace(COMMANDED, action_is="delta"))
    np.testing.assert_allclose(demonstration.actions, CHANGES.values[:, 2:] / 0.02)


def test_states_to_come_are_seen_and_said_unless_they_are_said_to_be_velocities():
    with pytest.warns(
        PreparationWarning, match=r"'wipe', column 'ax': .* so the velocity .* action_is='velocity' forb"
    ):
        [seen] = prepare(TARGETS, COMMANDED)
    [told] = prepare(TARGETS, replace(COMMANDED, action_is="target"))
    np.testing.assert_array_equal(seen.actions, told.actions)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        [kept] = prepare(TARGETS, replace(COMMANDED, action_is="velocity"))
    np.testing.assert_array_equal(kept.actions, TARGETS.values[:, 2:])


@pytest.mark.parametrize(("factor", "told"), [(1e-3, True), (0.02, False), (1.0, False), (3.0, False), (60.0, True)])
def test_velocities_in_another_unit_are_said_and_all_stay_as_they_are(factor, told):
    speed = np.gradient(TRACK, 0.02, axis=0)  # 0.02 times it is the change to the next sample
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        [demonstration] = prepare(commanded(factor * speed), COMMANDED)
        prepare(commanded(factor * speed), replace(COMMANDED, action_is="velocity"))
    np.testing.assert_array_equal(demonstration.actions, factor * speed)
    assert [one.message.code for one in said] == ["not-velocities"] * told
    assert not told or f"all actions are {factor:g} times the change of the states" in str(said[0].message)


def swirls(way=lambda states, velocities: velocities, count=6):
    """Movements that turn as they come to rest, each from its place, with actions of some kind beside."""
    turn, every = np.array([[-1.0, -2.0, 0.0], [2.0, -1.0, 0.0], [0.0, 0.0, -0.5]]), []
    for number in range(count):
        at, rows = np.random.default_rng(number).uniform(0.1, 0.2, 3), []
        for _ in range(120):
            rows.append(at)
            at = at + 0.02 * turn @ at
        states = np.array(rows)
        table = np.hstack([states, way(states, states @ turn.T)])
        every.append(recording(table, 0.02 * np.arange(120), ("x", "y", "z", "vx", "vy", "vz")))
    return [replace(one, name=f"d{number}") for number, one in enumerate(every)]


@pytest.mark.parametrize(
    ("way", "told"),
    [
        (lambda _, v: 1000.0 * v, "all actions are 1000 times the change of the states in the same time: take the vel"),
        (lambda _, v: v * [1, 1, 57.2958], "'vz' is 57.3 times the change of 'z' in"),
        (lambda _, v: v * [1, 1, -1], "'vz' is -1 times the change of 'z' in"),
        (
            lambda _, v: v[:, [1, 0, 2]],
            "'vx' is the change of 'y', 'vy' is the change of 'x' in the same time: in the ",
        ),
        (lambda _, v: v + 0.01 * np.random.default_rng(0).standard_normal(v.shape), None),
        (lambda _, v: np.gradient(v, 0.02, axis=0), None),  # accelerations
        (lambda x, _: -4.0 * x, None),  # forces of a spring
        (lambda _, v: 5.0 * v, None),  # commands of some gain
        (lambda _, v: v * [1, 4, 0.2], None),
        (lambda _, v: v[:, [1, 0, 2]] * [-1, 1, 1], None),  # what pushes to the side
        (lambda x, v: 3.0 * v - 2.0 * x, None),
    ],
)
def test_actions_that_go_with_the_states_by_a_unit_an_order_or_a_sign_are_told_and_others_are_not(way, told):
    recordings = swirls(way)
    found = [[one for one in each.warnings if one.code == "not-velocities"] for each in survey_set(recordings)]
    assert [len(one) for one in found] == [told is not None] * 6
    assert told is None or told in found[0][0].message
    assert not any(codes(recordings, uc.Recipe(("x", "y", "z"), differentiate="savgol")))


@pytest.mark.parametrize(("factor", "told"), [(1.0, False), (1000.0, True)])
def test_columns_that_never_move_say_nothing_of_the_others(factor, told):
    recordings = swirls(lambda _, v: factor * v)
    flat = [replace(one, values=one.values * [1, 1, 0, 1, 1, 0] + [0, 0, 5, 0, 0, 0]) for one in recordings]
    assert all(("not-velocities" in each) == told for each in codes(flat))


def test_without_times_the_order_of_columns_is_told_and_no_unit():
    def timeless(factor, *order):
        return [replace(one, times=None) for one in swirls(lambda _, v: factor * v[:, order])]

    assert not any(codes(timeless(1000.0, 0, 1, 2)))
    [said] = survey_set(timeless(7.0, 1, 0, 2))[0].warnings
    assert "in the order of the states they are actions=('vy', 'vx', 'vz')" in said.message


@needs_data
def test_actions_beside_real_movements_are_what_they_are():
    for path in sorted((DATA / "lasa_handwriting").glob("*.mat"))[::3]:
        strokes = loadmat(path, simplify_cells=True)["demos"]
        for actions, factor in (("vel", 1.0), ("acc", 1.0), ("pos", 1.0), ("vel", 3.0), ("vel", 1000.0)):
            tables = [np.vstack([one["pos"], factor * one[actions]]).T for one in strokes]
            columns = ("x", "y", "ax", "ay")
            recordings = [
                uc.Recording(columns, table, np.asarray(one["t"], float), f"{number}")
                for number, (table, one) in enumerate(zip(tables, strokes, strict=True))
            ]
            said = {code for each in codes(recordings, uc.Recipe(("x", "y"), ("ax", "ay"))) for code in each}
            assert ("not-velocities" in said) == (factor == 1000.0), (path.stem, actions, factor)


def tenfold(recordings, which=2, factor=10.0):
    return [
        replace(one, values=one.values * factor) if number == which else one for number, one in enumerate(recordings)
    ]


def test_one_demonstration_that_is_ten_times_larger_than_each_other_is_in_another_unit():
    recordings = [replace(one, values=one.values[:, :3], columns=("x", "y", "z")) for one in swirls()]
    recipe = uc.Recipe(("x", "y", "z"), differentiate="savgol")
    for factor in (10.0, 0.1):
        found = survey_set(tenfold(recordings, factor=factor), recipe)
        [said] = [one.message for one in found[2].warnings if one.code == "unit-differs"]
        assert said.startswith(f"is 10 times {'larger' if factor > 1 else 'smaller'} than 'd0', 'd1', 'd3', 'd4' and 1")
        assert not any("unit-differs" in each for each in codes(tenfold(recordings, factor=factor**0.477), recipe))
    assert not any("unit-differs" in each for each in codes(tenfold(recordings[:4]), recipe))  # of so few it may be so


@needs_data
def test_no_real_movement_is_in_another_unit_than_others_of_its_kind():
    for recordings in list(of_one_kind())[::4]:
        recipe = uc.Recipe(recordings[0].columns, differentiate="savgol")
        assert not any("unit-differs" in each for each in codes(recordings, recipe)), recordings[0].name


def test_files_are_learnt_from_as_their_first_recording_shows(tmp_path):
    for number in range(3):
        moved = replace(TARGETS, name=f"d{number}", values=TARGETS.values + 1e-6 * number)
        uc.writers.write_recordings([moved], tmp_path / f"d{number}.csv")
    stream = uc.Stream(sorted(tmp_path.glob("*.csv")), COMMANDED)
    with pytest.warns(PreparationWarning) as said:
        [batch] = stream
    assert [one.message.code for one in said] == ["targets-as-velocities"]
    np.testing.assert_allclose(batch.actions[: len(TRACK)], prepare(recording(), MOVED)[0].actions, atol=1e-6)
    assert stream.recipe.action_is == "target"
    assert [part.recipe for part in stream.parts()] == [stream.recipe] * 3


def test_the_window_that_is_used_is_the_one_that_is_said():
    slow = recording(TRACK[::6], TIMES[::6])
    with pytest.warns(
        PreparationWarning, match=r"'wipe': the smoothing window of 0.25 s was widened to 0.6 s, the 5 sa"
    ):
        prepare(slow, MOVED)
    assert window_used(MOVED, slow) == pytest.approx(0.6)
    assert window_used(MOVED, recording()) == pytest.approx(0.26)


def test_actions_against_the_movement_and_stamps_that_count_down_are_backwards():
    velocity = np.gradient(TRACK, TIMES, axis=0)
    table = recording(np.hstack([TRACK[::-1], velocity[::-1]]), columns=("x", "y", "ax", "ay"))
    assert codes([table], uc.Recipe(("x", "y"), ("ax", "ay"))) == [["reversed"]]
    assert codes([recording(times=TIMES[::-1].copy())], MOVED) == [["reversed"]]


def test_rows_without_stamps_in_no_order_are_said():
    shuffled = np.random.default_rng(0).permutation(np.hstack([TRACK, TRACK]))
    table = recording(shuffled, None, ("x", "y", "vx", "vy"))
    assert codes([table]) == [["row-order"]]
    assert codes([recording(np.hstack([TRACK, TRACK[:, ::-1]]), None, ("x", "y", "vx", "vy"))]) == [[]]


@pytest.mark.parametrize("fault", faults.FAULTS[2:], ids=lambda fault: fault.__name__)
def test_every_line_names_what_cures_it(fault):
    recordings, recipe, code, which, _ = fault(np.random.default_rng(4))
    [message] = [one.message for one in survey_set(recordings, recipe)[which].warnings if one.code == code]
    assert "--" not in message
    assert "=" in message or "comparable units" in message or "record more" in message


@pytest.mark.parametrize("rows", [0, 1, 2, 9, 12])
def test_short_and_empty_recordings_are_looked_at_without_harm_and_called_too_short_to_differentiate(rows):
    assert codes([recording(TRACK[:rows], TIMES[:rows])], MOVED) == [["refused"]]
    assert survey(recording(np.full((rows, 2), np.nan), TIMES[:rows]), MOVED).samples == rows


@pytest.mark.parametrize("place", [0.0, 0.1, 0.3, 1e9 / 7])
def test_a_constant_column_is_noise_whatever_its_rounding(place):
    assert_array_equal(noise_share(np.full((200, 2), place)), 1.0)


def test_signals_of_nothing_are_nothing():
    flat = np.zeros((50, 3))
    assert glitches(flat) == seams(flat) == pauses(flat) == []
    assert topics(flat) is None
    assert is_noise(flat)


# --------------------------------------------------------------------------------------------------------- command line


@pytest.fixture
def wrapped(tmp_path):
    """Three recordings of a crank that turns through half a turn, and what the first warning is about."""
    for number in range(3):
        angle = (170 + 5 * number + 20 * TIMES + 180) % 360 - 180
        write(tmp_path / f"crank_{number}.csv", "t,x,yaw", np.column_stack([TIMES, np.sin(TIMES), angle]))
    return tmp_path


def test_inspect_fit_and_diagnose_say_the_same(wrapped):
    options = (wrapped / "crank_*.csv", "--state", "x,yaw", "--differentiate")
    shown = json.loads(run("inspect", *options, "--json"))["demonstrations"]
    [first] = [one for one in shown[0]["warnings"] if one["code"] == "angle-wrap"]
    assert set(first) == {"code", "message", "column", "row", "spans"}
    assert (first["column"], first["row"]) == ("yaw", 25)
    line = f"angle-wrap: 'crank_0', row 25 (line 27), column 'yaw': {first['message']}"
    assert line in run("inspect", *options).splitlines()
    assert f"Note: {line}" in call("fit", *options, "--model", "linear", "-o", wrapped / "p.npz").err.splitlines()
    assert f"Note: {line}" in call("diagnose", *options).err.splitlines()
    cured = json.loads(run("inspect", *options, "--angle", "yaw", "--json"))["demonstrations"]
    assert "angle-wrap" not in {one["code"] for found in cured for one in found["warnings"]}


@pytest.mark.parametrize("command", ["inspect", "fit", "diagnose"])
def test_strict_ends_with_2_and_writes_nothing(wrapped, command):
    output = ("-o", wrapped / "p.npz") if command == "fit" else ()
    options = ("--state", "x,yaw", "--differentiate", *output)
    ran = call(command, wrapped / "crank_*.csv", *options, "--strict")
    assert ran.code == 2
    assert "Error: --strict: not as it seems (angle-wrap" in ran.err
    assert not (wrapped / "p.npz").exists()
    ran = call(command, wrapped / "crank_*.csv", *options)
    assert ran.code == 0


def test_a_fit_that_explains_nothing_says_so(tmp_path):
    out_and_back = np.concatenate([TRACK, TRACK[::-1]])
    for number in range(4):
        track = out_and_back * (1 + 0.1 * number)
        write(tmp_path / f"{number}.csv", "t,x,y", np.column_stack([0.02 * np.arange(400), track]))
    ran = call("fit", tmp_path / "*.csv", "--model", "linear", "-o", tmp_path / "p.npz")
    assert ran.code == 0
    assert "Note: explains-nothing: misses " in ran.err
    assert "Note: The policy explains next to nothing" not in ran.err  # its verdict says so
    assert ran.out.startswith("✖ The policy ")


def apart(folder, which, size=1.0, clock=1.0):
    """Six strokes towards one place, some of them in another unit of length or of time."""
    times = np.linspace(0.0, 3.0, 150)
    for number, start in enumerate(np.random.default_rng(0).uniform(0.2, 0.4, (6, 2))):
        size_of, clock_of = (size, clock) if number in which else (1.0, 1.0)
        states = size_of * start * np.column_stack([np.exp(-times), np.exp(-times) * np.cos(times)])
        write(folder / f"s_{number}.csv", "t,x,y", np.column_stack([clock_of * times, states]))
    return folder / "*.csv", "--state", "x,y", "--differentiate"


@pytest.mark.parametrize("factor", [10.0, 57.3, 100.0, 1000.0])
def test_half_of_the_files_in_another_unit_leave_none_for_right(tmp_path, factor):
    files = apart(tmp_path, (0, 1, 4), factor)
    said = run("inspect", *files)
    assert "6 of 6 demonstrations not as it should be: unit differs" in said
    assert re.search(r"'s_0', 's_1', 's_4' are .+ times larger than 's_2', 's_3', 's_5', as in another unit", said)
    assert "--leave-out" not in said
    fitted = call("fit", *files, "--model", "affine", "--learner", "direct", "-o", tmp_path / "p.npz")
    assert fitted.out[0] in "!✖"
    assert "Recordings are not all in one unit" in " ".join(fitted.out.split())


def test_fewer_files_in_another_unit_are_named_beside_the_others(tmp_path):
    said = run("inspect", *apart(tmp_path, (2, 5), 0.1))
    assert "'s_2', column 'x': is " in said
    assert "times smaller than 's_0', 's_1', 's_3', 's_4', as in another unit" in said
    assert "the same of 's_5', 2 in all" in said
    assert "--leave-out s_2,s_5" in said


def test_a_file_in_milliseconds_among_others_is_named_and_no_unit_is_advised(tmp_path):
    files = apart(tmp_path, (3,), clock=1000.0)
    said = run("inspect", *files)
    assert "clock-differs: 's_3': 0.0497 samples a second, and others have 49.7" in said
    assert "--time-unit" not in said
    assert "--leave-out s_3" in said
    assert "if all are so, say the unit" in call("fit", *files, "-o", tmp_path / "p.npz").err
    said = run("inspect", *apart(tmp_path, range(6), clock=1000.0))
    assert "such as --time-unit ms" in said


def test_demonstrations_can_be_left_out_by_name(wrapped):
    options = (wrapped / "crank_*.csv", "--state", "x,yaw", "--differentiate", "--leave-out", "crank_1")
    found = json.loads(run("inspect", *options, "--json"))["demonstrations"]
    assert [one["name"] for one in found] == ["crank_0", "crank_2"]
    ran = call("fit", *options, "--model", "linear", "-o", wrapped / "p.npz")
    assert "2 demonstrations" in ran.out
    assert "Note: few-demonstrations: 2 demonstrations" in ran.err


# -------------------------------------------------------------------------------------------------------------- places


def at_places(track, apart=10.0):
    places = np.random.default_rng(2).normal(size=(5, 2))
    return [uc.Recording(("x", "y"), track + apart * place, TIMES, f"{i}") for i, place in enumerate(places)]


def noted(recordings, code="places"):
    found = [note.message for one in survey_set(recordings, MOVED) for note in one.notes if note.code == code]
    assert codes(recordings, MOVED) == [[]] * len(recordings)
    return found


def test_centring_is_suggested_where_demonstrations_are_at_different_places():
    [message] = noted(at_places(TRACK))
    assert "in different places, each farther from others than it is long" in message
    assert "take each from its own centre with centre=True" in message
    assert noted(at_places(TRACK, apart=0.5)) == []
    with pytest.warns(PreparationWarning, match="places: '0': .* with centre=True") as said:
        prepare(at_places(TRACK), MOVED)
    assert [one.message.code for one in said] == [""]


def test_a_mean_that_would_hide_a_constant_push_is_never_suggested_and_said():
    pushed = np.column_stack([2.0 * TIMES, np.sin(3 * TIMES)])
    [message] = noted(at_places(pushed, apart=40.0))
    assert "centre=True would hide a constant push" in message
    with pytest.warns(PreparationWarning, match="'wipe': is centred by the mean of a movement from end to end"):
        prepare(recording(pushed), replace(MOVED, centre=True))
    prepare(recording(), replace(MOVED, centre=True))


# -------------------------------------------------------------------------------------------- demonstrations as arrays


def given(states=lambda x: x, actions=lambda x: x):
    """Demonstrations as arrays: circles of several sizes, changed."""
    tracks = [(size * TRACK, size * np.gradient(TRACK, 0.02, axis=0)) for size in (1.0, 1.2, 1.5, 1.7)]
    return [uc.Demonstration(states(x), actions(u), TIMES) for x, u in tracks]


@pytest.mark.parametrize(
    ("demonstrations", "code"),
    [
        (given(), None),
        ([uc.Demonstration(one.states[:-1], one.states[1:]) for one in given()], "targets-as-velocities"),
        (given(actions=lambda u: -u), "reversed"),
        (given(actions=lambda u: 0 * u), "all-zero"),
        (given(lambda x: x * [1000, 1], lambda u: u * [1000, 1]), "mixed-units"),
        ([*given(), uc.Demonstration(1000 * TRACK, 1000 * TRACK[:, ::-1] * [-1, 1], TIMES)], "unit-differs"),
    ],
)
def test_demonstrations_that_are_given_are_looked_at_too(demonstrations, code):
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit_demonstrations(demonstrations)
    said = [note.partition(":")[0] for note in policy.solution_.notes]
    assert said == ([] if code is None else [code])


def test_a_scale_cures_mixed_units():
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(), scale=(1000, 1))
    mixed = given(lambda x: x * [1000, 1], lambda u: u * [1000, 1])
    assert policy.fit_demonstrations(mixed).solution_.notes == ()
    crank = uc.spaces.Euclidean() * uc.spaces.Circle()
    beside_angles = [uc.Demonstration(one.states, one.actions, one.times, space=crank) for one in mixed]
    [note] = policy.set_params(scale="auto").fit_demonstrations(beside_angles).solution_.notes
    assert note.startswith("mixed-units")  # which angles have no scale for


@pytest.mark.parametrize("size", [1e-300, 1e25])
def test_numbers_of_any_size_are_taken(size):
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid())
    assert policy.fit_demonstrations(given(actions=lambda u: size * u)).solution_.notes == ()
