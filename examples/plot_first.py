"""
Two rails, one policy
=====================

Somebody moves to the middle of a table, once along a rail that runs ahead and once along a rail that runs aside.
Neither recording shows the policy, and their average shows something that nobody wants.
"""

# %%
# Record
# ------
#
# Every action is the projection of the policy, "to the middle", onto the rail of that demonstration.

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc

rng = np.random.default_rng(0)
angles = np.radians([10, 60, 110, 160])
demonstrations = []
for angle in angles:
    states = rng.uniform(-1, 1, (40, 2))
    normal = np.array([[-np.sin(angle), np.cos(angle)]])
    projection = uc.null_space_projection(normal)
    demonstrations.append(uc.Demonstration(states, -states @ projection))

# %%
# Learn
# -----

policies = {
    "recorded": None,
    "ordinary regression": uc.ParametricPolicy(uc.Affine(), "direct").fit_demonstrations(demonstrations),
    "consistent learning": uc.ParametricPolicy(uc.Affine()).fit_demonstrations(demonstrations),
}

axis = np.linspace(-1, 1, 9)
grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
figure, panels = plt.subplots(1, 3, figsize=(11, 4), layout="constrained", sharey=True)
for axes, (name, policy) in zip(panels, policies.items(), strict=True):
    if policy is None:
        for number, one in enumerate(demonstrations):
            axes.quiver(*one.states.T, *one.actions.T, color=f"C{number}", angles="xy", scale_units="xy", scale=6)
    else:
        axes.quiver(*grid.T, *policy(grid).T, color="#009e73", angles="xy", scale_units="xy", scale=6)
    axes.set(aspect="equal", title=name, xlabel="x (m)", xlim=(-1.15, 1.15), ylim=(-1.15, 1.15))
panels[0].set_ylabel("y (m)")
plt.show()
