"""
What held the movement
======================

The constraint is the other half of what was recorded. Along a curved rail the direction that is held turns with the
place; :class:`unconstrain.LearntConstraint` finds how many directions are held, and which, from states and actions
alone.
"""

# %%
# Learn
# -----

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc

rng = np.random.default_rng(1)
states = rng.uniform(-1, 1, (400, 2))
normals = np.column_stack([0.8 * states[:, 0], np.ones(400)])[:, None]  # of the curves y = c − 0.4 x²
wanted = np.column_stack([1.0 - states[:, 0], -0.5 * states[:, 1]])
actions = uc.project(uc.null_space_projection(normals), wanted) + rng.normal(0, 0.01, (400, 2))

constraint = uc.LearntConstraint().fit(states, actions)
print(f"{constraint.rank_} of 2 directions held, noise {constraint.noise_:.3f} on each coordinate")

# %%
# Look
# ----
#
# Lines are the directions that are left free: coloured as learnt, black as they are.

axis = np.linspace(-1, 1, 9)
grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
learnt = constraint.projection(grid)
true = uc.null_space_projection(np.column_stack([0.8 * grid[:, 0], np.ones(len(grid))])[:, None])

figure, axes = plt.subplots(figsize=(5, 5), layout="constrained")
axes.plot(*states.T, ".", color="0.85")
for projections, look in ((learnt, {"color": "#009e73", "width": 0.008}), (true, {"width": 0.002})):
    along = np.linalg.eigh(projections)[1][:, :, -1]
    axes.quiver(
        *grid.T, *along.T, angles="xy", scale_units="xy", scale=8, headwidth=1, headlength=0, pivot="mid", **look
    )
axes.set(aspect="equal", xlabel="x (m)", ylabel="y (m)", title="free directions")
plt.show()
