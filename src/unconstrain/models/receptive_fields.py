"""Receptive fields: membership of states in local models (section III-D), or in a single one."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ..base.arrays import SMALLEST_VARIANCE, Array, as_matrix, beside, check_at_least, is_foreign, namespace
from ..base.errors import SettingError
from .features import Affine, FeatureMap, Kernels, gaussian, shares, squared_distances
from .formula import ClosedForm
from .spaces import Embedding

MOST_FIELDS = 100
"""Most fields that :func:`choose_variance` accepts before it widens them."""


class ReceptiveFields(Kernels):
    """Isotropic Gaussian fields, ``w_m(x) = exp(−‖x − c_m‖² / 2σ²)``.

    Parameters
    ----------
    centres : array_like, shape (M, n)
    variance : float
        The fields' σ², in squared units of the state.

    Examples
    --------
    >>> fields = uc.ReceptiveFields([[0.0], [1.0]], variance=0.5)
    >>> fields.shares(np.array([[0.5]]))
    array([[0.5, 0.5]])
    """

    def weights(self, states: Array) -> Array:
        """Membership of each state in each field, the w of eq. 14, shape (N, M)."""
        return gaussian(squared_distances(states, self.centres), self.variance)

    def shares(self, states: Array) -> Array:
        """Memberships normalised over the fields, shape (N, M)."""
        return shares(states, self.centres, self.variance)

    def blend(self, features: Array, weights: Array, states: Array) -> Array:
        """Predictions of models with weights (M, d, p), averaged by their shares, shape (N, d)."""
        each = namespace(states).tensordot(features, beside(weights, states), axes=((1,), (2,)))  # (N, M, d)
        if is_foreign(each):
            return (self.shares(states)[:, None, :] @ each)[:, 0, :]
        return np.einsum("nm,nmd->nd", self.shares(states), each)  # NumPy is slow at many small products

    def centring(self, features: FeatureMap, embedding: Embedding) -> Array:
        """``T_m`` (M, p', p) that centres affine features on each field: ``T_m φ(c_m) = (0, 1)``.

        With axes J_m at the centres, ``T_m φ(x) = (J_m (x − c_m) / σ, 1)``. Sums over common features are one
        product for all fields; centring each field afterwards is exact.
        """
        axes, offsets = embedding.axes(self.centres), -features(self.centres)[:, :-1]
        models, count, size = axes.shape
        centring = np.zeros((models, count + 1, size + 1))
        centring[:, :count, :size], centring[:, count, size] = axes, 1.0
        centring[:, :count, size] = (axes @ offsets[:, :, None])[:, :, 0]
        return centring

    def formula(self, features: FeatureMap, weights: Array) -> ClosedForm | None:
        """Closed form of affine models with weights (M, d, n + 1)."""
        if not isinstance(features, Affine):
            return None
        origin, scale = np.asarray(features.centre), features.scale
        maps = np.concatenate([weights[..., :-1] / scale, weights[..., -1:]], axis=2)
        return self.blend_of(origin, maps)


@dataclass(frozen=True)
class Everywhere:
    """One field that is 1 at every state, as wide as can be: the policy is a single model.

    Parameters
    ----------
    around : ReceptiveFields, optional
        Fields over the data, which measure support where features do not.
    """

    around: ReceptiveFields | None = None
    variance: ClassVar[float] = np.inf

    @property
    def support(self) -> Callable[[Array], Array] | None:
        """Support of states by the data; None where only features can tell it."""
        return None if self.around is None else self.around.support

    def weights(self, states: Array) -> Array:
        """Membership of each state, ones of shape (N, 1)."""
        return namespace(states).ones_like(states[:, :1])

    shares = weights

    def blend(self, features: Array, weights: Array, states: Array) -> Array:
        """Predictions of the one model with weights (1, d, p), shape (N, d)."""
        return features @ beside(weights[0].T, states)

    def centring(self, features: FeatureMap, embedding: Embedding) -> None:
        """Features of a single model stay as they are."""

    def formula(self, features: FeatureMap, weights: Array) -> ClosedForm | None:
        """Closed form of the features with weights (1, d, p), where they offer one; with the fields for support."""
        closed_form = getattr(features, "closed_form", None)
        form: ClosedForm | None = None if closed_form is None else closed_form(weights[0])
        if form is None or form.exponents is not None or self.around is None:
            return form
        return replace(self.around.blend_of(form.origin, form.maps), monomials=form.monomials)


def cover(states: Array, variance: float, at_least: float = 0.7) -> ReceptiveFields:
    """Place fields on the samples so that each sample has a least membership in one of them.

    Farthest-first traversal: the first centre is the sample nearest to the mean, each further one the sample farthest
    from all centres, until every sample has ``w_m(x) ≥ at_least`` for some m (section IV-B).

    Parameters
    ----------
    states : array_like, shape (N, n)
    variance : float
        The fields' σ².
    at_least : float
        The membership to reach, between 0 and 1.

    Raises
    ------
    SettingError
        If the membership is not between 0 and 1 or the variance is not positive.

    Examples
    --------
    >>> uc.cover(np.linspace(0, 1, 50)[:, None], variance=0.1)
    ReceptiveFields(3 centres in 1 dimension, variance=0.1)
    """
    return _cover(as_matrix(states, "states"), variance, at_least, most=None)


def choose_variance(states: Array, at_least: float = 0.7, most: int = MOST_FIELDS) -> float:
    """Choose a variance for fields that cover these states.

    A quarter of the states' total variance, doubled until ``most`` fields suffice.
    Returns 1 where the states do not vary.
    """
    total = float(states.var(axis=0).sum())
    # A variance below that of rounding the mean counts as none.
    least = max((1e-12 * np.abs(states).max()) ** 2, 8 * SMALLEST_VARIANCE)
    variance = total / 4 if total > least else 1.0
    while len(_cover(states, variance, at_least, most).centres) > most:
        variance *= 2
    return variance


def _cover(states: Array, variance: float, at_least: float, most: int | None) -> ReceptiveFields:
    if not 0.0 < at_least < 1.0:
        raise SettingError(f"at_least: got {at_least!r}, expected a membership between 0 and 1.")
    check_at_least("variance", variance, SMALLEST_VARIANCE, strict=True)
    reach = -2.0 * variance * np.log(at_least)
    chosen = [int(((states - states.mean(axis=0)) ** 2).sum(axis=1).argmin())]
    nearest = ((states - states[chosen[0]]) ** 2).sum(axis=1)
    while nearest.max() > reach and (most is None or len(chosen) <= most):
        chosen.append(int(nearest.argmax()))
        np.minimum(nearest, ((states - states[chosen[-1]]) ** 2).sum(axis=1), out=nearest)
    return ReceptiveFields(states[chosen], variance)
