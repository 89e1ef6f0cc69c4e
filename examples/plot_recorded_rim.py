"""
Recorded: wiping a car rim
==========================

A robot arm is led by hand to wipe a car rim at four tilts (recorded at EPFL). One tilt is left out, the policy is
learnt from the others, put under the plane of the one left out, and compared with what the hand did there.

The recordings do not come with the package: set ``UNCONSTRAIN_DATA`` to the folder that holds them, or load with
``download=True``.
"""

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc

bouts = uc.datasets.load_rim_wiping(rate=10.0, centre=True)
tilts = list(dict.fromkeys(bout.tilt for bout in bouts))

# %%
# What was recorded, by tilt.

figure = plt.figure(figsize=(6, 5), layout="constrained")
axes = figure.add_subplot(projection="3d")
for number, tilt in enumerate(tilts):
    recorded = [bout.demonstration.states for bout in bouts if bout.tilt == tilt]
    for states in recorded:
        axes.plot(*states.T, color=f"C{number}", linewidth=0.8, label=tilt if states is recorded[0] else None)
axes.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)", title="Wiping a car rim at four tilts")
axes.locator_params(nbins=4)
axes.legend(frameon=False)
plt.show()

# %%
# Leave one tilt out
# ------------------
#
# nCPE: 0 is perfect, 1 is no better than the mean motion.

hybrid = uc.Hybrid(softness=0.1)
errors = {"ordinary regression": [], "consistent learning": []}
for tilt in tilts:
    learnt_from = [bout.demonstration for bout in bouts if bout.tilt != tilt]
    policy = uc.LocallyLinearPolicy(learner=hybrid).fit_demonstrations(learnt_from, speed_power=2)
    for name, one in (("ordinary regression", policy.with_learner("direct")), ("consistent learning", policy)):
        left_out = [bout for bout in bouts if bout.tilt == tilt]
        planes = [uc.constraints.Plane(bout.plane_normal) for bout in left_out]
        pairs = zip(left_out, planes, strict=True)
        errors[name].append(np.mean([uc.ncpe(one, bout.demonstration, plane) for bout, plane in pairs]))

figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
for shift, (name, values) in zip((-0.2, 0.2), errors.items(), strict=True):
    axes.bar(np.arange(len(tilts)) + shift, values, 0.38, label=name)
axes.set_xticks(range(len(tilts)), tilts)
axes.set(ylabel="nCPE on the tilt left out", title="Error on the tilt left out")
axes.legend(frameon=False)
plt.show()
