"""
How the hybrid chooses
======================

The paper's hybrid splits the directions of the weights in two: those that consistency determines, and the others,
which the distance to the recorded actions decides. The path over all splits costs one factorisation; the split is
chosen on held-out data.
"""

# %%
# A hard case
# -----------
#
# A rail that is nearly the same in all demonstrations: consistency says much about the motion along it, and little
# across.

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc

rng = np.random.default_rng(3)
states = rng.uniform(-1, 1, (400, 2))
wanted = np.column_stack([states[:, 1], -states[:, 0]]) + 0.3
groups = np.arange(400) // 20
angles = np.radians(np.where(groups % 5 == 0, 4.0, 0.0))
normals = np.column_stack([-np.sin(angles), np.cos(angles)])[:, None]
actions = uc.project(uc.null_space_projection(normals), wanted) + rng.normal(0, 0.03, (400, 2))

policy = uc.ParametricPolicy(uc.Polynomial(2), uc.Hybrid(alpha=1e-2)).fit(states, actions, groups=groups)
solution = policy.solution_

# %%
# Eigenvalues of the inconsistency, and the held-out score of each split. The line is where the split was put.

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.5), layout="constrained")
values = np.sort(solution.eigenvalues[0])[::-1]
left.semilogy(np.arange(1, len(values) + 1), values / values[0], "o", color="#0072b2")
left.set(xlabel="direction of the weights", ylabel="eigenvalue, share of the largest")
right.semilogy(np.arange(len(solution.scores[0])), solution.scores[0], color="#009e73")
right.set(xlabel="directions left to the distance", ylabel="held-out score")
left.axvline(solution.determined[0] + 0.5, color="black", linewidth=0.8)
right.axvline(solution.directions - solution.determined[0], color="black", linewidth=0.8)
figure.suptitle("Which directions of the weights are determined")
plt.show()
print(f"{solution.determined[0]} of {solution.directions} directions are determined by consistency")
