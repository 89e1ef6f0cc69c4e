"""
Joint-space recordings of an arm
================================

An arm of seven joints moves away from its joint limits, and its hand is held
in two coordinates while it does so. The recordings are plain CSV files: a
time, seven joint angles, and seven joint velocities, one file for each
movement. This page takes them all the way to a policy, first on the command
line and then in Python.
"""

# %%
# Recordings
# ----------
#
# A stand-in for your own files: simulated movements of the light-weight robot
# LWR-III, written as CSV. Columns called ``x1`` to ``x7`` and ``u1`` to
# ``u7`` are taken as states and actions without being told.

import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc
from unconstrain.paper.experiments import table2

settings = table2.Settings(demonstrations=40, steps=60)
rng = np.random.default_rng(1)
folder = Path(tempfile.mkdtemp())
header = ",".join(["t", *(f"x{j}" for j in range(1, 8)), *(f"u{j}" for j in range(1, 8))])
for number, movement in enumerate(table2.demonstrate(settings, 2, 40, rng)):
    table = np.column_stack([movement.times, movement.states, movement.actions])
    np.savetxt(folder / f"move_{number:02}.csv", table, delimiter=",", header=header, comments="")

# %%
# On the command line
# -------------------


def unconstrain(*arguments: str) -> None:
    """Type a command."""
    print("$ unconstrain", *arguments)
    done = subprocess.run(
        [sys.executable, "-m", "unconstrain", *arguments], cwd=folder, capture_output=True, text=True, check=True
    )
    print("\n".join(done.stdout.splitlines()[:6]))


unconstrain("inspect", "move_*.csv")
unconstrain("fit", "move_*.csv", "--variance", "3", "--alpha", "1e-4", "--speed-power", "0.5", "-o", "arm.npz")
unconstrain("score", "arm.npz", "move_00.csv", "move_01.csv")
unconstrain("rollout", "arm.npz", "--start", "0.5,0.3,-0.4,0.6,0.2,-0.3,0.4", "--steps", "5", "--dt", "0.5")

# %%
# In Python
# ---------
#
# New movements with the *hand free*: nobody recorded one, and direct learning
# has never seen the directions that were held.

policy = uc.load(folder / "arm.npz")
direct = policy.with_learner(uc.Direct())
truth = table2.JointLimitAvoidance()
start = [0.5, 0.3, -0.4, 0.6, 0.2, -0.3, 0.4]
movements = {
    "true policy": uc.rollout(truth, start, 80, 0.5),
    "learnt, hybrid": uc.rollout(policy, start, 80, 0.5),
    "learnt directly": uc.rollout(direct, start, 80, 0.5),
}

figure, axes = plt.subplots(1, 4, figsize=(11, 3), sharex=True, layout="constrained")
colours = {"true policy": "black", "learnt, hybrid": "#009e73", "learnt directly": "#0072b2"}
for joint, panel in enumerate(axes):
    for name, movement in movements.items():
        style = "--" if name == "true policy" else "-"
        panel.plot(movement.times, np.degrees(movement.states[:, joint]), style, color=colours[name], label=name)
    panel.set(title=f"joint {joint + 1}", xlabel="time (s)")
axes[0].set_ylabel("angle (°)")
axes[0].legend(frameon=False, fontsize="small")
plt.show()

# %%
# Your own arm takes the place of the light-weight robot with
# ``Arm.from_urdf("robot.urdf", tip="hand")`` from ``unconstrain.paper.systems.arm``
# (extra ``arm``); ``unconstrain.constraints.known.JacobianRows(arm.jacobian, (0, 1))`` then
# holds the first two coordinates of its hand in a rollout.
