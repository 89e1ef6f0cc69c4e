"""
A policy that arrives
=====================

Learnt from a few strokes, a policy may run past its goal from starts that nobody showed. :class:`unconstrain.Guided`
corrects it as little as needed so that it arrives from everywhere, and under constraints that it never saw.
"""

# %%
# Strokes to a goal
# -----------------

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc


def bow(x):
    """Comes to the origin on a half circle, and slows down there."""
    speed = np.minimum(1.0, np.linalg.norm(x, axis=1, keepdims=True) / 0.3)
    return speed * np.column_stack([-x[:, 1], x[:, 0] - 1.0]) - 0.3 * x * (1.0 - speed)


strokes = uc.rollout(bow, np.array([[2.0, 0.0], [1.95, 0.2], [2.0, 0.1]]), 160, 0.02)
policy = uc.LocallyLinearPolicy(0.05, learner="direct").fit_demonstrations(strokes)
guided = uc.Guided(policy, goal=[0.0, 0.0], demonstrations=strokes)

# %%
# From afar, as learnt and guided.

far = np.array([[-0.8, 1.0], [0.4, -0.5], [1.5, -1.0], [1.2, 1.6]])
figure, panels = plt.subplots(1, 2, figsize=(9, 4.5), layout="constrained", sharey=True)
for axes, (name, one) in zip(panels, (("as learnt", policy), ("guided", guided)), strict=True):
    for stroke in strokes:
        axes.plot(*stroke.states.T, color="0.7", linewidth=3)
    for path in uc.rollout(one, far, 600, 0.02):
        axes.plot(*path.states.T, color="#009e73")
    axes.plot(0, 0, "k*", markersize=12)
    axes.set(aspect="equal", title=name, xlim=(-1.5, 3), ylim=(-2, 2), xlabel="x (m)")
panels[0].set_ylabel("y (m)")
plt.show()
