"""Every learner in every regime of constraints and noise, beside an oracle.

In the plane, a share of the samples of all demonstrations is held out to test on, as in the paper (section IV-A), so
that what was learnt from lies a step before and behind; errors at fresh demonstrations, from starts drawn alike, stand
beside. The arm is tested on fresh ones alone.

Noise is added to recorded actions alone: states are those of the roll-out, so their differences in time are the
actions without noise. No learner that is judged here may take differences of states.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

import unconstrain as uc

from ...base.arrays import Array
from ...base.errors import SettingError
from ...risks import (
    Moments,
    Quadratic,
    gather,
    inconsistency,
    lexicographic_path,
    softened_minima,
    standard_risk,
    unvec,
    vec,
)
from ..systems.arm import LWR3, JointLimitAvoidance
from ..systems.limit_cycle import LimitCycle
from ..systems.pendulum import Pendulum
from . import toy
from .journal import Journal
from .trials import Progress, Result, candidate_of, errors_of, reproduced, row, run_trials
from .truths import true_policy, true_projections, was_free, with_noise

PLANAR = ("none", "random", "half", "quarter free", "0.1", "0.3", "0.6", "1", "1.5")
"""Constraints of the two systems in the plane. Numbers are the θ_max of eq. 20, rad; "half" and "quarter free"
say which share of the demonstrations nothing constrains, while the others are constrained at random (eq. 19)."""

ARM = ("none", "half", "1", "1-2-3", "1-...-5", "1-...-6")
"""Coordinates of the arm's hand that are held; "half" of the demonstrations are free, and in the others 1-2-3 is."""

ARM_IF_ASKED = ("1-...-4",)
"""Further ones, which are no part of the benchmark: run where ``only`` names them."""

DEFAULT = "robust"
"""The learner that people are to take who know nothing of their constraints."""

PAPER = "hybrid"
ORACLE = "oracle"
KNOWN = "constraints known"
"""What could be learnt if every sample's constraint were known, and a ridge chosen by the truth."""

JACOBIAN = "Jacobian known"
"""The default learner with the Jacobian of the arm's hand, though not which of its rows are held; has its own table."""

_SOFTNESSES = tuple(np.logspace(-9, 0, 10).tolist())
_HELD = {"1": 1, "1-2-3": 3, "half": 3, "1-...-4": 4, "1-...-5": 5, "1-...-6": 6}
_SYSTEMS: dict[str, Callable[[Array], Array]] = {"limit cycle": LimitCycle(), "pendulum": Pendulum()}
_JACOBIANS: dict[str, Callable[[Array], Array]] = {"arm": LWR3.jacobian}


@dataclass(frozen=True)
class Settings:
    """Settings of the benchmark.

    Parameters
    ----------
    trials, seed : int
        Data sets of each regime, and what draws them. Everything was developed on other seeds.
    noise : tuple of float
        Standard deviation of the noise on each action coordinate, as a share of the root-mean-square spread of the
        policy over its coordinates. States are exact.
    alpha : float
        Of the paper's hybrid.
    thresholds : int
        That the oracle chooses from, evenly over ten decades.
    only : tuple of str
        Systems, constraints, or both as in "limit cycle, half", to which to keep; all if empty.
        Data sets do not depend on it. The arm takes most of the time.
    """

    trials: int = 20
    seed: int = 0
    noise: tuple[float, ...] = (0.0, 0.02, 0.05, 0.1)
    alpha: float = 1e-2
    thresholds: int = 61
    only: tuple[str, ...] = ()


def run(
    settings: Settings | None = None, workers: int = 1, progress: Progress | None = None, journal: Journal | None = None
) -> Result:
    """Run the benchmark; parameters and result as in :func:`unconstrain.paper.experiments.table1.run`.

    Rows are as those of Table I, with ``system``, ``constraint``, ``noise``,
    the geometric mean of nUPE over the trials and its ratio to the oracle's;
    ``tables["summary"]`` has one row for each method and noise, and
    ``tables["jacobian_known"]`` the arm's rows of the learner that knows its
    Jacobian, which is compared with none that knows less.
    """
    chosen = settings or Settings()
    regimes = _regimes(chosen.only)
    seeds = np.random.SeedSequence(chosen.seed).spawn(chosen.trials)
    calls = [(chosen, *regime, seed) for seed in seeds for regime in regimes]
    found = run_trials(trial, calls, workers, progress, journal)
    every = []
    for index, (system, constraint) in enumerate(regimes):
        of_regime = found[index :: len(regimes)]
        for place, noise in enumerate(chosen.noise):
            every += _rows([one[place] for one in of_regime], system=system, constraint=constraint, noise=noise)
    known, rows = ([one for one in every if (one["method"] == JACOBIAN) == apart] for apart in (True, False))
    return Result("regimes", chosen, rows, tables={"summary": _summary(rows, chosen), "jacobian_known": known})


def _regimes(only: Sequence[str]) -> list[tuple[str, str]]:
    every = [(system, constraint) for system in _SYSTEMS for constraint in PLANAR]
    every += [("arm", constraint) for constraint in ARM]
    names = {regime: {*regime, ", ".join(regime)} for regime in every}
    names |= {("arm", constraint): {constraint, f"arm, {constraint}"} for constraint in ARM_IF_ASKED}
    for name in only:
        if not any(name in called for called in names.values()):
            systems, constraints = (list(dict.fromkeys(column)) for column in zip(*every, strict=True))
            raise SettingError(
                f"only: got {name!r}, expected a system ({', '.join(systems)}), a constraint "
                f"({', '.join(constraints)}), or both, such as {', '.join(every[0])!r}."
            )
    return [regime for regime, called in names.items() if called.intersection(only)] if only else every


def trial(
    settings: Settings, system: str, constraint: str, seed: np.random.SeedSequence
) -> list[dict[str, tuple[float, ...]]]:
    """Learn from one data set; for each noise level, what is found of each method, see :data:`_COLUMNS`."""
    rng = numbers_of(system, constraint, seed)
    training, test = demonstrate(system, constraint, rng)
    others = (test,) if system == "arm" else demonstrate(system, constraint, numbers_of(system, constraint, seed, 1))
    fresh = [demo for part in others for demo in part]
    found = []
    for noise in settings.noise:
        noisy = with_noise(training, noise, rng)
        policy = _policy(system).set_params(learner=uc.Robust()).fit_demonstrations(noisy)
        learnt = {
            "direct": policy.with_learner(uc.Direct()),
            "inconsistency": policy.with_learner(uc.Inconsistency()),
            PAPER: policy.with_learner(uc.Hybrid(settings.alpha)),
            "hybrid, auto": policy.with_learner(uc.Hybrid(alpha="auto")),
            "noise-corrected": _compared("noise-corrected", policy, uc.NoiseCorrected()),
            "likelihood": _compared("likelihood", policy, uc.Likelihood()),
        }
        of_noise: dict[str, tuple[float, ...]] = {method: errors_of(one, test) for method, one in learnt.items()}
        of_noise[DEFAULT] = (*errors_of(policy, test), *_knowledge(policy, noisy, test))
        if system in _JACOBIANS:
            knowing = policy.with_learner(uc.Robust(jacobian=_JACOBIANS[system]))
            of_noise[JACOBIAN] = (*errors_of(knowing, test), *_knowledge(knowing, noisy, test))
        of_noise[ORACLE] = _oracle(policy, test, settings.thresholds)
        of_noise[KNOWN] = _knowing(policy, noisy, test)
        of_fresh = {method: uc.nupe(one, fresh) for method, one in {**learnt, DEFAULT: policy}.items()}
        unknown = (np.nan,) * len(_COLUMNS)
        found.append(
            {
                method: (*(*one, *unknown)[: len(_COLUMNS) - 1], of_fresh.get(method, np.nan))
                for method, one in of_noise.items()
            }
        )
    return found


def numbers_of(system: str, constraint: str, seed: np.random.SeedSequence, *more: int) -> np.random.Generator:
    """The random numbers of one data set of a regime; with more numbers, of others under constraints of its kind."""
    name = sum(ord(letter) * (place + 1) for place, letter in enumerate(f"{system} {constraint}"))
    return np.random.default_rng([name, *seed.generate_state(4), *more])


def demonstrate(
    system: str, constraint: str, rng: np.random.Generator
) -> tuple[list[uc.Demonstration], list[uc.Demonstration]]:
    """Demonstrations to learn from and to be tested on, without noise."""
    if system == "arm":
        return _by_arm(constraint, 100, rng), _by_arm(constraint, 50, rng)
    settings, flow = toy.ToySettings(), _SYSTEMS[system]
    starts = rng.uniform(-settings.start, settings.start, (settings.demonstrations, 2))
    draws = [_planar(constraint, flow, index, settings, rng) for index in range(len(starts))]
    demos: list[uc.Demonstration] = []
    for start, drawn in zip(starts, draws, strict=True):
        constraints = None if drawn is None else [drawn]
        demos += uc.rollout(flow, start[None], settings.steps, settings.dt, constraints, name=system, method="euler")
    return toy.split(demos, settings.test_share, rng)


def verdict(result: Result) -> uc.evaluation.verdicts.Verdict:
    """Whether the default learner is better than the paper's hybrid at every noise level."""
    ours = [one for one in result.tables["summary"] if one["method"] == DEFAULT]
    claims = {
        f"at {one['noise']:.0%} noise {DEFAULT} has {one['to_paper']:.2f} times the nUPE of the paper’s hybrid": bool(
            one["to_paper"] < 1.0
        )
        for one in ours
    }
    worst = max(ours, key=lambda one: one["worst_to_oracle"])
    trust = (
        f"Geometric means; single regimes are up to {worst['worst_to_oracle']:.1f} times the oracle ({worst['worst']})."
    )
    return reproduced(claims, trust)


def headlines(result: Result) -> list[str]:
    """The default learner at each noise level, in a sentence; and what else a person asks."""
    summary = {(one["method"], one["noise"]): one for one in result.tables["summary"]}
    said = []
    for noise in result.settings.noise:  # type: ignore[attr-defined]
        ours, bound = summary[DEFAULT, noise], summary[KNOWN, noise]
        said.append(
            f"noise {noise:.0%}: {DEFAULT} nUPE {ours['to_paper']:.3f} times the paper's hybrid (geometric mean over "
            f"{ours['regimes']} regimes), and {ours['to_paper_fresh']:.3f} times at fresh demonstrations; "
            f"against the oracle {ours['to_oracle']:.2f} times, at worst "
            f"{ours['worst_to_oracle']:.2f} times ({ours['worst']}); with all {KNOWN} it would be "
            f"{bound['to_paper']:.3f} times the paper's"
        )
    for one in result.rows:
        if (
            one["method"] == DEFAULT
            and one["noise"] in (0.0, 0.05)
            and one["constraint"] in ("half", "1-2-3", "1-...-5")
        ):
            told = "" if one["auc_mean"] is None else f", free told apart with an area of {one['auc_mean']:.4f}"
            error = one["nupe_sd"] / np.sqrt(result.settings.trials)  # type: ignore[attr-defined]
            mean, error, geometric = (
                f"{100 * value:.4f}e-2" for value in (one["nupe_mean"], error, one["nupe_geometric"])
            )
            said.append(
                f"{one['system']}, {one['constraint']}, noise {one['noise']:.0%}: nUPE {mean} (mean, standard error "
                f"{error}; geometric mean {geometric}){told}"
            )
    said += [
        f"{JACOBIAN}, {one['system']}, {one['constraint']}, noise {one['noise']:.0%}: nUPE "
        f"{100 * one['nupe_mean']:.4f}e-2 (mean; median {100 * one['nupe_median']:.4f}e-2)"
        for one in result.tables["jacobian_known"]
    ]
    covered = [
        one["coverage_mean"] for one in result.rows if one["method"] == DEFAULT and one["coverage_mean"] is not None
    ]
    said.append(
        f"95 % intervals of {DEFAULT} hold the true policy where the data determines it: {np.mean(covered):.1%} over "
        f"all regimes, {min(covered):.1%} to {max(covered):.1%} in single ones"
    )
    return said


_COLUMNS = ("nupe", "ncpe", "ninc", "auc", "coverage", "fresh")


def _rows(of_regime: Sequence[dict[str, tuple[float, ...]]], **where: Any) -> list[dict[str, Any]]:
    rows = []
    best = np.array([one[ORACLE][0] for one in of_regime])
    for method in of_regime[0]:
        values = np.array([one[method] for one in of_regime])
        made = row(method, values[:, :3].tolist(), **where)
        made["nupe_geometric"] = float(np.exp(np.log(values[:, 0]).mean()))
        made["to_oracle"] = float(np.exp(np.log(values[:, 0] / best).mean()))
        made["fresh_geometric"] = None if np.isnan(values[0, 5]) else float(np.exp(np.log(values[:, 5]).mean()))
        for name, column in zip(_COLUMNS[3:5], values[:, 3:5].T, strict=True):
            known = column[np.isfinite(column)]
            made[f"{name}_mean"] = float(known.mean()) if len(known) else None
        rows.append(made)
    return rows


def _summary(rows: Sequence[dict[str, Any]], settings: Settings) -> list[dict[str, Any]]:
    """One row for each method and noise level, over all regimes."""
    said = []
    for method in dict.fromkeys(one["method"] for one in rows):
        for noise in settings.noise:
            mine = [one for one in rows if one["method"] == method and one["noise"] == noise]
            paper = [one for one in rows if one["method"] == PAPER and one["noise"] == noise]
            worst = max(mine, key=lambda one: one["to_oracle"])
            pairs = list(zip(mine, paper, strict=True))
            logs = [np.log(a["nupe_geometric"] / b["nupe_geometric"]) for a, b in pairs]
            judged = mine[0]["fresh_geometric"] is not None
            fresh = [np.log(a["fresh_geometric"] / b["fresh_geometric"]) for a, b in pairs] if judged else None
            said.append(
                {
                    "method": method,
                    "noise": noise,
                    "regimes": len(mine),
                    "to_paper": float(np.exp(np.mean(logs))),
                    "to_paper_fresh": None if fresh is None else float(np.exp(np.mean(fresh))),
                    "to_oracle": float(np.exp(np.mean([np.log(one["to_oracle"]) for one in mine]))),
                    "worst_to_oracle": worst["to_oracle"],
                    "worst": f"{worst['system']}, {worst['constraint']}",
                }
            )
    return said


def _knowledge(
    policy: uc.Policy, training: Sequence[uc.Demonstration], test: Sequence[uc.Demonstration]
) -> tuple[float, float]:
    """How well free samples are told from constrained ones, and how often intervals hold the truth; NaN if unknown."""
    states = np.concatenate([demo.states for demo in test])
    truth = true_policy(test)
    spread = policy.uncertainty(states)
    known = spread.undetermined < spread.from_noise
    held = np.abs(truth - policy(states)) <= 1.96 * spread.total
    return area_under_curve(policy.solution_.free, was_free(training)), float(
        held[known].mean()
    ) if known.any() else np.nan


def area_under_curve(scores: Array, labels: NDArray[np.bool_]) -> float:
    """Probability that a labelled sample scores above one that is not, ties half; NaN without one of either."""
    from sklearn.metrics import roc_auc_score

    return float(roc_auc_score(labels, scores)) if len(np.unique(labels)) == 2 else float("nan")


def _oracle(policy: uc.Policy, test: Sequence[uc.Demonstration], count: int) -> tuple[float, float, float]:
    """The best point of the paper's path, one threshold for all models, chosen by the truth."""
    whole = _centred(policy.training_.model, policy.moments_)
    path = lexicographic_path(inconsistency(whole), standard_risk(whole))
    return _best(policy, test, [path.at(path.split(threshold)) for threshold in (0.0, *np.logspace(-10, 0, count))])


def _knowing(
    policy: uc.Policy, training: Sequence[uc.Demonstration], test: Sequence[uc.Demonstration]
) -> tuple[float, float, float]:
    """The constrained error minimised with the true projections, beside as much of the risk as the truth says."""
    N = true_projections(training)
    states, actions, _ = uc.stack(training)
    model, d = policy.training_.model, actions.shape[1]
    features, members = model.design(states), model.memberships(states)

    def along(direction: Array) -> Moments:
        """Moments with what is observed along one direction, each sample as far as its constraint leaves it."""
        weights = np.einsum("a,nab,b->n", direction, N, direction)
        return _centred(model, gather(features, np.ones((len(states), 1)), np.maximum(weights, 0.0)[:, None] * members))

    axes = np.eye(d)
    alone = [along(axis).gram for axis in axes]
    p = features.shape[1]
    hessian = np.zeros((members.shape[1], p, d, p, d))
    for a in range(d):
        hessian[:, :, a, :, a] = alone[a]
        for b in range(a):  # weights must not be negative, and eᵀ N e is not
            mixed = 0.5 * (along(axes[a] + axes[b]).gram - alone[a] - alone[b])
            hessian[:, :, a, :, b] = hessian[:, :, b, :, a] = mixed
    whole = _centred(model, policy.moments_)
    linear = vec(_centred(model, gather(features, np.einsum("nab,nb->na", N, actions), members)).cross)
    error = Quadratic(hessian.reshape(-1, p * d, p * d), linear, whole.energy)
    minima = softened_minima(error, standard_risk(whole), _SOFTNESSES)
    return _best(policy, test, [minima[..., k] for k in range(len(_SOFTNESSES))])


def _centred(model: uc.Model, moments: Moments) -> Moments:
    centring = model.centring
    return moments if centring is None else moments.in_features(centring)


def _best(policy: uc.Policy, test: Sequence[uc.Demonstration], found: Sequence[Array]) -> tuple[float, float, float]:
    """Errors of the weights (M, P), over ``T_m φ``, that are nearest to the truth."""
    states, truth = uc.stack(test).states, true_policy(test)
    judged = policy.with_learner(uc.Direct())
    plain = best = judged.solution_
    least = np.inf
    for each in found:
        judged.solution_ = replace(plain, weights=unvec(each, policy.n_outputs_)).over(policy.training_.model)
        missed = float(((judged(states) - truth) ** 2).sum())
        if missed < least:
            best, least = judged.solution_, missed
    judged.solution_ = best
    return errors_of(judged, test)


def _compared(name: str, policy: uc.Policy, learner: uc.Learner) -> uc.Policy:
    """What a learner makes of the samples: that of the default learner's candidates, if it is among them."""
    return candidate_of(policy, name) if name in policy.solution_.candidates else policy.with_learner(learner)


def _policy(system: str) -> uc.Policy:
    if system == "arm":
        return uc.LocallyLinearPolicy(3.0, 0.7, learner=uc.Hybrid(), validation=uc.Folds())
    settings = toy.ToySettings()
    grid = uc.NormalisedRBF.grid(-settings.reach, settings.reach, settings.per_axis, width=settings.width)
    return uc.ParametricPolicy(grid, uc.Hybrid(), uc.Folds(by="demonstration"))


def _planar(
    kind: str, flow: Callable[[Array], Array], index: int, settings: toy.ToySettings, rng: np.random.Generator
) -> uc.constraints.Constraint | None:
    duration = settings.steps * settings.dt
    free = {"none": True, "half": index % 2 == 0, "quarter free": index % 4 == 0}
    if free.get(kind, False):
        return None
    if kind == "random" or kind in free:
        return uc.constraints.SwitchingLine.random(rng, duration, settings.switches)
    return uc.constraints.PolicyAligned.random(rng, flow, float(kind), settings.steps, settings.dt)


def _by_arm(kind: str, count: int, rng: np.random.Generator) -> list[uc.Demonstration]:
    starts = rng.uniform(-0.5, 0.5, (count, LWR3.joints)) * LWR3.upper
    free = {"none": count, "half": count // 2}.get(kind, 0)
    demos: list[uc.Demonstration] = []
    for part, held in ((starts[:free], 0), (starts[free:], _HELD.get(kind, 0))):
        constraint = uc.constraints.JacobianRows(LWR3.jacobian, tuple(range(held))) if held else None
        if len(part):
            demos += cast(
                "list[uc.Demonstration]",
                uc.rollout(JointLimitAvoidance(0.05, 1.8), part, 100, 0.5, constraint, name="arm", method="euler"),
            )
    return demos
