"""What the toy experiments of section IV-A have in common."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

import unconstrain as uc

from ..systems.limit_cycle import LimitCycle

Draw = Callable[["ToySettings", np.random.Generator], uc.constraints.Constraint | None]


@dataclass(frozen=True)
class ToySettings:
    """Settings of section IV-A. The paper names those above the line in the source; ours are below.

    Parameters
    ----------
    demonstrations, steps : int
        Trajectories, and samples of each.
    rho, omega, dt : float
        The limit cycle (eq. 18), rad/s, and the time between samples, s.
    switches : int
        How often the random constraint (eq. 19) changes on the way.
    per_axis : int
        The RBFs' grid is ``per_axis × per_axis``.
    start : float
        Start states are uniform in [−start, start]².
    reach : float
        The grid spans [−reach, reach]².
    width : float
        The kernels' σ as a multiple of the grid spacing.
    test_share : float
        Share of the samples, drawn at random from all trajectories, that is held out for testing.
    folds : int
        Folds of whole demonstrations on which the threshold is chosen.
    alpha : float
        See :class:`~unconstrain.Hybrid`.
    """

    demonstrations: int = 40
    steps: int = 40
    rho: float = 0.5
    omega: float = 1.0
    dt: float = 0.02
    switches: int = 2
    per_axis: int = 6
    # ---- the paper is silent on these; chosen on other seeds than the reported ones
    start: float = 1.0
    reach: float = 1.0
    width: float = 1.0
    test_share: float = 0.1
    folds: int = 40
    alpha: float = 0.3

    @property
    def system(self) -> LimitCycle:
        """The policy that demonstrates."""
        return LimitCycle(self.rho, self.omega)


def free(settings: ToySettings, rng: np.random.Generator) -> None:
    """No constraint."""


def random_lines(settings: ToySettings, rng: np.random.Generator) -> uc.constraints.SwitchingLine:
    """Eq. 19."""
    return uc.constraints.SwitchingLine.random(rng, settings.steps * settings.dt, settings.switches)


def policy_aligned(widest: float, angles: int | None = None) -> Draw:
    """Eq. 20 with θ uniform in [−widest, widest], drawn for each step, or for the first ``angles`` of them."""

    def draw(settings: ToySettings, rng: np.random.Generator) -> uc.constraints.PolicyAligned:
        drawn = settings.steps if angles is None else angles
        return uc.constraints.PolicyAligned.random(rng, settings.system, widest, drawn, settings.dt)

    return draw


def demonstrate(settings: ToySettings, rng: np.random.Generator, draw: Draw) -> list[uc.Demonstration]:
    """Record demonstrations, each under a constraint of its own."""
    starts = rng.uniform(-settings.start, settings.start, (settings.demonstrations, 2))
    drawn = [draw(settings, rng) for _ in starts]
    constraints = [one for one in drawn if one is not None] or None
    return uc.rollout(settings.system, starts, settings.steps, settings.dt, constraints, name="toy", method="euler")


def split(
    demonstrations: Sequence[uc.Demonstration], share: float, rng: np.random.Generator
) -> tuple[list[uc.Demonstration], list[uc.Demonstration]]:
    """Hold a share of all samples out; returns those to learn from and those to test on."""
    kept, tested = [], []
    for demo in demonstrations:
        out = rng.random(len(demo)) < share
        kept += [demo[~out]] if not out.all() else []
        tested += [demo[out]] if out.any() else []
    return kept, tested


def policy(settings: ToySettings) -> uc.ParametricPolicy:
    """36 normalised RBFs on a grid."""
    grid = uc.NormalisedRBF.grid(-settings.reach, settings.reach, settings.per_axis, width=settings.width)
    return uc.ParametricPolicy(grid, uc.Direct(), uc.Folds(settings.folds, by="demonstration"))


def learners(settings: ToySettings) -> dict[str, uc.Learner]:
    """The three methods."""
    return {
        "direct": uc.Direct(),
        "inconsistency": uc.Inconsistency(),
        "hybrid": uc.Hybrid(settings.alpha),
    }
