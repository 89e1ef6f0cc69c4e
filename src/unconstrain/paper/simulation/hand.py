"""Demonstrations in the physics engine: a hand wipes a plate, a camera watches the sponge."""

from __future__ import annotations

import numpy as np

import unconstrain as uc

from ...base.arrays import Array
from ..systems.wiping import Plate, Strokes, WipingPolicy, observed, slow_noise
from .engine import engine
from .scene import TIME_STEP, Scene, hand_scene

FOLLOWING = 200.0
"""How hard the hand follows what it wants, N per m/s."""

PRESS = 45.0
"""How hard it presses on what it feels under the sponge, N."""

SETTLING_S = 0.2
"""The hand rests on the plate for so long before it starts to wipe."""


def demonstrate(
    plate: Plate, rng: np.random.Generator, policy: WipingPolicy | None = None, strokes: Strokes | None = None
) -> uc.Demonstration:
    """Wipe a plate in a few strokes, and be watched doing it; needs the extra ``sim``.

    The hand moves freely in three directions. It is pushed towards the
    policy's velocity, and pressed onto what it feels; that it can only slide
    along the plate is the work of the contact. Friction and inertia make its
    movement a little different from the policy's projection, as they do for a
    person.

    Parameters
    ----------
    plate, rng, policy, strokes
        As in :func:`unconstrain.paper.systems.wiping.demonstrate`.

    Returns
    -------
    Demonstration
        Positions relative to the plate's centre and velocities estimated from
        them, with the policy and the plate's projection at those positions.
    """
    wipe, how = policy or WipingPolicy(), strokes or Strokes()
    return observed(plate, wipe, record(plate, rng, wipe, how), how)


def record(plate: Plate, rng: np.random.Generator, wipe: WipingPolicy, how: Strokes) -> list[uc.Recording]:
    """What the camera sees of each stroke: positions relative to the plate's centre, m."""
    scene = hand_scene(plate)
    return [_stroke(scene, wipe, how, rng) for _ in range(how.count)]


def _stroke(scene: Scene, wipe: WipingPolicy, how: Strokes, rng: np.random.Generator) -> uc.Recording:
    """Put the sponge down somewhere and wipe: what the camera sees."""
    mujoco = engine()
    model, data, normal = scene.model, scene.data, scene.plate.rotation[:, 2]
    every = round(1.0 / (how.rate * TIME_STEP))
    settling = round(SETTLING_S / TIME_STEP)
    drift = how.unsteadiness * slow_noise(rng, how.samples * every, TIME_STEP)
    mujoco.mj_resetData(model, data)
    data.qpos[:3] = how.put_down(scene.plate, wipe, rng) - _face_at_rest(scene)
    seen = np.empty((how.samples, 3))
    for step in range(-settling, how.samples * every):
        mujoco.mj_step1(model, data)
        at, moving = scene.face, data.qvel[:3]
        if step >= 0 and step % every == 0:
            seen[step // every] = at
        wanted = wipe(at[None])[0] + drift[step] if step >= 0 else np.zeros(3)
        data.qfrc_applied[:3] = -PRESS * normal + FOLLOWING * (wanted - moving)
        mujoco.mj_step2(model, data)
    return how.watched(seen, scene.plate.name, rng)


def _face_at_rest(scene: Scene) -> Array:
    engine().mj_forward(scene.model, scene.data)
    return scene.face.copy()
