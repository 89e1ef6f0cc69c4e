"""Model of a policy: features and receptive fields, without weights."""

from dataclasses import dataclass, field

import numpy as np

from ..base.arrays import BLOCK_ROWS, Array, as_matrix, is_foreign, namespace, slices
from ..base.display import Shown
from ..base.errors import SettingError
from .features import FeatureMap
from .formula import ClosedForm
from .receptive_fields import Everywhere, ReceptiveFields

_ROWS = 4096
"""Rows that are predicted together, so that temporaries stay in cache."""


@dataclass(frozen=True, eq=False, repr=False)
class Model(Shown):
    """M linear models on common features, blended by their fields: ``π̃(x) = Σ_m s_m(x) W_m φ(x)``.

    A parametric policy (section III-C) has M = 1 and a field that is 1
    everywhere; a locally linear one (section III-D) has affine features.

    Parameters
    ----------
    features : FeatureMap
        φ, states (N, n) to features (N, p).
    fields : ReceptiveFields or Everywhere
        Membership of states in the M models.

    Attributes
    ----------
    centring : ndarray, shape (M, p, p), or None
        ``T_m``: model m is solved in the features ``T_m φ``, for numerical accuracy; None for φ itself.
    """

    features: FeatureMap
    fields: ReceptiveFields | Everywhere
    centring: Array | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "centring", self.fields.centring(self.features))

    def design(self, states: Array) -> Array:
        """Features of states (N, n), finite, shape (N, p).

        Raises
        ------
        SettingError
            If the features are not of that shape.
        """
        features = self.features(states)
        if np.ndim(features) != 2 or np.shape(features)[0] != states.shape[0]:
            raise SettingError(
                f"features: got an array of shape {tuple(np.shape(features))} for {states.shape[0]} states, "
                "expected (samples, features)."
            )
        return as_matrix(features, "features")

    def predict(self, weights: Array, states: Array) -> Array:
        """Predict with weights (M, d, p) at states (N, n), shape (N, d)."""
        blocks = [states[rows, :] for rows in slices(states, BLOCK_ROWS if is_foreign(states) else _ROWS)]
        return namespace(states).concat([self.fields.blend(self.design(block), weights, block) for block in blocks])

    def support(self, states: Array) -> Array:
        """Support of each state by the data, from 1 to 0 far away, shape (N,).

        Raises
        ------
        SettingError
            If neither fields nor features offer it.
        """
        measure = getattr(self.fields, "support", None) or getattr(self.features, "support", None)
        if measure is None:
            raise SettingError(f"support: {type(self.features).__name__} has no support(states).")
        return np.asarray(measure(states))

    def roughness(self, models: int, size: int) -> Array:
        """``R_m`` (M, p, p): ``wᵀ R_m w`` is the roughness of a policy of weights w; zero where features offer none."""
        measure = getattr(self.features, "roughness", None)
        return np.zeros((models, size, size)) if measure is None else measure()[None]

    def formula(self, weights: Array) -> ClosedForm:
        """Closed form of the policy of weights (M, d, p), for export.

        Raises
        ------
        SettingError
            If the features are a callable without ``closed_form``.
        """
        form = self.fields.formula(self.features, weights)
        if form is None:
            name = getattr(self.features, "__name__", type(self.features).__name__)
            raise SettingError(
                f"cannot export a policy on the features {name}: they are Python code. Can be exported are locally "
                "linear policies, and parametric ones on Affine, NormalisedRBF or KMeansRBF features, or on features "
                "that offer closed_form(weights) -> unconstrain.ClosedForm."
            )
        return form

    def _summary(self) -> tuple[str, ...]:
        features = getattr(self.features, "__name__", type(self.features).__name__)
        return f"{features} features", str(self.fields)
