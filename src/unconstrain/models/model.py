"""Model of a policy: features and receptive fields, without weights."""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import BLOCK_ROWS, Array, as_matrix, is_foreign, namespace, slices
from ..base.display import Shown
from ..base.errors import SettingError
from .features import Affine, FeatureMap, KMeansRBF, Placeable, Polynomial
from .formula import ClosedForm
from .receptive_fields import MOST_FIELDS, Everywhere, ReceptiveFields, choose_variance, cover
from .spaces import Embedding

MOST_WEIGHTS = 500
"""Models of more weights are not chosen from."""

NARROWER = (1, 2, 4, 8, 16)
"""Variances of fields that are tried, as shares of the default one."""

SUPPORTED = 1e-3
"""Support below which no demonstration came near, and a policy extrapolates."""

_ROWS = 4096
"""Rows that are predicted together, so that temporaries stay in cache."""

_STATES = Embedding()
"""States as they are."""


@dataclass(frozen=True, eq=False, repr=False)
class Model(Shown):
    """M linear models on common features, blended by their fields: ``π̃(x) = Σ_m s_m(x) W_m φ(x)``.

    A parametric policy (section III-C) has M = 1 and a field that is 1
    everywhere; a locally linear one (section III-D) has affine features.

    Parameters
    ----------
    features : FeatureMap
        φ, coordinates (N, m) to features (N, p).
    fields : ReceptiveFields or Everywhere
        Membership of coordinates in the M models.
    embedding : Embedding
        States (N, n) to coordinates (N, m): the states themselves, unless some are angles or orientations.

    Attributes
    ----------
    centring : ndarray, shape (M, p', p), or None
        ``T_m``: model m is solved in the features ``T_m φ``, for numerical accuracy, and on a curved space along
        its axes at the centre of the field; None for φ itself.

    Examples
    --------
    >>> model = uc.Model.local(np.linspace(0, 1, 50)[:, None], variance=0.1)
    >>> model.shares(np.array([[0.5]])).sum(axis=1)
    array([1.])
    """

    features: FeatureMap
    fields: ReceptiveFields | Everywhere
    embedding: Embedding = _STATES
    centring: Array | None = field(init=False, repr=False)
    USUAL: ClassVar[str] = "1/1"

    def __post_init__(self) -> None:
        object.__setattr__(self, "centring", self.fields.centring(self.features, self.embedding))

    @classmethod
    def local(
        cls,
        coordinates: Array,
        variance: float | Literal["cubic"] | None = None,
        at_least: float = 0.7,
        centres: ArrayLike | None = None,
        embedding: Embedding = _STATES,
    ) -> Self:
        """Affine models in receptive fields over some coordinates, on regressors of one origin (section III-D).

        A variance of infinity is one model everywhere, "cubic" one of third degree.
        """
        everywhere = variance == "cubic" or variance == np.inf
        width = choose_variance(coordinates, at_least) if variance is None or everywhere else cast(float, variance)
        if centres is None:
            fields = cover(coordinates, width, at_least)
        else:
            fields = ReceptiveFields(embedding(as_matrix(centres, "centres")), width)
        affine = Affine(fields.centres.mean(axis=0), np.sqrt(width))
        features = Polynomial(3).place(coordinates) if variance == "cubic" else affine
        return cls(features, Everywhere(fields) if everywhere else fields, embedding)

    @classmethod
    def to_choose_from(cls, coordinates: Array, actions: int, embedding: Embedding = _STATES) -> dict[str, Self]:
        """Affine, quadratic, cubic and RBF features over some coordinates, and local models, by name.

        Without those of more than :data:`MOST_WEIGHTS` weights, or more than half as many as there are numbers.
        """
        every: dict[str, Placeable] = {
            "affine": Affine(),
            "quadratic": Polynomial(2),
            "cubic": Polynomial(3),
            "rbf": KMeansRBF(),
        }
        placed = {name: cls(one.place(coordinates), Everywhere(), embedding) for name, one in every.items()}
        few = {name: one for name, one in placed.items() if one._is_small(coordinates, actions)}
        return {"affine": placed["affine"]} | few | {"local": cls.local(coordinates, embedding=embedding)}

    def _is_small(self, coordinates: Array, actions: int) -> bool:
        """Whether it has at most :data:`MOST_WEIGHTS` weights, and half as many as there are numbers."""
        try:
            weights = actions * self.features(coordinates[:1]).shape[1]
        except SettingError:  # more monomials than there may be
            return False
        return weights <= min(MOST_WEIGHTS, coordinates.shape[0] * actions // 2)

    @classmethod
    def of_widths(
        cls,
        coordinates: Array,
        actions: int,
        variance: float | Literal["auto", "cubic"] | None,
        at_least: float = 0.7,
        centres: ArrayLike | None = None,
        embedding: Embedding = _STATES,
    ) -> dict[str, Self]:
        """Local models of a variance, or for "auto" several by name, each finer than the one before.

        Unless centres are given, one affine and one cubic model for all states, the latter where its weights are at
        most half as many as the numbers seen; fields of the default variance, ``USUAL``; and narrower ones, up to
        :data:`MOST_FIELDS`.
        """
        if variance != "auto":
            return {"": cls.local(coordinates, variance, at_least, centres, embedding)}
        widest = choose_variance(coordinates, at_least)
        found = {}
        if centres is None:
            affine = cls.local(coordinates, np.inf, at_least, embedding=embedding)
            cubic = replace(affine, features=Polynomial(3).place(coordinates))
            found = {"affine": affine} | ({"cubic": cubic} if cubic._is_small(coordinates, actions) else {})
        for share in NARROWER:
            one = cls.local(coordinates, widest / share, at_least, centres, embedding)
            if share > 1 and one.fields.shares(coordinates[:1]).shape[1] > MOST_FIELDS:
                break
            found[f"1/{share}"] = one
        return found

    def design(self, states: Array) -> Array:
        """Features of states (N, n), finite, shape (N, p).

        Raises
        ------
        SettingError
            If the features are not of that shape.
        """
        features = self.features(self.embedding(states))
        if np.ndim(features) != 2 or np.shape(features)[0] != states.shape[0]:
            raise SettingError(
                f"features: got an array of shape {tuple(np.shape(features))} for {states.shape[0]} states, "
                "expected (samples, features)."
            )
        return as_matrix(features, "features")

    def memberships(self, states: Array) -> Array:
        """Membership of states (N, n) in each model, shape (N, M)."""
        return self.fields.weights(self.embedding(states))

    def shares(self, states: Array) -> Array:
        """Memberships of states (N, n), normalised over the models, shape (N, M)."""
        return self.fields.shares(self.embedding(states))

    def predict(self, weights: Array, states: Array) -> Array:
        """Predict with weights (M, d, p) at states (N, n), shape (N, d)."""
        blocks = [states[rows, :] for rows in slices(states, BLOCK_ROWS if is_foreign(states) else _ROWS)]
        return namespace(states).concat(
            [self.fields.blend(self.design(block), weights, self.embedding(block)) for block in blocks]
        )

    def support(self, states: Array) -> Array:
        """Support of each state by the data, from 1 to 0 far away, shape (N,).

        Raises
        ------
        SettingError
            If neither fields nor features offer it.
        """
        measure = getattr(self.features, "support", None) or getattr(self.fields, "support", None)
        if measure is None:
            raise SettingError(f"support: {type(self.features).__name__} has no support(states).")
        return np.asarray(measure(self.embedding(states)))

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
                "linear policies, and parametric ones on Affine, Polynomial, NormalisedRBF or KMeansRBF features, or "
                "on features that offer closed_form(weights) -> unconstrain.ClosedForm."
            )
        return replace(form, embedding=self.embedding)

    def _summary(self) -> tuple[str, ...]:
        features = getattr(self.features, "__name__", type(self.features).__name__)
        return f"{features} features", str(self.fields)
