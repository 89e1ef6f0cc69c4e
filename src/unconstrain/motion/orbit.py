"""A cycle that attracts: on every plane that cuts it, at the pace that was shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import Array
from ..base.display import Shown, counted
from ..models import Correction
from ..recordings import Demonstration, stack
from ..risks import project
from .potential import TOLD, Potential, spread_over

PULL = 0.25
"""The cycle attracts at least at this share of the turning rate, rad/s."""

RUSH = 4.0
"""And at most at this."""

MIDDLE = 0.2
"""Where V is as level as nearer to the middle than this share of the radius, motion is slower in proportion."""

STRAY = 0.1
"""The speed along the cycle is that of B, learnt from the demonstrations, to within this share."""

AROUND, TIMED = 64, 12
"""Places on the cycle at which its pace is measured, and how often it is then set to the demonstrated one."""

WELL_SHOWN = 0.15
"""Of the turning, what demonstrations say at least at this share of what they say best."""

ROUND = 1e-3
"""Weight of a sphere beside the demonstrated states, where these say nothing of the shape."""

LEAVES = 0.03
"""The surface is one that the policy leaves by this share of its speed as readily as states scatter about it."""

TIMELY = 0.02
"""A pace within this share of the demonstrated one is left: corrections on simulated bouts are a quarter less."""

_TINY = 1e-150

_DIRECTIONS = 24
"""Of the slopes that the shape is made of, for each dimension."""


@dataclass(frozen=True, eq=False, repr=False)
class Orbit(Shown):
    """The closed convex surface ``V(x) = ½ r²``, and the way round on it.

    A plane through its inside cuts it in one closed convex curve. With ``g = N ∇V`` and the distance
    ``e ≈ (V − ½ r²) / ‖g‖``, the speed along g is kept between −PULL and −RUSH times ω e, so that the surface attracts
    under every constraint, and from both sides. What is left of a velocity is along the surface. Its part along the
    demonstrated way round, ``t = N B (x − x*)`` less what is along g, is kept within STRAY of ‖t‖.

    Parameters
    ----------
    potential : Potential
        V, in squared units of the state, about the middle x* of the cycle.
    radius : float
        Its r.
    turn : ndarray, shape (n, n)
        B, 1/s.
    rate : float
        ω, rad/s.
    whole : float
        Share of the demonstrations it was drawn from that go all the way round.

    Examples
    --------
    >>> bowl = uc.motion.Potential(np.zeros(2), np.vstack([np.eye(2), -np.eye(2)]), np.zeros(4), np.ones(4))
    >>> orbit = uc.motion.orbit.Orbit(bowl, radius=1.0, turn=np.array([[0.0, -1.0], [1.0, 0.0]]), rate=1.0)
    >>> orbit.guided(np.array([[1.0, 0.0]]), np.zeros((1, 2)))  # on the cycle, where the policy rests
    array([[0. , 0.9]])
    """

    potential: Potential
    radius: float
    turn: Array
    rate: float
    whole: float = 1.0

    @property
    def promise(self) -> str:
        """What is added, when that is right, and what is guaranteed, in words."""
        middle, off = ", ".join(f"{each:.4g}" for each in self.potential.goal), 1 / (1 - STRAY) - 1
        return (
            "Where the policy does not lead to the cycle, and round it, a velocity is added that does. Right where "
            "every movement is to go round; ways from new starts are not learnt. A closed surface without dents that "
            f"the cycle lies on, fitted to the demonstrations and typically {self.radius:.4g} off its middle "
            f"({middle}), attracts from every state but that middle, free and under any flat constraint that it is "
            f"told of ({TOLD}): the distance from it shrinks at rates of {PULL * self.rate:.4g} to "
            f"{RUSH * self.rate:.4g} per second. A plane through its inside cuts it in one cycle. Where the plane lets "
            f"it turn, a round takes the time learnt of that plane, within {off:.0%}: on those of demonstrations about "
            f"as long as theirs did, on average. With steps of up to {self.dt:.3g} s, to which twice any delay "
            "counts, the cycle is wider by a few per cent of its size, with longer ones by more. A constraint that "
            "moves or is not told, or an obstacle, may lead off it."
        )

    def correction(self) -> Correction:
        """The same as numbers, for where there is no Python."""
        table, rate = self.potential, self.rate
        numbers = {"level": self.radius**2, "middle": MIDDLE, "rate": rate, "slow": PULL * rate, "fast": RUSH * rate}
        numbers |= {"least": 1.0 - STRAY, "most": 1.0 + STRAY}
        parts = table.goal, table.directions, table.offsets, table.weights
        return Correction("orbit", *parts, numbers, self.turn, self.promise)

    def spare(self, states: Array, velocities: Array, slope: Array) -> Array:
        """By how much the surface attracts more than it has to where ``N ∇V`` (N, n) is so, as a share of that."""
        height = self.potential(states)
        off, steep = height - 0.5 * self.radius**2, np.linalg.norm(slope, axis=1)
        share = np.minimum(1.0, steep / self._width(height))
        least = share**2 * PULL * self.rate * off**2
        nearer = -off * np.vecdot(slope, velocities)
        return (nearer - least) / np.maximum(np.abs(nearer) + least, np.finfo(float).tiny)

    def guided(self, states: Array, wanted: Array, projections: Array | None = None) -> Array:
        """Velocities (N, n) for those that are wanted, both in the null space of projections N (N, n, n)."""
        (height, slope), round_ = self.potential.both(states), (states - self.potential.goal) @ self.turn.T
        if projections is not None:
            slope, round_ = project(projections, slope), project(projections, round_)
        steep, tiny = np.linalg.norm(slope, axis=1), np.finfo(float).tiny
        outward = slope / np.maximum(steep, tiny)[:, None]
        width = self._width(height)
        off = (height - 0.5 * self.radius**2) / np.maximum(steep, width)
        speed = np.vecdot(outward, wanted)
        bounds = np.sort([-PULL * self.rate * off, -RUSH * self.rate * off], axis=0)
        along = wanted - speed[:, None] * outward
        round_ = round_ - np.vecdot(outward, round_)[:, None] * outward
        pace = np.linalg.norm(round_, axis=1)
        way = round_ / np.maximum(pace, self.rate * width)[:, None]
        now = np.vecdot(way, along)
        kept = np.clip(now, (1.0 - STRAY) * pace, (1.0 + STRAY) * pace) - now
        moved = along + kept[:, None] * way + np.clip(speed, *bounds)[:, None] * outward
        return np.minimum(1.0, steep / width)[:, None] * moved

    def turning(self, policy: Callable[[Array], Array], plane: Array) -> float:
        """Turns of a policy guided round the cycle on a plane (2, n) through the middle, rad/s in their mean."""
        angle = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
        ways = np.column_stack([np.cos(angle), np.sin(angle)]) @ plane
        size = self.radius / np.sqrt(2.0 * self.potential(self.potential.goal + ways))  # V grows as a square
        states = self.potential.goal + size[:, None] * ways
        held = np.broadcast_to(plane.T @ plane, (AROUND, *self.turn.shape))
        flat = self.guided(states, project(held, np.asarray(policy(states))), held) @ plane.T
        rates = (flat[:, 1] * np.cos(angle) - flat[:, 0] * np.sin(angle)) / size
        return float(1.0 / np.abs(1.0 / rates).mean()) if rates.all() else 0.0

    def _width(self, height: Array) -> Array:
        """Where V is so high (N,) and ``‖N ∇V‖`` is less, V is nearly level, and motion slower in proportion, (N,)."""
        return MIDDLE * np.sqrt(np.maximum(2.0 * height, self.radius**2))

    @property
    def dt(self) -> float:
        """Euler steps of this length widen the cycle by two hundredths, seconds; a delay does as twice such a step."""
        return 0.04 * PULL / self.rate

    def single(self) -> Callable[[ArrayLike, Array], None]:
        """The same for one state (n,) and its velocity (n,), which is changed in place."""
        rows, floor, sums = self._rows()
        n, maximum = len(self.turn), np.maximum
        slow, fast, level, rim = PULL * self.rate, RUSH * self.rate, self.radius**2, MIDDLE * self.radius
        rate, least, most = self.rate, 1.0 - STRAY, 1.0 + STRAY

        def guide(x: ArrayLike, wanted: Array) -> None:
            # Of few numbers Python's sums take less time than NumPy's, and comparisons less than calls of min and max.
            v, seen = wanted.tolist(), maximum(rows.dot(x), floor).dot(sums).tolist()
            around, slope = seen[n : 2 * n], seen[2 * n :]
            gz = gw = gv = wv = gg = ww = 0.0
            for z, w, g, u in zip(seen, around, slope, v):  # noqa: B905
                gz, gw, gv = gz + g * z, gw + g * w, gv + g * u
                wv, gg, ww = wv + w * u, gg + g * g, ww + w * w
            steep, width = sqrt(gg) or _TINY, MIDDLE * sqrt(gz) if gz > level else rim  # ∇Vᵀ z = 2 V
            off, speed, across = 0.5 * (gz - level) / (steep if steep > width else width), gv / steep, gw / steep  # noqa: FURB136
            low, high = (-fast * off, -slow * off) if off > 0.0 else (-slow * off, -fast * off)
            radial = low if speed < low else high if speed > high else speed  # noqa: FURB136
            pace = sqrt(abs(ww - across * across))
            longest = pace if pace > rate * width else rate * width  # noqa: FURB136
            now = (wv - across * speed) / longest
            kept = (least * pace if now < least * pace else most * pace if now > most * pace else now) - now  # noqa: FURB136
            way = kept / longest
            out, share = (radial - speed - way * across) / steep, steep / width if steep < width else 1.0
            wanted[:] = [share * (a + way * b + out * c) for a, b, c in zip(v, around, slope)]  # noqa: B905

        return guide

    def _rows(self) -> tuple[Array, Array, Array]:
        """Of x all that is added up, what each is at least, and the sums: z, B z and ∇V."""
        table, n = self.potential, len(self.turn)
        rows = np.concatenate([np.eye(n), table.directions, np.zeros((1, n))])
        floor = np.concatenate([np.full(n, -np.inf), table.directions @ table.goal, [1.0]])
        sums = np.zeros((len(rows), 3 * n))
        sums[:n, : 2 * n] = np.hstack([np.eye(n), self.turn.T])
        sums[n:-1, 2 * n :] = table.weights[:, None] * table.directions
        sums[-1] = -np.concatenate([table.goal, floor[n:-1]]) @ sums[:-1]
        return rows, floor, sums

    def _summary(self) -> tuple[str, ...]:
        return counted(len(self.turn), "state"), f"radius={self.radius:.4g}", f"rate={self.rate:.4g}"


def turns(demos: Sequence[Demonstration]) -> Array:
    """How often each of K demonstrations goes round the middle of all states, seen along their least axis, (K,)."""
    states = stack(demos).states
    middle = states.mean(axis=0)
    axes = np.linalg.svd(states - middle, full_matrices=False)[2][:2]
    if len(axes) < 2:
        return np.zeros(len(demos))
    plane = [(demo.states - middle) @ axes.T @ np.array([1.0, 1j]) for demo in demos]
    return np.array([np.angle(z[1:] * z[:-1].conj()).sum() for z in plane]) / (2.0 * np.pi)


def encircled(demos: Sequence[Demonstration], policy: Callable[[Array], Array]) -> Orbit:
    """The orbit that demonstrated states are about, and the policy is nearly on; guided it goes round at their pace."""
    states, velocities, _ = stack(demos)
    middle = states.mean(axis=0)
    z = states - middle
    radius = float(np.sqrt((z**2).sum(axis=1).mean()))
    axes = np.stack([np.eye(len(middle)), -np.eye(len(middle))])
    directions = spread_over(np.concatenate([z, -z, *(radius * axes)]), _DIRECTIONS)
    weights = _level(np.maximum(z @ directions.T, 0.0) / radius, np.asarray(policy(states)), directions)
    used = weights > 0.0
    potential = Potential(middle, directions[used], np.zeros(int(used.sum())), weights[used])
    turned = [_round(potential, demo) for demo in demos]
    turn = _turning(turned, np.linalg.lstsq(z, velocities, rcond=1e-6)[0].T, lambda z: np.asarray(policy(z + middle)))
    orbit = Orbit(potential, radius, turn, float(np.sqrt((velocities**2).sum(axis=1).mean())) / radius)
    for _ in range(TIMED):
        paces = [orbit.turning(policy, plane) for plane, *_ in turned]
        shown = [float(np.vecdot(phases, velocities).mean()) for *_, phases, velocities in turned]
        faster = sum(shown) / sum(paces) if all(paces) else 1.0
        orbit = replace(orbit, turn=faster / np.clip(faster, 1.0 - TIMELY, 1.0 + TIMELY) * orbit.turn)
    return orbit


def _turning(turned: Sequence[tuple[Array, ...]], plain: Array, policy: Callable[[Array], Array]) -> Array:
    """B (n, n) of which the part along the cycle is that of the policy, or half or twice that of the demonstrations.

    Least squares of whole velocities are too slow: what is across the cycle, and what a plane takes away, counts as
    well. So their part along it is fitted, and of B the plain one is left where that says little.
    """
    _, z, tangents, _, velocities = map(np.concatenate, zip(*turned, strict=True))
    rows = (tangents[:, :, None] * z[:, None, :]).reshape(len(z), -1)
    shown = np.vecdot(tangents, velocities)
    left = np.clip(np.vecdot(tangents, policy(z)), *np.sort([0.5 * shown, 2.0 * shown], axis=0)) - rows @ plain.ravel()
    return plain + np.linalg.lstsq(rows, left, rcond=WELL_SHOWN)[0].reshape(plain.shape)


def _round(potential: Potential, demo: Demonstration) -> tuple[Array, ...]:
    """Of one demonstration: its plane (2, n), z, unit vectors along the cycle, slopes of the phase, velocities (T, n).

    Of one that goes round, the last whole turns, so that no part of the cycle counts more.
    """
    z, tiny = demo.states - potential.goal, np.finfo(float).tiny
    plane = np.linalg.svd(z, full_matrices=False)[2][:2]
    flat, slope = z @ plane.T @ [1.0, 1j], potential.gradient(demo.states) @ plane.T @ [1.0, 1j]
    angle = np.unwrap(np.angle(flat))
    back = np.abs(angle - angle[-1]) / (2.0 * np.pi)
    last = back <= (np.floor(back[0]) or np.inf)
    way = np.sign(angle[-1] - angle[0])
    along, phase = (
        way * 1j * each
        for each in (slope / np.maximum(np.abs(slope), tiny), flat / np.maximum(np.abs(flat) ** 2, tiny))
    )
    return (
        plane,
        z[last],
        *(np.column_stack([each.real, each.imag])[last] @ plane for each in (along, phase)),
        demo.actions[last],
    )


def _level(beyond: Array, wanted: Array, directions: Array) -> Array:
    """Weights (K,) at least zero of the surface that states are about, and on which what is wanted (N, n) stays.

    ``beyond`` (N, K) is how far states are along the directions, in radii.
    """
    from scipy.optimize import nnls

    (count, slopes), squares, scatter = beyond.shape, beyond**2, 0.0
    leaving = beyond * (wanted @ directions.T) / (np.sqrt((wanted**2).sum(axis=1).mean()) or 1.0)
    prior, sphere = ROUND * count / slopes, 1.0 / float(squares.sum(axis=1).mean())
    for _ in range(2):  # how they scatter is known from the first
        falls = scatter / LEAVES * leaving
        root = np.linalg.cholesky(squares.T @ squares + falls.T @ falls + prior * np.eye(slopes))
        weights = nnls(root.T, np.linalg.solve(root, squares.sum(axis=0) + prior * sphere))[0]
        weights /= float(np.sqrt(squares @ weights).mean()) ** 2  # least squares alone are for less where sums vary
        scatter = float((squares @ weights).std())
    return weights
