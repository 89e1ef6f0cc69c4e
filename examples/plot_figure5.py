"""
From one constraint to many
===========================

Direct learning is right when nothing constrains the demonstrator, and the inconsistency when constraints vary a lot.
Real recordings are somewhere between. Here the constraint lets a point move only along its policy turned by a random
angle of at most θmax, so that one number leads from the one end to the other (figure 5 of the paper).
"""

# %%
# Learn at several points between the ends
# ----------------------------------------
#
# The paper averages over 50 data sets; for a first look a few will do. ``unconstrain reproduce figure5`` runs them
# all.

import matplotlib.pyplot as plt
import numpy as np

from unconstrain.pages.figures import COLOURS, LABELS, METHODS
from unconstrain.paper.experiments import figure5

settings = figure5.Settings(widest=(0.0, 0.05, 0.1, 0.2, 0.3, 0.6, 1.0, 1.5), trials=4)
result = figure5.run(settings)

# %%
# Follow the lower of two curves
# ------------------------------
#
# nUPE is the error of the learnt policy where it is free; nCPE is what the constraint leaves of it. Bands are one
# standard deviation over the data sets.

figure, panels = plt.subplots(2, 2, figsize=(11, 7.6), layout="constrained", sharex=True)
for metric, row in zip(("nupe", "ncpe"), panels, strict=True):
    tops = []
    for method in METHODS:
        rows = [one for one in result.rows if one["method"] == method]
        angle, mean, sd = (
            np.array([one[key] for one in rows]) for key in ("theta_max", f"{metric}_mean", f"{metric}_sd")
        )
        tops += [] if method == "inconsistency" else [(mean + sd).max()]
        for axes in row:
            axes.plot(angle, mean, "o-", color=COLOURS[method], label=LABELS[method], markersize=4)
            axes.fill_between(
                angle, np.maximum(mean - sd, mean / 10), mean + sd, color=COLOURS[method], alpha=0.15, linewidth=0
            )
    row[0].set(ylabel=f"n{metric[1:].upper()}", ylim=(0, 1.1 * max(tops)))  # the inconsistency leaves at θmax = 0
    row[1].set(yscale="log")
for axes in panels[-1]:
    axes.set_xlabel("θmax (rad)")
panels[0, 0].set_title("linear")
panels[0, 1].set_title("logarithmic")
panels[0, 1].legend(frameon=False)
plt.show()

# %%
# At θmax = 0 every observation *is* the policy. The inconsistency then knows the policy along one direction at each
# state and nothing across it, and its nUPE is enormous. The hybrid notices that on held-out demonstrations and
# leaves these directions to regression; as the constraints begin to vary, it takes over more and more of them from
# the inconsistency. How far it is from the better of the other two:

for metric in ("nupe", "ncpe"):
    ratios = figure5.ratios(result.rows, metric)
    print(f"n{metric[1:].upper()}:", ", ".join(f"{ratio:.2g} at {angle:g} rad" for angle, ratio in ratios.items()))
