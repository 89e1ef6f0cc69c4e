"""
Recorded: handwriting behind rails
==================================

Seven strokes of one letter, drawn by a hand on a tablet (the LASA data set). Each is put behind rails that turn from
stroke to stroke, which take away what points into them. The policy is learnt from what is left, and compared with
what was drawn.

The recordings do not come with the package: set ``UNCONSTRAIN_DATA`` to the folder that holds them, or load with
``download=True``.
"""

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc

strokes = uc.datasets.load_handwriting("CShape")
rng = np.random.default_rng(4)
held = []
for stroke in strokes:
    turning = rng.uniform(0, np.pi) + np.linspace(0, rng.uniform(1, 3), len(stroke))
    normals = np.column_stack([np.cos(turning), np.sin(turning)])[:, None]
    taken = uc.project(uc.null_space_projection(normals), stroke.actions)
    held.append(uc.Demonstration(stroke.states, taken, stroke.times, name=stroke.name))

# %%
# Learn from what the rails left, by ordinary regression and consistently, and draw again from the same starts.

consistent = uc.LocallyLinearPolicy().fit_demonstrations(held)
direct = consistent.with_learner("direct")
for name, policy in (("ordinary regression", direct), ("consistent learning", consistent)):
    missed = sum(np.square(policy(stroke.states) - stroke.actions).sum() for stroke in strokes)
    print(f"{name}: misses {missed / sum(np.square(stroke.actions).sum() for stroke in strokes):.0%} of the motion")
starts = np.array([stroke.states[0] for stroke in strokes])

figure, panels = plt.subplots(1, 3, figsize=(12, 4), layout="constrained", sharex=True, sharey=True)
for one in held:
    panels[0].quiver(*one.states[::2].T, *one.actions[::2].T, angles="xy", scale_units="xy", scale=8, width=0.003)
for axes, policy in ((panels[1], direct), (panels[2], consistent)):
    for stroke in strokes:
        axes.plot(*stroke.states.T, color="0.75")
    for path in uc.rollout(policy, starts, 200, 0.02):
        axes.plot(*path.states.T, color="#009e73")
for axes, title in zip(panels, ("behind rails", "ordinary regression", "consistent learning"), strict=True):
    axes.set(aspect="equal", title=title, xlabel="x (mm)")
panels[0].set_ylabel("y (mm)")
plt.show()
