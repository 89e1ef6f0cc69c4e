"""
What each method learns from one data set
=========================================

A point in the plane follows a limit cycle. Forty short movements of it are recorded, once with nothing in the way and
once under a constraint: a rail that lets it move along one line only, and that is turned twice on the way (figure 4
of the paper). No method is told that there is a rail.
"""

# %%
# Record, and learn
# -----------------
#
# :mod:`unconstrain.paper.experiments.figure4` does both and returns everything that a picture needs: the recordings,
# the true policy on a grid of states, and what *direct* regression, the *inconsistency* alone and the *hybrid* make
# of it.

import matplotlib.pyplot as plt
import numpy as np

from unconstrain.pages.figures import COLOURS, LABELS, METHODS
from unconstrain.paper.experiments import figure4

result = figure4.run(figure4.Settings(seed=0))
grid, true = result.details["grid"], result.details["policy"]

# %%
# Look at the fields
# ------------------
#
# Grey lines are recordings and thin black arrows the true policy. Coloured arrows that are longer than the longest
# true one are cut to its length; otherwise the middle of the upper row would be nothing but orange.

longest = np.linalg.norm(true, axis=1).max()


def cut(field):
    length = np.linalg.norm(field, axis=1, keepdims=True)
    return field * np.minimum(1, longest / length)


def draw(axes, field, **look):
    axes.quiver(*grid.T, *field.T, angles="xy", scale_units="xy", scale=14, **look)


titles = {"none": "nothing in the way", "random": "rails that turn"}
figure, panels = plt.subplots(2, 3, figsize=(12, 8.4), layout="constrained", sharex=True, sharey=True)
for row, (constraint, title) in zip(panels, titles.items(), strict=True):
    found = result.details[constraint]
    for axes, method in zip(row, METHODS, strict=True):
        for demonstration in found["demonstrations"]:
            axes.plot(*demonstration.states.T, color=COLOURS["training"], linewidth=1)
        draw(axes, cut(found["fields"][method]), color=COLOURS[method], width=0.007)
        draw(axes, true, color=COLOURS["truth"], width=0.002)
        axes.set(aspect="equal", xlim=(-1.15, 1.15), ylim=(-1.15, 1.15), title=f"{LABELS[method]}: {title}")
for axes in panels[-1]:
    axes.set_xlabel("x₁ (m)")
for axes in panels[:, 0]:
    axes.set_ylabel("x₂ (m)")
plt.show()

# %%
# Read the numbers
# ----------------
#
# The first column is the error of the policy itself (nUPE), the second what is left of it after the rail (nCPE),
# both as a share of the policy's variance and on samples that nobody learnt from. Each of the two older methods
# fails on one kind of data, because each answers one question only. The hybrid asks first what is consistent with
# every observation, and then, where that leaves room, what is close to them.

print(f"{'data':8}{'method':15}{'nUPE':>10}{'nCPE':>10}")
for row in result.rows:
    print(f"{row['constraint']:8}{row['method']:15}{row['nupe_mean']:10.2g}{row['ncpe_mean']:10.2g}")
