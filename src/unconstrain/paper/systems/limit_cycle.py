"""The toy system of section IV-A: a limit cycle in the plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.arrays import Array


@dataclass(frozen=True)
class LimitCycle:
    """Attractor with ``ṙ = r (ρ − r²)``, ``θ̇ = ω`` and ``x = (r sin θ, r cos θ)`` (eq. 18).

    As printed, so that the cycle's radius is √ρ.

    Parameters
    ----------
    rho : float
        ρ, m².
    omega : float
        ω, rad/s.
    """

    rho: float = 0.5
    omega: float = 1.0

    def __call__(self, states: Array) -> Array:
        """Velocity (N, 2) at positions (N, 2)."""
        pull = self.rho - (states**2).sum(axis=1, keepdims=True)
        turned = np.column_stack([states[:, 1], -states[:, 0]])
        return pull * states + self.omega * turned
