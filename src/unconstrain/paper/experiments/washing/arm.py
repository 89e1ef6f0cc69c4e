"""The learnt policy on the arm: on a plate that it was learnt from, and on plates that nobody showed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import unconstrain as uc

from ....base.arrays import Array
from ....base.errors import SettingError
from ... import simulation
from ...simulation.postures import postures_along
from ...simulation.reproduction import Wipe, turning
from ...systems.wiping import HELD_OUT, PLATES, Plate, WipingPolicy
from ..arrival.cycles import measured
from .learning import Split, fitted
from .surfaces import Surface, strokes

if TYPE_CHECKING:
    from . import Settings


SEEN = PLATES[3]
"""Of the plates that are learnt from, the arm wipes this one."""

NOT_RECORDED = Plate(-12.0, 24.0)
"""No recorded bout has a tilt near this one."""

TILTED = 45.0
"""A hand turns at another pace on surfaces that are tilted by more than this against the plate, degrees."""

MEASURES = (
    "contact_share", "force_mean", "force_sd", "frequency", "spread_m", "drift_m", "path_error_m", "cycles",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Reproduction:
    """The arm on one plate.

    Parameters
    ----------
    trial : int
    plate : Plate
    seen : bool
        Whether the policy was learnt from it.
    wipe : Wipe or None
        What the arm did; None where it could not.
    failed : str
        Why it could not.
    demonstration : Demonstration or None
        What the hand did on this plate, where that is known.
    frequency, spread : float
        Of the demonstrations, turns per second and m.
    """

    trial: int
    plate: Plate
    seen: bool
    wipe: Wipe | None
    failed: str
    demonstration: uc.Demonstration | None
    frequency: float
    spread: float

    def row(self) -> dict[str, Any]:
        """All that was measured, in plain units."""
        found: dict[str, Any] = dict.fromkeys(MEASURES) if self.wipe is None else dict(self.wipe.measures())
        return {
            "surface": self.plate.name,
            "seen": self.seen,
            "trial": self.trial,
            **found,
            "frequency_demonstrated": self.frequency,
            "spread_demonstrated_m": self.spread,
            "torque_share": None if self.wipe is None else self.wipe.torque_share,
            "speed": None if self.wipe is None else self.wipe.speed,
            "failed": self.failed,
        }


def plates(settings: Settings) -> list[Plate]:
    """Plates that the arm wipes; none without physics."""
    if not settings.contact:
        return []
    own = [NOT_RECORDED] if settings.real else [SEEN, *HELD_OUT]
    return own if settings.extra is None else [*own, settings.extra]


def check_reach(plate: Plate) -> None:
    """Refuse a plate on which the arm cannot wipe a circle, before anything long is begun."""
    angles = np.linspace(0.0, 2.0 * np.pi, 24)
    circle = WipingPolicy().radius * np.column_stack([np.cos(angles), np.sin(angles)]) @ plate.rotation[:, :2].T
    postures_along(circle, plate)


def jobs(settings: Settings, wiped: Sequence[Plate], splits: Sequence[Split]) -> list[tuple[Any, ...]]:
    """Arguments of :func:`reproduce`: each trial's default policy on each plate, or that of all recorded bouts."""
    if not settings.real:
        return [
            (
                settings,
                trial,
                split.policies["robust"],
                split.training,
                plate,
                _on(plate, split.surfaces),
                plate == SEEN,
            )
            for trial, split in enumerate(splits)
            for plate in wiped
        ]
    surfaces = [surface for split in splits for surface in split.held_out]
    policy = fitted(settings, surfaces)["robust"] if wiped else None
    return [(settings, 0, policy, near, plate, near, False) for plate in wiped for near in [_near(plate, surfaces)]]


def reproduce(
    settings: Settings,
    trial: int,
    policy: uc.Policy,
    training: Sequence[Surface],
    plate: Plate,
    shown: Sequence[Surface],
    seen: bool,
) -> Reproduction:
    """Let the arm wipe a plate with a policy that is guided onto the cycle of its demonstrations."""
    pairs = [
        (demo, normals["plane"])
        for surface in shown
        for demo, normals in zip(surface.demonstrations, surface.normals, strict=True)
    ]
    frequency = float(np.mean([_pace(demo, normal, settings) for demo, normal in pairs]))
    spread = float(np.mean([np.sqrt(demo.states.var(axis=0).sum()) for demo, _ in pairs]))
    wipe, failed = None, ""
    kept = uc.Guided(_in_the_loop(policy), orbit="shown", demonstrations=_on_cycle(settings, training))
    try:
        wipe = simulation.wipe(kept, plate, pairs[0][0].states[-1], settings.cycles / frequency)
    except SettingError as error:
        failed = str(error)
    demonstration = pairs[0][0] if not settings.real else None
    return Reproduction(trial, plate, seen, wipe, failed, demonstration, frequency, spread)


def _pace(demo: uc.Demonstration, normal: Array, settings: Settings) -> float:
    """Turns per second: counted in a bout, whose middle wanders, and from angular momentum in strokes put together."""
    return measured(demo.states, normal, 1.0 / settings.rate)["pace"] if settings.real else abs(turning(demo, normal))


def _in_the_loop(policy: uc.Policy) -> Callable[[Array], Array]:
    """The policy as a control loop calls it, one state at a time: ``predict`` spends most of its time on checks."""
    return lambda states: np.stack([policy.step(state) for state in states])


def _on_cycle(settings: Settings, surfaces: Sequence[Surface]) -> list[uc.Demonstration]:
    """Where people went round, and simulated strokes once they have swung in."""
    demos = [demo for surface in surfaces for demo in surface.demonstrations]
    return demos if settings.real else [one for demo in demos for one in strokes(settings).settled(demo)]


def _near(plate: Plate, surfaces: Sequence[Surface]) -> list[Surface]:
    """Surfaces that are tilted about as the plate, whose cycle and pace are kept; where there is none, all."""
    least, normal = np.cos(np.radians(TILTED)), plate.rotation[:, 2]
    near = [surface for surface in surfaces if abs(surface.normals[0]["plane"] @ normal) >= least]
    return near or list(surfaces)


def _on(plate: Plate, surfaces: Sequence[Surface]) -> list[Surface]:
    return [surface for surface in surfaces if surface.name == plate.name]
