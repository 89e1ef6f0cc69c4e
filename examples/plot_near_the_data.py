"""
Where nobody has been
=====================

A policy says something everywhere, and means it only where it was shown something. ``support`` tells the two apart,
and :class:`unconstrain.Contained` keeps a movement where there was data.
"""

# %%
# A policy of a ring
# ------------------

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc

rng = np.random.default_rng(0)
turns = rng.uniform(0, 2 * np.pi, 300)
radii = 1.0 + 0.15 * rng.standard_normal(300)
states = radii[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
wanted = np.column_stack([-states[:, 1], states[:, 0]]) + 0.4 * states  # the demonstrator drifts outward
policy = uc.LocallyLinearPolicy(0.1, learner="direct").fit(states, wanted)
safe = uc.Contained(policy, states, reach=0.2)

# %%
# Shaded is the support of the data. The learnt policy leaves it; contained, it stays.

axis = np.linspace(-2.5, 2.5, 120)
grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
support = policy.support(grid).reshape(120, 120)
figure, axes = plt.subplots(figsize=(5, 5), layout="constrained")
axes.contourf(axis, axis, support, levels=np.linspace(0, 1, 9), cmap="Greens")
for name, one, colour in (("as learnt", policy, "#d55e00"), ("contained", safe, "#0072b2")):
    path = uc.rollout(one, [1.0, 0.0], 300, 0.02).states
    axes.plot(*path.T, color=colour, label=name)
axes.legend(loc="upper right")
axes.set(aspect="equal", xlim=(-2.5, 2.5), ylim=(-2.5, 2.5), xlabel="x (m)", ylabel="y (m)")
plt.show()
