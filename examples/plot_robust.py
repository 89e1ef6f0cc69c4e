"""
Noise, free samples, and what cannot be known
=============================================

Forty movements on a limit cycle, every second one behind a rail that turns twice on the way, the others free; then
noise of 5 % is added to each action. The paper's hybrid and :class:`unconstrain.Robust` learn from the same recordings.
"""

# %%
# Learn
# -----
#
# The second learner has no setting to choose. It says how much noise it found, and which share of the samples was free.

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc
from unconstrain.pages.figures import COLOURS
from unconstrain.paper.experiments import regimes, toy

settings = toy.ToySettings()
rng = np.random.default_rng(7001)
recorded, test = regimes.demonstrate("limit cycle", "half", rng)
noisy = regimes.with_noise(recorded, 0.05, rng)

robust = toy.policy(settings).set_params(learner=uc.Robust()).fit_demonstrations(noisy)
hybrid = robust.with_learner(uc.Hybrid(alpha=1e-2))
found = robust.solution_
print(f"nUPE of the hybrid {uc.nupe(hybrid, test):.2g}, of the robust learner {uc.nupe(robust, test):.2g}")
print(f"taken: {found.method}; noise {found.noise:.3f} on each coordinate; {found.free_share:.0%} of the samples free")

# %%
# Look at the fields
# ------------------
#
# Coloured arrows are what is learnt, thin black ones the truth; those longer than the longest true one are cut to it.

axis = np.linspace(-1, 1, 13)
grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
true = settings.system(grid)
longest = np.linalg.norm(true, axis=1).max()


def cut(field):
    length = np.linalg.norm(field, axis=1, keepdims=True)
    return field * np.minimum(1, longest / length)


figure, panels = plt.subplots(1, 2, figsize=(10, 5), layout="constrained", sharey=True)
named = (("hybrid", hybrid, "inconsistency"), ("robust", robust, "hybrid"))
for axes, (name, policy, colour) in zip(panels, named, strict=True):
    for demonstration in noisy:
        axes.plot(*demonstration.states.T, color=COLOURS["training"], linewidth=1)
    for field, look in ((cut(policy(grid)), {"color": COLOURS[colour], "width": 0.007}), (true, {"width": 0.002})):
        axes.quiver(*grid.T, *field.T, angles="xy", scale_units="xy", scale=14, **look)
    axes.set(aspect="equal", xlim=(-1.15, 1.15), ylim=(-1.15, 1.15), title=name, xlabel="x₁ (m)")
panels[0].set_ylabel("x₂ (m)")
plt.show()

# %%
# The circle of Thales
# --------------------
#
# Turn and scale every action so that the learnt policy at its state is (1, 0). Whatever constrained it, it then lies
# on the circle with the diameter from 0 to (1, 0), but for the noise; free samples are at its right end. This is what
# the likelihood knows beside consistency. No free sample is certain to be one: it could have been turned by less than
# the noise.

states, actions, _ = uc.stack(noisy)
policy = robust(states)
length = (policy**2).sum(axis=1)
along = (actions * policy).sum(axis=1) / length
across = (actions[:, 1] * policy[:, 0] - actions[:, 0] * policy[:, 1]) / length

figure, axes = plt.subplots(figsize=(6.4, 5), layout="constrained")
dots = axes.scatter(along, across, c=found.free, s=9, cmap="cividis", vmin=0, vmax=1)
angle = np.linspace(0, 2 * np.pi, 200)
axes.plot(0.5 + 0.5 * np.cos(angle), 0.5 * np.sin(angle), color=COLOURS["truth"], linewidth=1)
axes.plot([0, 1], [0, 0], "k+", markersize=10)
axes.set(aspect="equal", xlim=(-0.4, 1.4), ylim=(-0.8, 0.8))
axes.set(xlabel="action along the policy / ‖policy‖", ylabel="action across the policy / ‖policy‖")
figure.colorbar(dots, label="probability that the sample was free")
plt.show()

# %%
# What is not known
# -----------------
#
# :meth:`policy.uncertainty <unconstrain.ParametricPolicy.uncertainty>` tells what noise leaves open from what the data
# does not say. Both are small along the recordings and grow away from them. Here rails turn and half of the movements
# are free, so next to nothing is left to what was not recorded.

fine = np.linspace(-1.15, 1.15, 60)
everywhere = np.stack(np.meshgrid(fine, fine), axis=-1)
spread = robust.uncertainty(everywhere.reshape(-1, 2))
typical = np.sqrt((actions**2).sum(axis=1).mean())

figure, panels = plt.subplots(1, 2, figsize=(10.5, 4.6), layout="constrained", sharey=True)
titles = {"left open by noise": spread.from_noise, "not said by the data": spread.undetermined}
levels = np.logspace(-3, 0, 13)
for axes, (title, value) in zip(panels, titles.items(), strict=True):
    share = np.clip(np.linalg.norm(value, axis=1) / typical, levels[0], levels[-1]).reshape(everywhere.shape[:2])
    shades = axes.contourf(fine, fine, share, levels=levels, norm="log", cmap="cividis")
    for demonstration in noisy:
        axes.plot(*demonstration.states.T, color="white", linewidth=0.8)
    axes.set(aspect="equal", title=title, xlabel="x₁ (m)")
panels[0].set_ylabel("x₂ (m)")
figure.colorbar(shades, ax=panels, label="standard deviation / typical action", ticks=[1e-3, 1e-2, 0.1, 1])
plt.show()
