"""The car-washing experiment (section IV-C): learn to wipe on some surfaces, be tested on others.

Simulated hands wipe plates, or recorded ones a car rim; one policy is learnt
by each method and compared with what was done on surfaces that it has not
seen; and the arm wipes with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import unconstrain as uc

from ....base.errors import SettingError
from ...systems.wiping import Plate
from ..trials import CLOSE, Progress, Result, run_trials
from . import arm, learning, surfaces
from .surfaces import has_physics


@dataclass(frozen=True)
class Settings:
    """Settings of the washing experiment.

    Parameters
    ----------
    real : bool
        Learn from recorded bouts, leaving one tilt out at a time, instead of
        from simulated demonstrations.
    download : bool
        Fetch the recordings if they are not there.
    trials : int
        Sets of simulated demonstrations.
    seed : int
        Of the simulated demonstrators and cameras.
    simulator : {"auto", "contact", "kinematic"}
        What makes the simulated demonstrations and the reproduction: contact
        in a physics engine (the extra ``sim``), or the stand-in, which knows
        no forces and no arm. "auto" takes contact where it is installed.
    plate : (float, float), optional
        Tilt about x and y, degrees, of a further plate that nobody learns from.
    rate : float
        Samples per second.
    duration, strokes : float, int
        Of each simulated demonstration, s, and how often the sponge is put down in it.
    noise, dropped : float
        Of the simulated camera, m in each coordinate; and the share of frames that it loses.
    variance : float
        σ² of the receptive fields, m²: the paper's 0.025 where lengths are in units of 0.32 m.
    at_least : float
        Weight that every sample has in one of them.
    softness, threshold : float
        See :class:`~unconstrain.Hybrid`.
    steps, substeps : int
        Length of the movements drawn, in samples at ``rate``, and steps of the integration between two of them.
    cycles : int
        Turns that the arm is given on each plate.
    """

    real: bool = False
    download: bool = False
    trials: int = 10
    seed: int = 0
    simulator: str = "auto"
    plate: tuple[float, float] | None = None
    rate: float = 20.0
    duration: float = 20.0
    strokes: int = 10
    noise: float = 0.002
    dropped: float = 0.01
    variance: float = 0.0025
    at_least: float = 0.7
    softness: float = 0.1
    threshold: float = 0.0
    steps: int = 300
    substeps: int = 5
    cycles: int = 12

    def __post_init__(self) -> None:
        if self.simulator not in ("auto", "contact", "kinematic"):
            raise SettingError(f"simulator: got {self.simulator!r}, expected 'auto', 'contact' or 'kinematic'.")

    @property
    def contact(self) -> bool:
        """Whether the physics engine is used."""
        return self.simulator == "contact" or (self.simulator == "auto" and has_physics())

    @property
    def extra(self) -> Plate | None:
        """The further plate."""
        return None if self.plate is None else Plate(*self.plate)


def run(settings: Settings | None = None, workers: int = 1, progress: Progress | None = None) -> Result:
    """Run the washing experiment.

    Parameters
    ----------
    settings : Settings, optional
    workers : int
        Processes; the numbers do not depend on it.
    progress : callable, optional
        Called with (done, of) after each split that was learnt from and each plate that the arm wiped.

    Returns
    -------
    Result
        One row for each method and surface (and each kind of normal, on real
        recordings), and the reproductions on the arm; ``details["splits"]``
        is a list of :class:`Split`, ``details["reproductions"]`` one of
        :class:`Reproduction`, empty without physics.

    Raises
    ------
    SettingError
        If the arm does not reach ``plate``.
    """
    chosen = settings or Settings()
    if chosen.contact and chosen.extra is not None:
        arm.check_reach(chosen.extra)
    calls: list[tuple[Any, ...]] = (
        [(chosen, *split) for split in surfaces.recorded_splits(chosen)]
        if chosen.real
        else [(chosen, seed) for seed in np.random.SeedSequence(chosen.seed).spawn(chosen.trials)]
    )
    plates = arm.plates(chosen)
    wipes = len(plates) * (1 if chosen.real else chosen.trials)
    learnt = run_trials(learning.learn if chosen.real else learning.simulate_and_learn, calls, workers,
                        _from(progress, 0, len(calls) + wipes))  # fmt: skip
    wiped = run_trials(arm.reproduce, arm.jobs(chosen, plates, learnt), workers,
                       _from(progress, len(calls), len(calls) + wipes))  # fmt: skip
    return Result(
        "washing",
        chosen,
        learning.recorded_rows(learnt) if chosen.real else learning.simulated_rows(learnt),
        {"splits": learnt if chosen.real else learnt[:1], "reproductions": wiped[: len(plates)]},
        {"reproduction": [one.row() for one in wiped]},
    )


def verdict(result: Result) -> uc.evaluation.verdicts.Verdict:
    """What the default learner makes of surfaces that nobody showed it, against ordinary regression."""
    verdicts = uc.evaluation.verdicts
    unseen = [row for row in result.rows if not row["seen"]]
    ours, direct = (np.mean([row["ncpe"] for row in unseen if row["method"] == one]) for one in ("robust", "direct"))
    mark = verdicts.Mark.DOUBTFUL if ours < CLOSE * direct else verdicts.Mark.BAD
    mark = verdicts.Mark.GOOD if 2 * ours < direct else mark
    said = f"On surfaces that nobody showed it, the default learner misses {ours:.2%} of the motion, "
    times = f"{direct / ours:.1f} times less than" if ours < direct else f"{ours / direct:.1f} times as much as"
    said += f"{times if max(ours / direct, direct / ours) > CLOSE else 'about as much as'} ordinary regression."
    real = result.settings.real  # type: ignore[attr-defined]
    kind = "recorded tilts, one left out at a time" if real else "simulated plates"
    doubt, then = "Far from where anybody wiped: all learners guess there.", "unconstrain example wiping"
    return verdicts.Verdict(mark, said, f"Movement along surfaces like these ({kind}).", doubt, then)


def headlines(result: Result) -> list[str]:
    """How the methods do on surfaces that they have not seen, and the arm with the hybrid, in a sentence for each."""
    unseen = [row for row in result.rows if not row["seen"]]
    said = [] if result.settings.contact else [WITHOUT_PHYSICS]  # type: ignore[attr-defined]
    for error, label in (("ncpe", "nCPE"), ("nupe", "nUPE")):
        for kind in dict.fromkeys(row.get("normal") for row in unseen):
            of_kind = [row for row in unseen if row.get("normal") == kind and row[error] is not None]
            methods = dict.fromkeys(row["method"] for row in of_kind)
            means = {m: float(np.mean([row[error] for row in of_kind if row["method"] == m])) for m in methods}
            if means:
                of = "" if kind is None else f" with the {kind} normals"
                values = ", ".join(f"{method} {mean:.4f}" for method, mean in means.items())
                ratio = means["hybrid"] / means["direct"]
                better = means["hybrid"] / min(means["direct"], means["inconsistency"])
                said.append(
                    f"{label} on unseen surfaces{of}, mean: {values}; hybrid is {ratio:.2f} times direct, "
                    f"{better:.2f} times the better of the two; robust, with nothing to set, is "
                    f"{means['robust'] / means['direct']:.2f} times direct{_at_best(means)}"
                )
    return said + [_said(name, rows) for name, rows in _by_surface(result.tables["reproduction"]).items()]


def _at_best(means: Mapping[str, float]) -> str:
    if learning.BEST not in means:
        return ""
    least = means[learning.BEST] / means["direct"]
    return f", where the best of its candidates, known only afterwards, would be {least:.2f} times direct"


WITHOUT_PHYSICS = (
    "These demonstrations come from the kinematic stand-in, and no arm wipes: contact needs MuJoCo and mink. "
    "Install it with: pip install 'unconstrain[sim]'"
)
"""What is said where the extra is missing."""


def _by_surface(rows: Sequence[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    names = dict.fromkeys(row["surface"] for row in rows)
    return {name: [row for row in rows if row["surface"] == name] for name in names}


def _said(surface: str, rows: list[dict[str, Any]]) -> str:
    failed = [row["failed"] for row in rows if row["failed"]]
    done = [row for row in rows if not row["failed"]]
    if not done:
        return f"the arm on {surface}: {failed[0]}"
    contact = min(row["contact_share"] for row in done)
    steadiness = max(row["force_sd"] / row["force_mean"] for row in done)
    drift = max(row["drift_m"] for row in done)
    off = max(abs(row["frequency"] / row["frequency_demonstrated"] - 1.0) for row in done)
    wider = max((row["spread_m"] / row["spread_demonstrated_m"] - 1.0 for row in done), key=abs)
    often = f" in {len(rows)} runs, the worst" if len(rows) > 1 else ""
    return (
        f"the arm on {surface} ({'seen' if done[0]['seen'] else 'unseen'}){often}: contact {contact:.1%}, "
        f"force s.d./mean {steadiness:.3f}, frequency off by {off:.1%}, radius by {wider:+.1%}, "
        f"drift {1000 * drift:.1f} mm, {min(row['speed'] for row in done):.0f} times real time"
        + (f"; {len(failed)} failed: {failed[0]}" if failed else "")
    )


def _from(progress: Progress | None, offset: int, total: int) -> Progress | None:
    """The same progress for a part of the whole."""
    return None if progress is None else lambda done, _: progress(offset + done, total)
