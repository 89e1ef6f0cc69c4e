"""
Round what is in the way
========================

Nobody demonstrated an obstacle, and none is learnt: a roll-out turns velocities away from it, inside of what a
constraint leaves. So it goes round on a plane, too, that it must not leave.
"""

# %%
# Past two stones and a wall
# --------------------------

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc
from unconstrain.motion.obstacles import Ellipsoid, Wall

GREEN = "#009e73"


def wave(x):
    """To the right, up and down."""
    return np.column_stack([np.ones(len(x)), 0.6 * np.sin(2.0 * x[:, 0])])


stones = [Ellipsoid([1.2, 0.35], [0.3, 0.5]), Ellipsoid([2.9, -0.45], 0.4)]
wall = Wall([0.0, -1.0], [0.0, 1.0], reach=0.3)
starts = np.column_stack([np.zeros(15), np.linspace(-0.9, 1.4, 15)])

figure, axes = plt.subplots(figsize=(8, 4.2), layout="constrained")
for run in uc.rollout(wave, starts, 260, 0.02, obstacles=[*stones, wall]):
    axes.plot(*run.states.T, color=GREEN, linewidth=1)
angles = np.linspace(0.0, 2.0 * np.pi, 100)
for stone in stones:
    around = stone.centre + stone.radii * np.column_stack([np.cos(angles), np.sin(angles)])
    axes.fill(*around.T, color="0.75")
axes.axhspan(-1.3, -1.0, color="0.75")
axes.set(aspect="equal", xlim=(0, 4.4), ylim=(-1.3, 2.0), xlabel="x (m)", ylabel="y (m)")
axes.set_title("Fifteen movements around two stones and along a wall")
plt.show()

# %%
# On tilted planes
# ----------------
# The same ball, and three planes of which each cuts it in another circle. The policy goes to the origin.

ball = Ellipsoid([1.0, 0.0, 0.0], 0.4)
figure = plt.figure(figsize=(6, 5), layout="constrained")
axes = figure.add_subplot(projection="3d")
u, v = np.mgrid[0 : 2 * np.pi : 30j, 0 : np.pi : 15j]
axes.plot_surface(
    *(ball.centre[:, None, None] + 0.4 * np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)])),
    color="0.8",
    alpha=0.5,
)
for tilt, color in ((-0.9, "#0072b2"), (-0.3, GREEN), (0.3, "#d55e00")):
    plane = uc.constraints.Plane([0.0, np.sin(tilt), np.cos(tilt)])
    across = np.array([0.0, np.cos(tilt), -np.sin(tilt)])
    starts = [2.0, 0.0, 0.0] + np.linspace(-0.45, 0.45, 6)[:, None] * across
    for run in uc.rollout(lambda x: -x, starts, 400, 0.02, plane, obstacles=[ball]):
        axes.plot(*run.states.T, color=color, linewidth=1.5)
axes.set(
    aspect="equal", xlabel="x (m)", ylabel="y (m)", zlabel="z (m)", title="Movements on three planes, around a ball"
)
axes.view_init(elev=35, azim=-60)
plt.show()
