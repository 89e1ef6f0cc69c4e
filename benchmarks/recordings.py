"""What recordings cost and what is seen in them: time, memory, cases read, false alarms, units, pauses, turns.

``--cases FOLDER`` reads a folder of small files by :data:`CASES`; ``--megabytes 1000`` streams more text. Real
recordings are looked for in the folder named by ``UNCONSTRAIN_DATA``. Injected faults: ``python tests/faults.py 200``.
"""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import NamedTuple

import numpy as np
from click.testing import CliRunner
from scipy.spatial.transform import Rotation
from table import Row, row, script, spent

import unconstrain as uc
from unconstrain.base.arrays import Array
from unconstrain.cli import main as command

INSPECT = ("-m", "unconstrain", "inspect")
SAMPLES, MEGABYTES, SEEDS = 1_000_000, 100, range(1, 6)
QUATERNION = ("qw", "qx", "qy", "qz")


class Case(NamedTuple):
    """How a file is to be read: demonstrations, samples of the first, its states, and what is said at which row.

    Without states it is to ask for them.
    """

    file: str
    demonstrations: int
    samples: int
    states: str
    options: str = ""
    code: str | None = None
    row: int | None = None


CASES = (
    Case("bagpy_odom.csv", 1, 150, "pose.position.x, pose.position.y, pose.position.z"),
    Case("blank_line_demos.csv", 2, 150, "x, y, z"),
    Case("bom.csv", 1, 300, "X, Y, Z"),
    Case("compressed.csv.gz", 1, 150, "x, y, z"),
    Case("custom_keys.npz", 1, 3000, "q1, q2, q3"),
    Case("d4rl_like.hdf5", 3, 200, "observations1, observations2, observations3"),
    Case("decimal_comma.csv", 1, 150, "x, y, z"),
    Case("euler_wrap.csv", 1, 150, "x, y, yaw (an angle)", "--angle yaw"),
    Case("euler_wrap.csv", 1, 150, "x, y, yaw", "--state x,y,yaw --differentiate", "angle-wrap", 24),
    Case("first_stamp_zero.csv", 1, 302, "X, Y, Z"),
    Case("folder_of_csv", 1, 300, "X, Y, Z"),
    Case("iso_time.csv", 1, 150, "x, y, z"),
    Case("lasa_like.mat", 2, 100, "pos1, pos2"),
    Case("lerobot_v3", 2, 100, "observation.state1, observation.state2", "", "targets-as-velocities"),
    Case("list_cells.csv", 1, 150, "position1, position2, position3"),
    Case("millis_timestamp.csv", 1, 150, "x, y, z", "", "clock-unit"),
    Case("millis_timestamp.csv", 1, 150, "x, y, z", "--time-unit ms"),
    Case("minari_like.hdf5", 3, 199, "observations1, observations2, observations3"),
    Case("mm_and_deg.csv", 1, 300, "x, y, z"),
    Case("mm_and_deg.csv", 1, 300, "x, y, z, yaw", "--state x,y,z,yaw --differentiate", "mixed-units"),
    Case("motive.csv", 1, 150, ", ".join(f"Rigid Body.Hand.1.Position.{axis}" for axis in "XYZ")),
    Case("nan_cells.csv", 1, 150, "x, y, z"),
    Case("plain.npy", 1, 3000, "x, y, z", "--columns x,y,z"),
    Case("pose_names.csv", 1, 300, "pose_x, pose_y, pose_z"),
    Case("qtm.tsv", 1, 150, "hand X, hand Y, hand Z"),
    Case("recording.json", 1, 5, "pos.1, pos.2"),
    Case("robomimic_like.hdf5", 3, 200, "robot0_eef_pos1, robot0_eef_pos2, robot0_eef_pos3"),
    Case("robosuite_raw.hdf5", 3, 120, ""),
    Case("ros2_echo_csv_no_header.csv", 1, 150, "x, y, z", "--columns sec,nanosec,frame,x,y,z"),
    Case("rostopic_pose.csv", 1, 150, ", ".join(f"field.pose.position.{axis}" for axis in "xyz")),
    Case("secs_nsecs.csv", 1, 150, "x, y, z"),
    Case("slow_rate.csv", 1, 60, "x, y, z"),
    Case("space_header.csv", 1, 150, "actual_TCP_pose_0, actual_TCP_pose_1, actual_TCP_pose_2"),
    Case("space_no_header.txt", 1, 150, "x, y, z", "--columns t,x,y,z"),
    Case("standing_still.csv", 1, 1000, "x, y, z", "", "at-rest"),
    Case("targets_as_actions.csv", 1, 149, "q1, q2, q3"),
    Case(
        *("targets_as_actions.csv", 1, 149, "q1, q2, q3", "--action target1..target3", "targets-as-velocities"),
    ),
    Case("time_restarts.csv", 2, 150, "x, y, z"),
    Case("units_row.csv", 1, 150, "x, y, z"),
    Case("whole_seconds.csv", 1, 3000, "x, y, z"),
)
"""Files and what is right of each; one that is to be warned of stands a second time with what cures it."""

REFUSED = ("object.npz", "workbook.xlsx")


# ------------------------------------------------------------------------------------------------ small files


def read_rightly(folder: Path) -> list[Row]:
    """Files read rightly with no option, and with one; those warned of; controls of which nothing is said."""
    right, free, warned, asked, alarms = set[str](), set[str](), 0, 0, 0
    for case in CASES:
        fits, codes = _look(folder, case)
        right |= {case.file} if fits else set()
        free |= {case.file} if fits and not case.options else set()
        asked += case.code is not None
        warned += (case.code, case.row) in codes
        alarms += case.code is None and bool({code for code, _ in codes} - {"few-demonstrations"})
    right |= {name for name in REFUSED if _run("inspect", folder / name).exit_code == 2}
    every = {case.file for case in CASES} | set(REFUSED)
    more = {"more_is_better": True}
    return [
        row(
            f"cases read or refused rightly with at most one option, of {len(every)}",
            len(right),
            "",
            len(every),
            **more,
        ),
        row("of them read rightly with none", 100 * len(free) / (len(every) - len(REFUSED)), "%", 0, 80, **more),
        row(f"faulty cases warned of with code and row, of {asked}", warned, "", asked, **more),
        row(f"false alarms on the {len(CASES) - asked} others", alarms, "", 0),
    ]


def _look(folder: Path, case: Case) -> tuple[bool, set[tuple[str, int | None]]]:
    """Whether a file is read rightly, and what is said of it with the row."""
    options = (folder / case.file, *case.options.split())
    text, found = _run("inspect", *options), _run("inspect", *options, "--json")
    if found.exit_code:
        return False, set()
    surveys = json.loads(found.stdout)
    counts = len(surveys) == case.demonstrations and surveys[0]["samples"] == case.samples
    said = {(one["code"], one["row"]) for survey in surveys for one in survey["warnings"]}
    sentence = f"fit uses {case.states} as states" if case.states else "fit needs to know more"
    return counts and sentence in text.stdout, said


def _run(*arguments: object):
    return CliRunner().invoke(command, [str(one) for one in arguments], prog_name="unconstrain")


# ----------------------------------------------------------------------------------------------------- real recordings


def alarms(data: Path) -> list[Row]:
    """Share of real recordings of which anything is said."""
    return [_false(name, sets) for name, sets in _real(data).items() if data.is_dir()]


def _false(name: str, sets: Iterator[tuple[list[uc.Recording], uc.Recipe]]) -> Row:
    said = [
        {remark.code for remark in survey.warnings} - {"few-demonstrations"}
        for recordings, recipe in sets
        for survey in uc.preparation.survey_set(recordings, recipe)
    ]
    return row(f"false alarms on {len(said)} recordings, {name}", 100 * np.mean([bool(one) for one in said]), "%", 2, 0)


def _real(data: Path) -> dict[str, Iterator[tuple[list[uc.Recording], uc.Recipe]]]:
    pose = tuple(f"read_tf.outport_pose.{axis}" for axis in range(3))
    moves = uc.Recipe(pose, differentiate="savgol")
    strokes = sorted((data / "lasa_handwriting").glob("*.mat"))
    return {
        "lasa_handwriting": ((uc.read(path), uc.Recipe()) for path in strokes),
        "kuleuven_contour": ((uc.read(data / "kuleuven_contour" / "data_demo_*.dat"), moves) for _ in range(1)),
        "lasa_rim_wiping": ((uc.read(data / "lasa_rim_wiping" / "demo_*.csv"), uc.Recipe()) for _ in range(1)),
        "libras_hand": _hands(data / "libras_hand" / "movement_libras.csv"),
    }


def _hands(path: Path) -> Iterator[tuple[list[uc.Recording], uc.Recipe]]:
    for number, track in enumerate(np.loadtxt(path, delimiter=",")[:, :90]):
        one = uc.Recording(("x", "y"), track.reshape(45, 2), 7.0 / 45 * np.arange(45), f"{number}")
        yield [one], uc.Recipe(("x", "y"), differentiate="savgol")


# ------------------------------------------------------------------------------------------------- turns, units, pauses


def turns() -> list[Row]:
    """Largest errors of predicted speed of a crank through ±π, and of a body whose quaternion turns its sign."""
    rng, times = np.random.default_rng(1), np.arange(0.0, 4.0, 0.02)
    cranks = [
        uc.Recording(("crank",), ((start + times + np.pi) % (2 * np.pi) - np.pi)[:, None], times, f"{number}")
        for number, start in enumerate(rng.uniform(-np.pi, np.pi, 6))
    ]
    crank = _learnt(cranks, uc.Recipe(("crank",), differentiate="savgol", angles=("crank",)))
    speeds = crank.predict(np.linspace(-10.0, 10.0, 1001)[:, None])
    turn = np.array([0.3, -0.5, 0.8])
    bodies = [_body(start, turn, times, rng) for start in Rotation.random(8, random_state=1)]
    body = _learnt(bodies, uc.Recipe(QUATERNION, differentiate="savgol", quaternions=(QUATERNION,)))
    everywhere = np.vstack([one.values for one in bodies])
    missed = np.linalg.norm(body.predict(everywhere) - turn, axis=1).max() / np.linalg.norm(turn)
    return [
        row(
            "crank through ±π at 1 rad/s: largest error of predicted speed", 100 * np.abs(speeds - 1).max(), "%", 1, 0.1
        ),
        row("quaternion through its sign: largest error of angular velocity", 100 * missed, "%", 1, 0.1),
    ]


def _learnt(recordings: list[uc.Recording], recipe: uc.Recipe) -> uc.Policy:
    return uc.LocallyLinearPolicy(None).fit_demonstrations(uc.prepare(recordings, recipe))


def _body(start: Rotation, turn: Array, times: Array, rng: np.random.Generator) -> uc.Recording:
    orientations = (start * Rotation.from_rotvec(times[:, None] * turn)).as_quat()[:, [3, 0, 1, 2]]
    signs = rng.choice([-1.0, 1.0], (len(times), 1))
    return uc.Recording(QUATERNION, signs * orientations, times)


def wanted(states: Array) -> Array:
    """A policy in two coordinates, metres, and an angle, radians, shape (N, 3)."""
    pull = np.array([[-1.0, 0.6, 0.0], [-0.6, -1.0, 0.2], [0.3, 0.0, -0.8]])
    return states @ pull.T + 0.5 * np.sin(2 * np.roll(states, 1, axis=1))


def paths(seed: int, steps: int = 150, dt: float = 0.02) -> list[uc.Demonstration]:
    """Twelve movements of that policy, each behind one orthogonal constraint."""
    rng, made = np.random.default_rng(seed), []
    for number in range(12):
        x, normal, states, actions = rng.uniform(-0.5, 0.5, 3), rng.normal(size=3), [], []
        normal /= np.linalg.norm(normal)
        for _ in range(steps):
            action = wanted(x[None])[0]
            states.append(x)
            actions.append(action - normal * (normal @ action))
            x = x + dt * actions[-1]
        made.append(uc.Demonstration(states, actions, dt * np.arange(steps), name=f"{number}"))
    return made


def units() -> list[Row]:
    """Errors of the angle's action, positions in millimetres and the scale found, against equal units."""
    scale, ratios = np.array([1000.0, 1000.0, 1.0]), []
    for seed in SEEDS:
        equal = paths(seed)
        unlike = [uc.Demonstration(one.states * scale, one.actions * scale, one.times) for one in equal]
        states = uc.stack(equal).states
        true = wanted(states)[:, 2]
        errors = [
            np.sqrt(((policy.predict(states * unit)[:, 2] - true) ** 2).mean())
            for policy, unit in (
                (uc.LocallyLinearPolicy(None).fit_demonstrations(equal), 1.0),
                (uc.LocallyLinearPolicy(None, scale="auto").fit_demonstrations(unlike), scale),
            )
        ]
        ratios.append(errors[1] / errors[0])
    what = "mm beside rad, scale auto: error of the angle's action against equal units, worst of 5 seeds"
    return [row(what, round(max(ratios), 3), "×", 1.1, 1.0)]


def pauses() -> list[Row]:
    """Normalised error of a policy learnt from positions of which 70 % are pauses, against none."""
    ratios = []
    for seed in SEEDS:
        rng, made = np.random.default_rng([seed, 1]), paths(seed)
        errors = []
        for share in (0.0, 0.7):
            recordings = [_paused(one, share, rng) for one in made]
            recipe = uc.Recipe(("x", "y", "turn"), differentiate="savgol")
            states = uc.stack(made).states
            missed = _learnt(recordings, recipe).predict(states) - wanted(states)
            errors.append((missed**2).sum())
        ratios.append(errors[1] / errors[0])
    what = "70 % pauses: nUPE against none, mean of 5 seeds"
    return [row(what, float(np.mean(ratios)), "×", 1.3, 1.05)]


def _paused(one: uc.Demonstration, share: float, rng: np.random.Generator) -> uc.Recording:
    """Positions with one pause in the middle, and noise of a ten-thousandth of their extent."""
    rows = len(one)
    at, still = int(rng.integers(rows // 4, rows // 2)), round(rows * share / (1.0 - share))
    states = np.concatenate([one.states[:at], np.repeat(one.states[at : at + 1], still, axis=0), one.states[at:]])
    noisy = states + 1e-4 * np.ptp(one.states, axis=0).max() * rng.standard_normal(states.shape)
    return uc.Recording(("x", "y", "turn"), noisy, 0.02 * np.arange(len(states)), one.name)


# ---------------------------------------------------------------------------------------------------------- large files


def large(folder: Path, rows: int) -> list[Row]:
    """Seconds and peak memory of ``inspect``."""
    lines = []
    for columns in (4, 8):
        made = {"CSV": folder / f"{columns}.csv", "LeRobot": folder / f"lerobot{columns}"}
        uc.writers.write_recordings([_swinging(rows, columns)], made["CSV"])
        episodes = [_swinging(2000, columns) for _ in range(rows // 2000)]
        uc.writers.write_recordings(episodes, made["LeRobot"], tuple(f"s{at}" for at in range(columns)), ())
        for kind, path in made.items():
            state = "s*" if kind == "CSV" else "observation.state"
            asked = [*INSPECT, path, "--state", state, "--differentiate"]
            lines += spent(f"inspect, {rows:.0e} rows × {columns} columns of {kind}", asked, 20, 5)
            lines[-1]["at_least"] = 300
    wide = folder / "wide.csv"
    uc.writers.write_recordings([_swinging(50, 8000)], wide)
    return [*lines, *spent("inspect, 50 rows × 8000 columns of CSV", [*INSPECT, wide], 1)]


def _swinging(rows: int, columns: int) -> uc.Recording:
    times = 0.02 * np.arange(rows)
    values = np.round(np.sin(times[:, None] * np.linspace(0.3, 1.0, columns)), 6)
    return uc.Recording(tuple(f"s{at}" for at in range(columns)), values, times, "swinging")


def streamed(folder: Path, megabytes: int) -> list[Row]:
    """Megabytes of CSV a second, by blocks; and by pyarrow alone, on one thread."""
    from pyarrow import csv

    block = folder / "block.csv"
    uc.writers.write_recordings([_swinging(50_000, 8)], block)
    head, _, body = block.read_bytes().partition(b"\n")
    path = folder / "long.csv"
    with path.open("wb") as file:
        file.write(head + b"\n")
        while file.tell() < megabytes * 1e6:
            file.write(body)
    size = path.stat().st_size / 1e6
    start = process_time()
    samples = sum(len(one) for one in uc.readers.read_blocks(path))
    ours = size / (process_time() - start)
    start = process_time()
    reader = csv.open_csv(path, csv.ReadOptions(use_threads=False, block_size=2**21))
    assert sum(batch.num_rows for batch in reader) == samples
    theirs = size / (process_time() - start)
    what = f"{size:.0f} MB of CSV, streamed, a second of a processor"
    return [row(what, ours, "MB/s", 60, theirs, more_is_better=True), row("the same by pyarrow alone", theirs, "MB/s")]


def main(cases: str | None = None, samples: int = SAMPLES, megabytes: int = MEGABYTES) -> list[Row]:
    """Rows of all."""
    warnings.simplefilter("ignore", UserWarning)
    lines = [] if cases is None else read_rightly(Path(cases))
    if data := os.environ.get("UNCONSTRAIN_DATA"):
        lines += alarms(Path(data))
    lines += [*turns(), *units(), *pauses()]
    with TemporaryDirectory(dir=Path.cwd()) as folder:
        return [*lines, *large(Path(folder), samples), *streamed(Path(folder), megabytes)]


if __name__ == "__main__":
    script(main, cases=(str, None), samples=(lambda text: int(float(text)), SAMPLES), megabytes=(int, MEGABYTES))
