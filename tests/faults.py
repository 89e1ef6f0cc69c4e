"""Data sets that are what they seem, and what can be wrong with one: faults put in, and where.

``python tests/faults.py 200`` (and a seed) prints how many of so many faults of each kind are found, at the right
row, and how many sets are said to have another fault than they have.
"""

import sys
from collections import Counter
from dataclasses import replace
from typing import NamedTuple

import numpy as np

import unconstrain as uc
from unconstrain.recordings.preparation import survey_set


class Fault(NamedTuple):
    """Recordings with a fault of some code in one of them, ``at`` its row where that can be told."""

    recordings: list
    recipe: uc.Recipe
    code: str | None
    which: int
    at: int | None


def cycle(x):
    """Velocities (K, n) that go round in the first two coordinates."""
    grow, turn = 0.5 - (x[:, :2] ** 2).sum(axis=1, keepdims=True), x[:, 1::-1] * [1.0, -1.0]
    return np.hstack([x[:, :2] * grow + turn, -2 * x[:, 2:]])


def goal(x):
    """Velocities (K, n) that end in one place."""
    return -1.5 * x + 0.3 * np.sin(2 * np.roll(x, 1, axis=1))


def movements(rng, count=None, dimensions=None):
    """States of some demonstrations of one policy, each in its own plane, in one unit, and their interval."""
    n = dimensions or int(rng.integers(2, 6))
    count = count or int(rng.integers(3, 9))
    steps, dt = int(rng.integers(80, 400)), float(rng.choice([0.005, 0.01, 0.02, 0.04]))
    policy, step = (cycle, goal)[rng.integers(2)], rng.uniform(1.5, 5.0)
    unit, noise = float(rng.choice([1.0, 1000.0, 0.1])), float(rng.choice([0, 1e-5, 1e-4, 5e-4]))
    place = rng.normal(size=n) * rng.integers(2)
    drawn = [
        (rng.normal(size=n), rng.uniform(-1, 1, n), place + noise * rng.standard_normal((steps, n)))
        for _ in range(count)
    ]
    normals, x, beside = map(np.stack, zip(*drawn, strict=True))
    normals *= (n > 2) / np.linalg.norm(normals, axis=1, keepdims=True)
    rows = np.empty((steps, count, n))
    for at in rows:  # all side by side
        at[:] = x
        velocity = policy(x)
        x = x + step / steps * (velocity - normals * (normals * velocity).sum(axis=1, keepdims=True))
    tables = list(unit * (rows.swapaxes(0, 1) + beside))
    return tables, dt


def like(size, tables):
    """Tables of one extent, such as goes with angles."""
    return [size * table / np.ptp(np.concatenate(tables), axis=0).max() for table in tables]


def recorded(tables, dt, actions=None):
    names = tuple(f"s{column}" for column in range(tables[0].shape[1]))
    moved = () if actions is None else tuple(f"a{column}" for column in range(actions[0].shape[1]))
    values = tables if actions is None else [np.hstack(pair) for pair in zip(tables, actions, strict=True)]
    recordings = [
        uc.Recording(names + moved, table, dt * np.arange(len(table)), f"d{number}")
        for number, table in enumerate(values)
    ]
    recipe = uc.Recipe(names, moved) if moved else uc.Recipe(names, differentiate="savgol")
    return recordings, recipe


def velocities(tables, dt):
    return [np.gradient(table, dt, axis=0) for table in tables]


def nothing(rng):
    return Fault(*recorded(*movements(rng)), None, 0, None)


def nothing_with_actions(rng):
    tables, dt = movements(rng)
    return Fault(*recorded(tables, dt, velocities(tables, dt)), None, 0, None)


def angle_wrap(rng):
    (tables, dt), turn = movements(rng), float(rng.choice([2 * np.pi, 360.0]))
    which, steps = int(rng.integers(len(tables))), len(tables[0])
    angles = [turn * 0.1 * np.sin(rng.uniform(1, 4) * np.linspace(0, 1, steps)) for _ in tables]
    angles[which] = turn * (
        rng.uniform(-0.4, 0.4) + rng.choice([-1, 1]) * rng.uniform(1, 2.5) * np.linspace(0, 1, steps)
    )
    wrapped = [(angle + turn / 2) % turn - turn / 2 for angle in angles]
    at = int(np.flatnonzero(np.abs(np.diff(wrapped[which])) > turn / 2)[0]) + 1
    tables = [np.column_stack(pair) for pair in zip(like(turn / 2, tables), wrapped, strict=True)]
    return Fault(*recorded(tables, dt), "angle-wrap", which, at)


def _turns(rng, steps):
    axis = rng.normal(size=3)
    return np.outer(
        np.sin(np.linspace(0, rng.uniform(2, 5), steps)) * rng.uniform(0.5, 1.2), axis / np.linalg.norm(axis)
    )


def quaternion_flip(rng):
    from scipy.spatial.transform import Rotation

    tables, dt = movements(rng)
    which, steps = int(rng.integers(len(tables))), len(tables[0])
    quaternions = [Rotation.from_rotvec(_turns(rng, steps)).as_quat(canonical=True) for _ in tables]
    at = int(rng.integers(3, steps - 3))
    quaternions[which][at:] *= -1
    tables = [np.hstack(pair) for pair in zip(like(2.0, tables), quaternions, strict=True)]
    return Fault(*recorded(tables, dt), "quaternion-flip", which, at)


def rotation_vector_flip(rng):
    from scipy.spatial.transform import Rotation

    tables, dt = movements(rng)
    which, steps, axis = int(rng.integers(len(tables))), len(tables[0]), rng.normal(size=3)
    vectors = [_turns(rng, steps) for _ in tables]
    angle = np.pi + rng.uniform(0.3, 1) * np.sin(np.linspace(-1.2, rng.uniform(1, 4), steps))
    vectors[which] = Rotation.from_rotvec(np.outer(angle, axis / np.linalg.norm(axis))).as_rotvec()
    at = int(np.flatnonzero(np.linalg.norm(np.diff(vectors[which], axis=0), axis=1) > np.pi)[0]) + 1
    tables = [np.hstack(pair) for pair in zip(like(3.0, tables), vectors, strict=True)]
    return Fault(*recorded(tables, dt), "rotation-vector-flip", which, at)


def seam(rng):
    tables, dt = movements(rng, count=6)
    return Fault(*recorded([np.concatenate(tables[:3]), *tables[3:]], dt), "seam", 0, len(tables[0]))


def glitch(rng):
    tables, dt = movements(rng)
    which, length = int(rng.integers(len(tables))), int(rng.choice([1, 1, 1, 2, 3]))
    table = tables[which]
    at = int(rng.integers(3, len(table) - 3 - length))
    columns = rng.permutation(table.shape[1])[: rng.integers(1, table.shape[1] + 1)]
    table[at : at + length, columns] += rng.choice([-1, 1]) * rng.uniform(0.3, 2) * np.ptp(table, axis=0)[columns]
    return Fault(*recorded(tables, dt), "glitch", which, at)


def clock_unit(rng):
    recordings, recipe = recorded(*movements(rng))
    unit = float(rng.choice([1e3, 1e6, 1e9]))
    return Fault([replace(one, times=one.times * unit) for one in recordings], recipe, "clock-unit", 0, None)


def clock_differs(rng):
    recordings, recipe = recorded(*movements(rng))
    which, unit = int(rng.integers(len(recordings))), float(rng.choice([1e3, 1e6, 1e9]))
    recordings[which] = replace(recordings[which], times=recordings[which].times * unit)
    return Fault(recordings, recipe, "clock-differs", which, None)


def clock_gap(rng):
    tables, dt = movements(rng)
    which, steps = int(rng.integers(len(tables))), len(tables[0])
    length = max(int(rng.uniform(0.1, 0.4) * steps), round(0.15 / dt))
    recordings, recipe = recorded(tables, dt)
    at = int(rng.integers(12, steps - 12))
    times = recordings[which].times + length * dt * (np.arange(steps) >= at)
    recordings[which] = replace(recordings[which], times=times)
    return Fault(recordings, recipe, "clock-gap", which, at)


def targets(rng):
    tables, dt = movements(rng)
    lag = int(rng.choice([1, 1, 2, 4]))
    ahead = [np.concatenate([table[lag:], np.repeat(table[-1:], lag, axis=0)]) for table in tables]
    return Fault(*recorded(tables, dt, ahead), "targets-as-velocities", 0, None)


def mixed_units(rng):
    tables, dt = movements(rng)
    unit = np.ones(tables[0].shape[1])
    unit[rng.integers(len(unit))] = rng.choice([1000.0, 200.0])
    extent = np.ptp(np.concatenate(tables), axis=0)
    return Fault(*recorded([table / extent * unit for table in tables], dt), "mixed-units", 0, None)


def unit_differs(rng):
    tables, dt = movements(rng, count=int(rng.integers(4, 9)))
    which = int(rng.integers(len(tables)))
    tables[which] = tables[which] * float(rng.choice([1000.0, 0.001]))
    return Fault(*recorded(tables, dt), "unit-differs", which, None)


def pause(rng):
    while True:  # until something moves on at the place
        tables, dt = movements(rng)
        which = int(rng.integers(len(tables)))
        table = tables[which]
        steps, speed = len(table), np.linalg.norm(np.diff(table, axis=0), axis=1)
        at = int(rng.integers(steps // 5, 4 * steps // 5))
        if speed[at : at + 3].min() > 0.4 * speed.max():
            break
    length = int(rng.uniform(0.3, 2.5) * steps) + 12
    still = table[at] + 1e-4 * np.ptp(table, axis=0).max() * rng.standard_normal((length, table.shape[1]))
    tables[which] = np.concatenate([table[:at], still, table[at:]])
    return Fault(*recorded(tables, dt), "pause", which, at)


def backwards(rng):
    tables, dt = movements(rng, count=int(rng.integers(8, 13)), dimensions=2)
    which = int(rng.integers(len(tables)))
    tables[which] = tables[which][::-1].copy()
    return Fault(*recorded(tables, dt), "reversed", which, None)


def at_rest(rng):
    tables, dt = movements(rng)
    which, extent = int(rng.integers(len(tables))), np.ptp(np.concatenate(tables), axis=0)
    shake = float(rng.choice([0, 1e-5, 1e-3])) * extent * rng.standard_normal(tables[which].shape)
    tables[which] = tables[which][len(tables[which]) // 2] + shake
    return Fault(*recorded(tables, dt), "at-rest", which, None)


def all_zero(rng):
    tables, dt = movements(rng)
    which, actions = int(rng.integers(len(tables))), velocities(tables, dt)
    actions[which] = 0 * actions[which]
    return Fault(*recorded(tables, dt, actions), "all-zero", which, None)


def few_demonstrations(rng):
    return Fault(*recorded(*movements(rng, count=int(rng.integers(1, 3)))), "few-demonstrations", 0, None)


def row_order(rng):
    recordings, recipe = recorded(*movements(rng))
    which, steps = int(rng.integers(len(recordings))), len(recordings[0])
    order, at = np.arange(steps), int(rng.integers(steps - 4))
    order[[at, at + 2]] = order[[at + 2, at]]
    order = rng.permutation(steps) if rng.integers(2) else order
    one = recordings[which]
    recordings[which] = replace(one, values=one.values[order], times=one.times[order])
    return Fault(recordings, recipe, "row-order", which, int(np.flatnonzero(np.diff(order) < 0)[0]) + 1)


def other_topic(rng):
    tables, dt = movements(rng)
    which = int(rng.integers(len(tables)))
    table = tables[which]
    other = table[::-1] + 3 * np.ptp(table, axis=0).max()
    at_other = rng.random(len(table)) < rng.choice([0.5, 0.2])
    at_other[0] = False
    tables[which] = np.where(at_other[:, None], other, table)
    return Fault(*recorded(tables, dt), "other-topic", which, int(np.argmax(at_other)))


def columns_differ(rng):
    """Strokes along one path, each a little beside it; of one, two columns are exchanged, or the sign of one turned."""
    n, count, t = int(rng.integers(2, 5)), int(rng.integers(5, 9)), np.linspace(0, 1, int(rng.integers(80, 300)))
    bends = np.vstack([rng.permutation(3.0 * np.arange(1, n + 1)), rng.normal(size=(3, n))])
    powers = np.vander(t, 4, increasing=True)
    tables = [powers @ (bends + 0.05 * rng.normal(size=bends.shape)) for _ in range(count)]
    which, (one, other) = int(rng.integers(count)), rng.permutation(n)[:2]
    if rng.integers(2):
        tables[which][:, [one, other]] = tables[which][:, [other, one]]
    else:
        tables[which][:, 0] *= -1.0
    return Fault(*recorded(tables, 0.01), "columns-differ", which, None)


def clock_untold(rng):
    recordings, recipe = recorded(*movements(rng))
    unit, rate = float(rng.choice([1.0, 1e3, 1e9])), 10.0 ** rng.uniform(0, 3)
    for number, one in enumerate(recordings):
        count = np.arange(len(one)) + 0.01 * rng.uniform(-1, 1, len(one))
        values = np.column_stack([unit / rate * count, one.values])
        recordings[number] = replace(one, columns=("column1", *one.columns), values=values, times=None)
    return Fault(recordings, recipe, "clock-untold", int(rng.integers(len(recordings))), None)


def stale(rng):
    tables, dt = movements(rng)
    which, every = int(rng.integers(len(tables))), float(rng.choice([2.0, 5.0, rng.uniform(3, 6)]))
    seen = np.floor(np.arange(len(tables[which])) / every) * every  # when the sensor last looked
    tables[which] = tables[which][np.ceil(seen).astype(int).clip(max=len(seen) - 1)]
    return Fault(*recorded(tables, dt), "stale", which, None)


def empty_cells(rng):
    recordings, recipe = recorded(*movements(rng))
    which = int(rng.integers(len(recordings)))
    steps, n = recordings[which].values.shape
    at = int(rng.integers(steps - 1))
    values = recordings[which].values.copy()
    values[at : at + int(rng.choice([1, 3])), rng.integers(n)] = np.nan
    recordings[which] = replace(recordings[which], values=values)
    return Fault(recordings, recipe, "empty-cells", which, at)


def missing(rng):
    recordings, recipe = recorded(*movements(rng))
    which = int(rng.integers(len(recordings)))
    times = recordings[which].times.copy()
    at = int(rng.integers(len(times) - 1))
    times[at : at + int(rng.choice([1, 3]))] = np.nan
    recordings[which] = replace(recordings[which], times=times)
    return Fault(recordings, recipe, "missing", which, at)


def refused(rng):
    recordings, recipe = recorded(*movements(rng))
    which = int(rng.integers(len(recordings)))
    one, rows = recordings[which], int(rng.integers(1, 5))
    recordings[which] = replace(one, values=one.values[:rows], times=one.times[:rows])
    return Fault(recordings, recipe, "refused", which, None)


def angle_unused(rng):
    tables, dt = movements(rng, dimensions=2)
    turned = [rng.uniform(-3, 3) + np.sin(rng.uniform(1, 4) * np.linspace(0, 1, len(table))) for table in tables]
    names = ("x", "y", str(rng.choice(["theta", "yaw_deg", "door_angle"])))
    recordings, _ = recorded([*map(np.column_stack, zip(tables, turned, strict=True))], dt)
    recordings = [replace(one, columns=names) for one in recordings]
    return Fault(recordings, uc.Recipe(), "angle-unused", int(rng.integers(len(recordings))), None)


def same_recording(rng):
    tables, dt = movements(rng)
    which = int(rng.integers(1, len(tables)))
    tables[which] = tables[int(rng.integers(which))].copy()
    return Fault(*recorded(tables, dt), "same-recording", which, None)


def not_velocities(rng):
    tables, dt = movements(rng, count=int(rng.integers(4, 9)))
    actions, n = velocities(tables, dt), tables[0].shape[1]
    way = int(rng.integers(3))
    order, factors = np.arange(n), np.ones(n)
    if way == 0:
        order[[0, 1]] = [1, 0]
    elif way == 1:
        factors *= rng.choice([1000.0, 100.0, 0.001, 180 / np.pi])
    else:
        factors[rng.integers(n)] = rng.choice([-1.0, 10.0, 0.01])
    return Fault(*recorded(tables, dt, [action[:, order] * factors for action in actions]), "not-velocities", 0, None)


FAULTS = (
    nothing, nothing_with_actions, angle_wrap, quaternion_flip, rotation_vector_flip, seam, glitch, clock_unit,
    clock_gap, targets, mixed_units, unit_differs, pause, backwards, at_rest, all_zero, few_demonstrations, row_order,
    other_topic, clock_differs, columns_differ, clock_untold, stale, empty_cells, missing, refused,
    angle_unused, same_recording, not_velocities,
)  # fmt: skip


class Tally(NamedTuple):
    """Of ``sets``: in how many the fault was found, at the right row, and in how many another one was."""

    sets: int
    found: int
    rows: int
    false: int
    others: Counter


def tally(fault, sets, seed=0):
    """Put a fault into so many sets and count what is said of them."""
    found = rows = false = 0
    others = Counter()
    for number in range(sets):
        recordings, recipe, code, which, at = fault(np.random.default_rng([seed, number, FAULTS.index(fault)]))
        surveys = survey_set(recordings, recipe)
        said = {remark.code: remark for remark in surveys[which].warnings}
        found += code in said
        rows += code in said and at in (None, said[code].row)
        wrong = {remark.code for one in surveys for remark in one.warnings} - {code}
        false += bool(wrong)
        others.update(wrong)
    return Tally(sets, found, rows, false, others)


if __name__ == "__main__":
    asked, seed = (*map(int, sys.argv[1:]), *(200, 0)[len(sys.argv) - 1 :])
    for fault in FAULTS:
        done = tally(fault, asked, seed)
        print(
            f"{fault.__name__:<24}{done.found:>5} found {done.rows:>5} rows {done.false:>5} false",
            dict(done.others),
            flush=True,
        )
