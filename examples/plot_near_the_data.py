"""
Where nobody has been
=====================

A policy says something everywhere, and means it only where it was shown something. ``support`` tells the two apart,
and :class:`unconstrain.Guided` brings a movement back onto the cycle that was shown.
"""

# %%
# A policy of a ring
# ------------------

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc


def outward(states):
    """Rounds a ring, and drifts outward."""
    return np.column_stack([-states[:, 1], states[:, 0]]) + 0.03 * states


shown = uc.rollout(outward, [0.9, 0.0], 600, 0.02)  # nearly two turns
policy = uc.LocallyLinearPolicy(0.1, learner="direct").fit_demonstrations([shown])
safe = uc.Guided(policy, orbit="shown", demonstrations=[shown])

# %%
# Shaded is the support of the data. The learnt policy leaves it; guided, it stays.

axis = np.linspace(-2.5, 2.5, 120)
grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
support = policy.support(grid).reshape(120, 120)
figure, axes = plt.subplots(figsize=(5, 5), layout="constrained")
axes.contourf(axis, axis, support, levels=np.linspace(0, 1, 9), cmap="Greens")
for name, one, colour in (("as learnt", policy, "#d55e00"), ("guided", safe, "#0072b2")):
    path = uc.rollout(one, [1.0, 0.0], 1500, 0.02).states
    axes.plot(*path.T, color=colour, label=name)
axes.legend(loc="upper right")
axes.set(aspect="equal", xlim=(-2.5, 2.5), ylim=(-2.5, 2.5), xlabel="x (m)", ylabel="y (m)")
axes.set_title("A cycle as learnt, which leaves the data, and guided")
plt.show()
