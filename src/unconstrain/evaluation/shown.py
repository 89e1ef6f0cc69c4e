"""What recordings show by themselves, beside a verdict: planes that they keep to, and where they come to rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..base.arrays import Array
from ..base.display import listed
from ..constraints import kept
from ..learners import robust
from ..recordings import Demonstration, Recipe, readers, stack
from .marks import ENOUGH, Mark, Verdict

FLAT, ONE, UNLIKE = 0.1, 0.03, 100.0
"""Held are directions of less spread than the first share of the longest, and all on one plane below the second; not
in one unit are demonstrations that are larger than others by the third factor."""

WITHIN, TIGHT = 3.0, 0.003
"""Who keeps to a plane moves across it, and is off it, by no more than so many times the noise, or than the second
share of the extent: of 16 recordings of known truth those that were held were off by up to 1.7 times the noise, and
three of four free ones by 4.6 to 9.3 times."""

SLOW, LONG, MOSTLY = 0.2, 0.1, 0.9
"""Slower than the first share of a usual speed is rest, for more than the second share of the samples a long one, of
which the third is slow: at its end noise of positions has the largest velocities."""

BESIDE, PASSING = 0.05, 0.5
"""Others that come nearer than the first share of the extents, faster than the second of a usual speed, move on there;
near a goal all are slow. They end there within the first share, and elsewhere beyond twice that."""


def flat(states: Array, share: float = FLAT) -> tuple[Array, Array]:
    """Directions, in rows, along which states (T, n) hardly spread, zero where they do (n, n), and most (2, n)."""
    _, spread, axes = np.linalg.svd(states - states.mean(axis=0), full_matrices=False)
    beyond = states.shape[1] - len(axes)
    spread, axes = np.pad(spread, (0, beyond)), np.pad(axes, ((0, beyond), (0, 0)))
    return axes * (spread < share * spread[0])[:, None], axes[:2]


def planes_of(demonstrations: Sequence[Demonstration]) -> Array:
    """Normals (K, 3) of the planes that demonstrations in space keep to: one, if it or parallel ones are all.

    There are none where some keep to no plane or to a line, or in another unit, or planes differ as their places do.
    """
    whole, states = np.vstack([one.states for one in demonstrations]), [one.states for one in demonstrations]
    sizes = [size for one in states if (size := float(np.ptp(one, axis=0).max()))] or [0.0]
    if (whole.shape[1], demonstrations[0].actions.shape[1]) != (3, 3) or max(sizes) > UNLIKE * min(sizes):
        return whole[:0]
    centred, each = np.vstack([one - one.mean(axis=0) for one in states]), np.array([flat(one)[0] for one in states])
    common, together = flat(centred, ONE)[0], whole.var(axis=0).sum() < 2.0 * centred.var(axis=0).sum()
    if common[2].any() and not common[1].any():
        return common[2:]
    own = all(held[2].any() and _on_it(one, held) for one, held in zip(states, each, strict=True))
    return each[:, 2] if together and own and not each[:, 1].any() else whole[:0]


def crossed(demonstrations: Sequence[Demonstration], noise: float) -> list[str]:
    """Whether each demonstration in space keeps to a plane ("flat") or "line" that others leave, as if held, else "".

    They keep to it if they are off it by no more than the noise of the positions, and move across it by no more than
    ``noise``, a standard deviation of each action, times :data:`WITHIN`. Those that wind about what is "round" may
    have wanted to.
    """
    states, actions, groups = stack(list(demonstrations))
    found = [""] * len(demonstrations)
    for index in range(len(found) if (states.shape[1], actions.shape[1]) == (3, 3) else 0):
        own, others, places = actions[groups == index], actions[groups != index], states[groups == index]
        held = flat(places)[0]
        across = ((others @ held.T) ** 2).sum() > FLAT**2 * (others**2).sum()
        if across and held[2].any() and _largest(own @ held.T) <= WITHIN * noise and _on_it(places, held):
            found[index] = "line" if held[1].any() else "flat"
        elif not held[2].any() and kept(places, wound=True) is not None:
            found[index] = "round"
    return found


def _on_it(places: Array, held: Array) -> bool:
    """Whether positions (T, n) leave no direction that was held (n, n) by more than their noise, or hardly."""
    noise = float(np.sqrt(robust.noise_by_differences(places, np.zeros(len(places), dtype=np.intp))))
    most = max(WITHIN * noise if np.isfinite(noise) else 0.0, TIGHT * float(np.linalg.norm(np.ptp(places, axis=0))))
    return _largest((places - places.mean(axis=0)) @ held.T) <= most


def _largest(values: Array) -> float:
    """Root mean square of the column in which it is largest."""
    return float(np.sqrt((values**2).mean(axis=0)).max())


def about_recordings(
    found: Verdict, demos: Sequence[Demonstration], recipe: Recipe, policy: Callable[[Array], Array] | None = None
) -> Verdict:
    """Add which planes demonstrations keep to, what they turn about and, unless rest is trimmed, where a policy rests.

    Of a rest that is the policy's own nothing is said, nor of any without a policy.
    """
    planes, states, trust, doubt = planes_of(demos), recipe.states or (), found.trust, found.doubt
    if len(planes) == 1:
        doubt = f"All demonstrations lie on one plane or parallel ones, of normal {named(planes[0], states)}: none "
        doubt += f"tells what is across it; others at other tilts would. {found.doubt}"
    elif len(planes):
        apart = np.degrees(np.arccos(min(float(np.abs(planes @ planes.T).min()), 1.0)))
        trust = f"{trust} Each demonstration lies on a plane of its own, up to {apart:.0f}° from the others.".strip()
    if (pivot := robust.pivot_of(*stack(demos)[:2])) is not None:
        about = f"All motion is about {named(pivot.tolist(), states)}, as of a door about its hinge: none tells what "
        doubt = f"{about}points there; free motion, or motion about another place, would. {doubt}"
    found = found._replace(trust=trust, doubt=doubt.rstrip())
    return found if recipe.still or policy is None else _about_rest(found, demos, states, policy)


def _about_rest(
    found: Verdict, demos: Sequence[Demonstration], states: Sequence[str], policy: Callable[[Array], Array]
) -> Verdict:
    """Say where a policy rests as something stopped a demonstration there, or that this cannot be told.

    What the policy moves on from did no harm, and a goal, to which :data:`ENOUGH` come or all that rest, is its own.
    """
    speeds = [np.linalg.norm(one.actions, axis=1) for one in demos]
    slow = float(f"{SLOW * np.quantile(np.concatenate(speeds), 0.9):.2g}")
    rests, names = _rests(demos, speeds, slow), names_of(demos)
    goal = any(not by and together >= min(ENOUGH, max(len(rests), 2)) for _, by, together in rests)
    ends = [float(np.median(speed[-1 - int(LONG * len(speed)) :])) for speed in speeds]
    goes = {row: float(np.linalg.norm(policy(demos[row].states[-1:]))) for row, *_ in rests}
    kept = [(row, by) for row, by, _ in rests if goes[row] < slow > 2.0 * min(goes[row], ends[row])]
    harm = goal or 2 * len(rests) > len(demos) or any((speed >= slow).mean() < LONG for speed in speeds)
    for row in [row for row, by in kept if by][:1]:
        place = named(demos[row].states[-1], states)
        said = f"The policy rests near {place}, where '{names[row]}' came to rest and others move on: likely something "
        found = found._replace(doubt=f"{said}stopped it. {found.doubt}".rstrip())
        return (
            found if harm else found._replace(next=f"--still {slow} leaves out rest at an end. {found.next}".rstrip())
        )
    if found.mark is Mark.GOOD or goal or not kept:
        return found
    few = listed([f"'{names[row]}'" for row, _ in kept], 4)
    said = f"{few} ended slower than {SLOW:.0%} of a usual speed where no other moves on: whether something stopped "
    said += (
        f"{'them' if kept[1:] else 'it'} cannot be told{'' if harm else f'; if so, --still {slow} leaves that out'}."
    )
    return found._replace(doubt=f"{said} {found.doubt}".rstrip())


def _rests(
    demonstrations: Sequence[Demonstration], speeds: Sequence[Array], slow: float
) -> list[tuple[int, bool, int]]:
    """Which end in a long rest; whether others move by there and end elsewhere, and how many rest there together."""
    wide = np.maximum(np.ptp(np.vstack([one.states for one in demonstrations]), axis=0), 1e-300)
    ends = np.array([one.states[-1] for one in demonstrations]) / wide
    tails = [np.cumsum(speed[::-1] <= slow) / np.arange(1, len(speed) + 1) >= MOSTLY for speed in speeds]
    rows = [int(np.flatnonzero(tail).max(initial=-1)) + 1 for tail in tails]
    rest = [row for row, speed in enumerate(speeds) if rows[row] > LONG * len(speed)]
    found = []
    for row in rest:
        far = np.linalg.norm(ends - ends[row], axis=1)
        left = [i for i in range(len(ends)) if far[i] > 2.0 * BESIDE]
        fast = [demonstrations[i].states[speeds[i] > PASSING / SLOW * slow] / wide for i in left]
        by = any((np.linalg.norm(some - ends[row], axis=1) < BESIDE).any() for some in fast)
        found.append((row, by, int((far[rest] < BESIDE).sum())))
    return found


def names_of(demos: Sequence[Demonstration]) -> tuple[str, ...]:
    """Names of demonstrations, each another."""
    return readers.unique_names([demo.name or f"demonstration {index + 1}" for index, demo in enumerate(demos)])


def named(values: Sequence[float], names: Sequence[str]) -> str:
    """Such as ``(x = 0.1, y = -2)``."""
    return "(" + ", ".join(f"{name} = {value:.3g}" for name, value in zip(names, values, strict=True)) + ")"
