"""
Recorded: what held a tool on a contour
=======================================

A person follows a contour with a tool (recorded at KU Leuven). How many directions are held, and which, is found
from positions alone. One recording of one curve shows what was held along it; it cannot tell what held the tool from
what nobody tried.

The recordings do not come with the package: set ``UNCONSTRAIN_DATA`` to the folder that holds them, or load with
``download=True``.
"""

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc

recorded = uc.datasets.load_contour("a")[0]
seen, unseen = (uc.Demonstration(recorded.states[part::2], recorded.actions[part::2]) for part in (0, 1))
constraint = uc.LearntConstraint("quadratic").fit(seen.states, seen.actions)
print(f"{constraint.rank_} of 3 directions are held")
print(f"of the samples that were not learnt from it takes {uc.npoe(constraint, unseen):.1%} of the motion away")

# %%
# The recording in grey, and across it the direction that the learnt constraint holds.

figure = plt.figure(figsize=(6, 5), layout="constrained")
axes = figure.add_subplot(projection="3d")
axes.plot(*recorded.states.T, color="0.7", linewidth=2)
some = recorded.states[::6]
across = np.linalg.eigh(constraint.projection(some))[1][:, :, 0]
axes.quiver(*some.T, *across.T, length=0.05, pivot="middle", arrow_length_ratio=0, color="#009e73")
axes.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)", title="A recorded contour, and what held it")
plt.show()
