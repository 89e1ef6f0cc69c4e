"""Simulated demonstrators in situations that are unlike those of the benchmark of regimes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

import unconstrain as uc

from ....base.arrays import Array
from ...systems.limit_cycle import LimitCycle
from ..truths import spread, with_noise

Policy = Callable[[Array], Array]


@dataclass(frozen=True)
class Simulated:
    """What one draw gives.

    Parameters
    ----------
    demonstrations : list of Demonstration
        To learn from.
    test : list of Demonstration, optional
        To be tested on; those to learn from if None.
    unspoiled : list of Demonstration, optional
        The same before something was done to it, where that is what is tested.
    """

    demonstrations: list[uc.Demonstration]
    test: list[uc.Demonstration] | None = None
    unspoiled: list[uc.Demonstration] | None = None


# ------------------------------------------------------------------------------------------------- who demonstrates


def wipe(states: Array) -> Array:
    """Circle about the z-axis at 3 rad/s and keep to a height: velocities (N, 3) at positions (N, 3)."""
    x, y, z = states.T
    inward = 1.2 * (1.0 / (np.hypot(x, y) + 1e-9) - 1.0)
    return np.column_stack([inward * x - 3.0 * y, inward * y + 3.0 * x, 0.5 * x - 1.2 * z - 0.2])


def wipe_round(states: Array) -> Array:
    """Circle of 80 mm about the z-axis at 2.5 rad/s, and to z = 0: velocities (N, 3) at positions (N, 3), mm."""
    x, y, z = states.T
    inward = 1.2 * (1.0 - (x**2 + y**2) / 80.0**2)
    return np.column_stack([inward * x - 2.5 * y, inward * y + 2.5 * x, -1.5 * z])


def come_to_rest(states: Array) -> Array:
    """A limit cycle in the plane, and a height that is kept: velocities (N, 3) at positions (N, 3)."""
    return np.column_stack([LimitCycle()(states[:, :2]), -2.0 * states[:, 2:]])


def reach(states: Array) -> Array:
    """To a goal in turns, slower and slower: velocities (N, 3) at positions (N, 3)."""
    x, y, z = states.T
    pull = states @ np.array([[-1.0, -0.6, 0.1], [0.8, -1.0, -0.4], [0.2, 0.5, -0.8]])
    return pull + 0.4 * np.column_stack([np.sin(2 * y), np.cos(2 * z) - 1.0, np.sin(2 * x)])


def swirl_in(states: Array) -> Array:
    """Round the origin and to it, at up to 0.2 m/s: velocities (N, 3) at positions (N, 3), m."""
    turned = np.cross([0.15, -0.1, 1.0], states)
    far = np.sqrt(np.vecdot(states, states) + 0.06**2)
    return (0.16 * turned - 0.1 * states * [1.0, 1.0, 1.4]) / far[:, None]


@dataclass(frozen=True, eq=False)
class Oval:
    """Round an oval at some rad/s, and onto it: velocities (N, 2) at positions (N, 2).

    Parameters
    ----------
    radii : ndarray, shape (2,)
    turn : float
    form : {"cubic", "round"}
        How it is driven onto the oval: as a polynomial, or ever faster towards the centre.
    """

    radii: Array
    turn: float
    form: str

    def __call__(self, states: Array) -> Array:
        """Velocities at some positions."""
        x, y = (states / self.radii).T
        size = np.hypot(x, y)
        inward = 1.0 - size**2 if self.form == "cubic" else 1.2 * (1.0 / (size + 1e-9) - 1.0)
        return self.radii * np.column_stack([inward * x - self.turn * y, inward * y + self.turn * x])


FOCUS = LimitCycle(rho=-0.5)
"""The stable focus of CaPL, github.com/joaomoura24/CaPL (gen_data_2d_notask)."""


# --------------------------------------------------------------------------------------------- what constrains them


@dataclass(frozen=True, eq=False)
class Turning:
    """A plane whose normal turns with the state: ``A = n + B x``.

    Parameters
    ----------
    normal : ndarray, shape (d,)
    turn : ndarray, shape (d, n)
    """

    normal: Array
    turn: Array

    def __call__(self, states: Array, times: Array) -> Array:
        """Return A, shape (T, 1, d)."""
        return (self.normal + states @ self.turn.T)[:, None, :]


@dataclass(frozen=True, eq=False)
class Wall:
    """A wall that is only pushed against from one side: no motion into it, from where it stands.

    Parameters
    ----------
    policy : callable
        Which the wall stops where it points into it.
    normal : ndarray, shape (d,)
        Unit vector into the wall.
    distance : float
        Of the wall from the origin.
    """

    policy: Policy
    normal: Array
    distance: float

    def __call__(self, states: Array, times: Array) -> Array:
        """Return A, shape (T, 1, d), zero where nothing holds."""
        pushed = (states @ self.normal >= self.distance) & (self.policy(states) @ self.normal > 0)
        return (pushed[:, None] * self.normal)[:, None, :]


def tilted(rng: np.random.Generator, count: int, degrees: float = 35.0) -> list[uc.constraints.Plane]:
    """Planes that are tilted by up to so much about each of two axes."""
    slopes = np.tan(np.radians(degrees)) * rng.uniform(-1, 1, (count, 2))
    return [uc.constraints.Plane(np.append(slope, 1.0)) for slope in slopes]


# ------------------------------------------------------------------------------------------------------ what is drawn


def curved_hood(rng: np.random.Generator) -> Simulated:
    """A hood that is wiped at sixteen places: the normal is a function of where the sponge is, and nothing is free.

    Its radii are 2.5 and 4 times that of the circle; states are relative to the place.
    """
    bends = np.diag([1 / 2.5, 1 / 4.0, 0.0])
    places = np.column_stack([rng.uniform(-1, 1, (16, 2)) * [2.5, 4.0], np.zeros(16)])
    surfaces = [Turning(bends @ place + [0, 0, 1], bends) for place in places]
    starts = np.column_stack([rng.uniform(-1.2, 1.2, (16, 2)), np.zeros(16)])
    return Simulated(with_noise(_rolled(wipe, starts, 40, 0.05, surfaces), 0.01, rng))


def capl(rng: np.random.Generator, decibels: float) -> Simulated:
    """CaPL's protocol without a task: one random line each, noise by the ratio to each trajectory's signal.

    Forty trajectories to learn from and ten to be tested on, two seconds at 50 Hz each.
    """
    angles, radii = 2 * np.pi * rng.random(50), rng.random(50)
    starts = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    turned = 2 * np.pi * rng.random(50)
    lines = [uc.constraints.Plane(np.array([np.cos(angle), np.sin(angle)])) for angle in turned]
    demos = _rolled(FOCUS, starts, 100, 0.02, lines)
    learnt = demos[:40]
    noise = [10 ** (-decibels / 20) * np.sqrt((demo.actions**2).mean()) for demo in learnt]
    return Simulated(
        [
            _moved(demo, size * rng.standard_normal(demo.actions.shape))
            for demo, size in zip(learnt, noise, strict=True)
        ],
        demos[40:],
    )


def wide_kernels(rng: np.random.Generator) -> Simulated:
    """CCL's policy demo: 500 samples anywhere, each with a line of its own, and 500 to be tested on."""
    states = rng.uniform(-1, 1, (1000, 2))
    policy = _ccl_cycle(states)
    normals = rng.random((1000, 2))
    N = uc.null_space_projection((normals / np.linalg.norm(normals, axis=1, keepdims=True))[:, None, :])
    every = uc.Demonstration(states, uc.project(N, policy), truth=uc.Truth(policy, N))
    return Simulated([every[:500]], [every[500:]])


def to_rest(rng: np.random.Generator) -> Simulated:
    """Twelve demonstrations on random planes through the state space that come to rest there; tested anywhere."""
    planes = [uc.constraints.Plane(rng.standard_normal(3)) for _ in range(12)]
    demos = _rolled(come_to_rest, rng.uniform(-1, 1, (12, 3)), 75, 0.04, planes)
    return Simulated(demos, [_free(come_to_rest, rng.uniform(-0.7, 0.7, (500, 3)))])


def one_bad_sample(rng: np.random.Generator, size: float, free: bool) -> Simulated:
    """Of 480 actions one is wrong, by so many standard deviations of the policy."""
    demos = with_noise(_wiped(rng, free=free), 0.02, rng)
    return Simulated(_spoiled(demos, 1, size, rng), unspoiled=demos)


def bad_samples(rng: np.random.Generator, size: float, free: bool) -> Simulated:
    """Of 480 actions five are wrong."""
    demos = with_noise(_wiped(rng, free=free), 0.02, rng)
    return Simulated(_spoiled(demos, 5, size, rng), unspoiled=demos)


def unequal_speeds(rng: np.random.Generator) -> Simulated:
    """Each demonstration is faster or slower by a factor of its own; its logarithm has a standard deviation of 0.4."""
    demos = with_noise(_wiped(rng), 0.02, rng)
    factors = np.exp(0.4 * rng.standard_normal(len(demos)))
    return Simulated([replace(demo, actions=f * demo.actions) for demo, f in zip(demos, factors, strict=True)])


def correlated_noise(rng: np.random.Generator) -> Simulated:
    """Noise of 5 % that is autoregressive, 0.9 from sample to sample."""
    from scipy.signal import lfilter

    demos = _wiped(rng)
    size = 0.05 * spread(demos) * np.sqrt(1 - 0.9**2)
    return Simulated(
        [_moved(one, lfilter([size], [1, -0.9], rng.standard_normal(one.actions.shape), axis=0)) for one in demos]
    )


def student_noise(rng: np.random.Generator) -> Simulated:
    """Noise of 5 % with the heavy tails of Student's distribution of three degrees of freedom."""
    demos = _wiped(rng)
    size = 0.05 * spread(demos) / np.sqrt(3.0)
    return Simulated([_moved(demo, size * rng.standard_t(3, demo.actions.shape)) for demo in demos])


def along_rulers(rng: np.random.Generator, form: str) -> Simulated:
    """Ten strokes along rulers across an oval that is driven round: each soon rests where its ruler takes all motion.

    At 50 Hz for 4 s, as velocities of positions recorded to 0.3 mm. Tested on ten further strokes where they move.
    """
    oval = Oval(
        rng.uniform(0.2, 0.4) * np.array([1.0, rng.uniform(0.5, 1.0)]), rng.choice([-1, 1]) * rng.uniform(1, 2), form
    )
    learnt, test = (_strokes(oval, 10, rng) for _ in range(2))
    speeds = [np.linalg.norm(demo.actions, axis=1) for demo in test]
    least = 0.1 * np.sqrt(np.mean(np.concatenate(speeds) ** 2))
    moving = [demo[speed > least] for demo, speed in zip(test, speeds, strict=True) if (speed > least).any()]
    return Simulated([_differentiated(demo, 3e-4 * rng.standard_normal(demo.states.shape)) for demo in learnt], moving)


def partly_at_rest(rng: np.random.Generator, share: float) -> Simulated:
    """Noise of so much, and demonstrators who hesitate: a third of the samples are at rest."""
    demos = []
    for demo in _wiped(rng):
        still = np.arange(len(demo)) % 30 < 10
        demos.append(replace(demo, actions=np.where(still[:, None], 0.0, demo.actions)))
    return Simulated(with_noise(demos, share, rng))


def one_sided(rng: np.random.Generator) -> Simulated:
    """A wall near the limit cycle stops what pushes into it, and nothing else; each demonstration has its own wall."""
    flow, angles = LimitCycle(), rng.uniform(0, 2 * np.pi, 12)
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    walls = [Wall(flow, normal, distance) for normal, distance in zip(normals, rng.uniform(0.1, 0.6, 12), strict=True)]
    starts = rng.uniform(-1, 1, (12, 2))
    beyond = np.maximum((starts * normals).sum(axis=1) - [wall.distance for wall in walls], 0)
    demos = _rolled(flow, starts - beyond[:, None] * normals, 60, 0.05, walls)
    return Simulated(with_noise(demos, 0.02, rng))


def one_plane(rng: np.random.Generator) -> Simulated:
    """A linear policy on horizontal planes at several heights: how it moves up and down is never seen."""
    flow = rng.standard_normal((3, 3)) / np.sqrt(3) - np.eye(3)
    plane = uc.constraints.Plane(np.array([0.0, 0.0, 1.0]))
    demos = _rolled(lambda states: states @ flow - 0.2, rng.uniform(-1.5, 1.5, (8, 3)), 60, 0.05, [plane] * 8)
    return Simulated(with_noise(demos, 0.02, rng))


def parallel_planes(rng: np.random.Generator) -> Simulated:
    """Planes that are tilted by five degrees at most."""
    return Simulated(with_noise(_wiped(rng, planes=tilted(rng, 8, 5.0)), 0.02, rng))


def tilted_plates(rng: np.random.Generator) -> Simulated:
    """Cycles of 80 mm on eight plates tilted by 5 to 30 degrees, as velocities of positions recorded to 0.05 mm."""
    normals = _tilted_by(rng, 5, 30, 8)
    starts = _onto(normals, np.column_stack([rng.uniform(-120, 120, (8, 2)), np.zeros(8)]))
    demos = _rolled(wipe_round, starts, 4000, 0.001, [uc.constraints.Plane(normal) for normal in normals])
    return Simulated([_differentiated(one[::10], 0.05 * rng.standard_normal(one[::10].states.shape)) for one in demos])


def measured_positions(rng: np.random.Generator, form: str) -> Simulated:
    """Velocities of positions as motion capture or a robot measures them.

    Five movements on an oval are free and five along rulers, or ten are on plates tilted by 10 to 40 degrees, at 100 Hz
    with an error of 0.8 mm that a filter went over; or eight go to one goal in as many planes, at 250 Hz to 0.02 mm.
    """
    if form == "rulers":
        oval = Oval(rng.uniform(0.1, 0.2) * np.array([1.0, rng.uniform(0.5, 1.0)]), 1.8, "cubic")
        free = _rolled(oval, rng.uniform(-1.3, 1.3, (5, 2)) * oval.radii, 2000, 0.002, None)
        return Simulated([_captured(one[::5], 8e-4, rng) for one in (*free, *_strokes(oval, 5, rng, 2))])
    if form == "plates":
        normals = _tilted_by(rng, 10, 40, 10)
        starts = _onto(normals, np.column_stack([rng.uniform(-120, 120, (10, 2)), np.zeros(10)]))
        demos = _rolled(wipe_round, starts, 2000, 0.002, [uc.constraints.Plane(normal) for normal in normals])
        return Simulated([_captured(one[::5], 0.8, rng) for one in demos])
    normals, angles, sizes = _tilted_by(rng, 10, 60, 8), rng.uniform(0, 2 * np.pi, 8), rng.uniform(0.12, 0.25, 8)
    around = np.column_stack([sizes * np.cos(angles), sizes * np.sin(angles), rng.uniform(-0.1, 0.1, 8)])
    planes = [uc.constraints.Plane(normal) for normal in normals]
    demos = _rolled(swirl_in, _onto(normals, around), 3000, 0.001, planes)
    return Simulated([_differentiated(one[::4], 2e-5 * rng.standard_normal(one[::4].states.shape)) for one in demos])


def reaching(rng: np.random.Generator, share: float) -> Simulated:
    """To a goal on eight tilted plates, with noise of so much of the actions' spread: more than motion at the end."""
    return Simulated(with_noise(_rolled(reach, rng.uniform(-1, 1, (8, 3)), 90, 0.03, tilted(rng, 8)), share, rng))


def turning_planes(rng: np.random.Generator) -> Simulated:
    """Normals that turn slowly with the state, each demonstration's about its own."""
    bends = rng.standard_normal((8, 3, 3)) * [[0.3], [0.3], [0.0]]
    planes = [Turning(plane.normal, bend) for plane, bend in zip(tilted(rng, 8), bends, strict=True)]
    return Simulated(with_noise(_wiped(rng, planes=planes), 0.02, rng))


def two_demonstrations(rng: np.random.Generator) -> Simulated:
    """There are two demonstrations only."""
    return Simulated(with_noise(_wiped(rng, planes=tilted(rng, 2)), 0.02, rng))


def many_joints(rng: np.random.Generator) -> Simulated:
    """Fourteen joints that pull at each other on their way to a posture; each demonstration holds four combinations."""
    pull = rng.standard_normal((14, 14)) / np.sqrt(14) - np.eye(14)
    held = [_Rows(rows) for rows in rng.standard_normal((24, 4, 14))]
    demos = _rolled(lambda states: states @ pull, rng.uniform(-1, 1, (24, 14)), 25, 0.08, held)
    return Simulated(with_noise(demos, 0.02, rng))


def without_order(rng: np.random.Generator) -> Simulated:
    """Demonstrations under lines that switch twice, as one heap of rows."""
    lines = [uc.constraints.SwitchingLine.random(rng, 0.8, 2) for _ in range(20)]
    demos = _rolled(LimitCycle(), rng.uniform(-1, 1, (20, 2)), 40, 0.02, lines)
    return Simulated([heap(with_noise(demos, 0.02, rng), rng)])


@dataclass(frozen=True, eq=False)
class _Rows:
    """Rows that are held wherever the state is."""

    rows: Array

    def __call__(self, states: Array, times: Array) -> Array:
        return np.broadcast_to(self.rows, (len(states), *self.rows.shape))


def heap(demonstrations: Sequence[uc.Demonstration], rng: np.random.Generator) -> uc.Demonstration:
    """All rows in any order, without times."""
    return shuffled(_joined(demonstrations), rng)


def shuffled(demo: uc.Demonstration, rng: np.random.Generator) -> uc.Demonstration:
    """The rows in any order, without times."""
    return replace(demo, times=None)[rng.permutation(len(demo))]


def _joined(demonstrations: Sequence[uc.Demonstration]) -> uc.Demonstration:
    states, actions, _ = uc.stack(demonstrations)
    truths = [demo.truth for demo in demonstrations if demo.truth is not None]
    policy, N = (np.concatenate([getattr(truth, field) for truth in truths]) for field in ("policy", "projections"))
    return uc.Demonstration(states, actions, truth=uc.Truth(policy, N))


def _ccl_cycle(states: Array) -> Array:
    """The limit cycle of CCL's demo."""
    pull = 0.75 - (states**2).sum(axis=1, keepdims=True)
    return -pull * states + np.column_stack([states[:, 1], -states[:, 0]])


def _wiped(
    rng: np.random.Generator, planes: Sequence[uc.constraints.Constraint] | None = None, free: bool = False
) -> list[uc.Demonstration]:
    """Eight demonstrations of sixty samples, or as many as there are planes, from starts on their planes."""
    held = tilted(rng, 8) if planes is None else planes
    starts = rng.uniform(-1.5, 1.5, (len(held), 3))
    if free:
        return _rolled(wipe, starts, 60, 0.05, None)
    return _rolled(wipe, starts, 60, 0.05, held)


def _rolled(
    policy: Policy,
    starts: Array,
    steps: int,
    dt: float,
    constraints: Sequence[uc.constraints.Constraint] | None,
) -> list[uc.Demonstration]:
    return uc.rollout(policy, starts, steps, dt, constraints, method="euler")


def _free(policy: Policy, states: Array) -> uc.Demonstration:
    actions = policy(states)
    return uc.Demonstration(
        states, actions, truth=uc.Truth(actions, np.tile(np.eye(actions.shape[1]), (len(states), 1, 1)))
    )


def _moved(demo: uc.Demonstration, by: Array) -> uc.Demonstration:
    return replace(demo, actions=demo.actions + by)


def _captured(demo: uc.Demonstration, error: float, rng: np.random.Generator) -> uc.Demonstration:
    """As motion capture delivers positions at 100 Hz: their errors filtered at 10 Hz, forward and backward."""
    from scipy.signal import butter, filtfilt

    errors = filtfilt(*butter(2, 10.0, fs=100.0), rng.standard_normal((len(demo) + 200, demo.states.shape[1])), axis=0)
    return _differentiated(demo, error * errors[100:-100] / errors.std())


def _tilted_by(rng: np.random.Generator, least: float, most: float, count: int) -> Array:
    """Normals (count, 3) of plates that are tilted by so many degrees, in any direction."""
    tilts, ways = np.radians(rng.uniform(least, most, count)), rng.uniform(0, 2 * np.pi, count)
    return np.column_stack([np.sin(tilts) * np.cos(ways), np.sin(tilts) * np.sin(ways), np.cos(tilts)])


def _onto(normals: Array, positions: Array) -> Array:
    """Positions (N, 3), each moved onto the plate through the origin with its normal."""
    return positions - normals * np.vecdot(normals, positions)[:, None]


def _differentiated(demo: uc.Demonstration, errors: Array) -> uc.Demonstration:
    """As it is recorded by its positions alone, with errors (T, n)."""
    recorded = demo.states + errors
    return replace(demo, states=recorded, actions=uc.preparation.differentiate(np.asarray(demo.times), recorded))


def _strokes(oval: Oval, count: int, rng: np.random.Generator, every: int = 4) -> list[uc.Demonstration]:
    """Four seconds along lines in any direction, from starts in and about an oval: so many 200ths of a second apart."""
    angles = rng.uniform(0, np.pi, count)
    rulers = [uc.constraints.Plane(np.array([np.sin(angle), np.cos(angle)])) for angle in angles]
    starts = rng.uniform(-1.3, 1.3, (count, 2)) * oval.radii
    return [demo[::every] for demo in _rolled(oval, starts, 800, 0.005, rulers)]


def _spoiled(
    demos: Sequence[uc.Demonstration], count: int, size: float, rng: np.random.Generator
) -> list[uc.Demonstration]:
    """Some actions with an error of so many times the policy's spread per coordinate."""
    lengths = [len(demo) for demo in demos]
    wrong = np.zeros((sum(lengths), demos[0].actions.shape[1]))
    rows = rng.permutation(len(wrong))[:count]
    wrong[rows] = size * spread(demos) * rng.standard_normal((count, wrong.shape[1]))
    return [_moved(demo, by) for demo, by in zip(demos, np.split(wrong, np.cumsum(lengths)[:-1]), strict=True)]
