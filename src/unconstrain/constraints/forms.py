"""Which functions of the state a constraint is made of: ``A(x) = Σ φ_i(x) a_iᵀ Φ(x)``.

The features φ say how A may change with the state, and the chart Φ what it acts on. With ``A = Λ(x) J(x)`` the chart is
the Jacobian; of a surface ``h(x) = θᵀψ(x) = 0`` it is Dψ, since ``A = ∇h``; otherwise it is the identity.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..base.arrays import Array, namespace, on_host
from ..base.errors import SettingError
from ..models import Affine, Everywhere, FeatureMap, KMeansRBF, Model, Placeable, Polynomial

MOST_COEFFICIENTS = 200
"""Constraints of more coefficients are not chosen from, nor of more than half as many as there are numbers."""

Jacobian = Callable[[Array], Array]
"""States (N, n) to matrices (N, r, d)."""


@dataclass(frozen=True)
class Constant:
    """The one feature that is 1 at every state."""

    def __call__(self, states: Array) -> Array:
        """Ones, shape (N, 1)."""
        return namespace(states).ones_like(states[:, :1])


@dataclass(frozen=True, eq=False)
class Velocities:
    """The chart J of actions: v = J u, or the action itself.

    Parameters
    ----------
    jacobian : callable, optional
        States (N, n) to matrices (N, r, d).
    task : bool
        Whether ``A u = b(x)`` rather than zero. Then −1 is added to v, with b for its coefficient and no part in |A|.
    """

    jacobian: Jacobian | None = None
    task: bool = False
    margin: ClassVar[float] = 0.0
    """Logarithm of how much less a more flexible form has to miss."""

    def lift(self, states: Array, actions: Array) -> tuple[Array, Array | None]:
        """``(J u, −1)`` and J, with a row of zeros for the task."""
        if self.jacobian is None and not self.task:
            return actions, None
        table = on_host(actions)
        matrices = self._matrices(on_host(states), table.shape[1])
        motions = np.einsum("nrd,nd->nr", matrices, table)
        if not self.task:
            return motions, matrices
        ones, nothing = np.ones_like(motions[:, :1]), np.zeros_like(matrices[:, :1])
        return np.concatenate([motions, -ones], axis=1), np.concatenate([matrices, nothing], axis=1)

    def _matrices(self, states: Array, actions: int) -> Array:
        if self.jacobian is None:
            return np.broadcast_to(np.eye(actions), (len(states), actions, actions))
        found = np.asarray(self.jacobian(states), np.float64)
        if found.ndim != 3 or found.shape[::2] != (len(states), actions) or not np.isfinite(found).all():
            raise SettingError(
                f"jacobian: got an array of shape {found.shape} for {len(states)} states, expected finite numbers of "
                f"shape ({len(states)}, r, {actions}), a column for each action."
            )
        return found


@dataclass(frozen=True, eq=False)
class Surface:
    """The chart Dψ of states on ``h(x) = θᵀψ(x) = 0``, with v = ψ(x): to first order the nearest surface [1]_.

    Parameters
    ----------
    levels : FeatureMap
        ψ.
    step : ndarray, shape (n,)
        Of the central differences that find Dψ; exact to rounding for polynomials of degree two.

    References
    ----------
    .. [1] G. Taubin. Estimation of planar curves, surfaces, and nonplanar space curves defined by implicit equations.
       *IEEE Transactions on Pattern Analysis and Machine Intelligence* 13(11), 1991.
    """

    levels: FeatureMap
    step: Array
    margin: ClassVar[float] = 2.0
    """Two sheets about one surface are nearer to noisy states than it is: by e to the −1 to −1.5, of mean squares."""

    def lift(self, states: Array, actions: Array) -> tuple[Array, Array]:
        """``ψ(x)`` and ``Dψ(x)``."""
        table = on_host(states)
        sides = [self.levels(table + way) - self.levels(table - way) for way in np.diag(self.step)]
        return self.levels(table), np.stack(sides, axis=2) / (2.0 * self.step)


@dataclass(frozen=True, eq=False)
class Lifted:
    """Some samples in the terms of a form: φ (N, p), v (N, r), and Φ (N, r, d), None for the identity."""

    features: Array
    motions: Array
    matrices: Array | None

    def at(self, rows: Any) -> Lifted:
        """Some of the samples."""
        return Lifted(self.features[rows], self.motions[rows], None if self.matrices is None else self.matrices[rows])

    def fields(self, coefficients: Array) -> Array:
        """Rows of K constraints of coefficients (p r, K), as they act on v, shape (N, K, r)."""
        by_feature = coefficients.reshape(self.features.shape[1], -1)  # (p, r K)
        shape = len(self.features), self.motions.shape[1], coefficients.shape[1]
        return (self.features @ by_feature).reshape(shape).swapaxes(1, 2)

    def acting(self, fields: Array) -> Array:
        """The same as they act on actions, shape (N, K, d)."""
        return fields if self.matrices is None else fields @ self.matrices


@dataclass(frozen=True, eq=False)
class Form:
    """One form of a constraint, of the features φ of a model and a chart Φ."""

    model: Model
    chart: Velocities | Surface

    @classmethod
    def of(cls, features: FeatureMap, chart: Velocities | None, states: Array) -> Form:
        """The form of some features; without a chart they are the ψ of a surface through the states."""
        if chart is not None:
            return cls(Model(features, Everywhere()), chart)
        spread = states.std(axis=0)
        surface = Surface(features, 1e-4 * np.where(spread > 0.0, spread, 1.0))
        return cls(Model(Constant(), Everywhere()), surface)

    @property
    def constant(self) -> bool:
        """Whether one set of coefficients holds at all states, in the chart."""
        return isinstance(self.model.features, Constant)

    def lift(self, states: Array, actions: Array) -> Lifted:
        """Samples of any array library; where Φ is not the identity, as NumPy's."""
        phi, (motions, matrices) = self.model.design(states), self.chart.lift(states, actions)
        return Lifted(phi if matrices is None else on_host(phi), motions, matrices)

    def roughness(self, samples: Lifted) -> Array:
        """``R ⊗ I`` of the features' roughness R, of trace one, or zero; shape (P, P)."""
        rough = self.model.roughness(1, samples.features.shape[1])[0]
        whole = np.kron(rough, np.eye(samples.motions.shape[1]))
        return whole / max(float(np.trace(whole)), np.finfo(float).tiny)


NAMED: Mapping[str, Callable[[], FeatureMap | Placeable]] = {
    "constant": Constant,
    "affine": Affine,
    "quadratic": lambda: Polynomial(2),
    "rbf": KMeansRBF,
}
"""Features by name, from the simplest on."""


def forms_of(
    features: FeatureMap | Placeable | str, chart: Velocities | None, states: Array, actions: int
) -> dict[str, Form]:
    """Forms to choose from, by name, with their features placed on some states (N, n).

    Without a chart the features are those of a surface, and A is its gradient.

    Raises
    ------
    SettingError
        If there are no features of that name.
    """
    asked = _asked(features)
    if chart is None:
        asked.pop("constant", None)
    if not asked:
        raise SettingError("features: got 'constant', and the height above a surface varies: 'affine' is a plane.")
    made = {name: Form.of(placed(one, states), chart, states) for name, one in asked.items()}
    most = min(MOST_COEFFICIENTS, len(states) * actions // 2)
    sizes = {name: one.lift(states[:1], np.ones((1, actions))) for name, one in made.items()}
    few = {name: made[name] for name, one in sizes.items() if one.features.size * one.motions.size <= most}
    return few if len(made) > 1 and few else made


def placed(features: FeatureMap | Placeable, states: Array) -> FeatureMap:
    """The feature map to use, placed on some states where it depends on data."""
    return features.place(states) if isinstance(features, Placeable) else features


def _asked(features: FeatureMap | Placeable | str) -> dict[str, FeatureMap | Placeable]:
    if not isinstance(features, str):
        return {"": features}
    if features not in (*NAMED, "auto"):
        raise SettingError(f"features: got {features!r}, expected a feature map, 'auto', or one of {', '.join(NAMED)}.")
    return {name: made() for name, made in NAMED.items() if features in (name, "auto")}
