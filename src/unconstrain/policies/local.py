"""Locally linear policies (section III-D)."""

from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import as_matrix
from ..learners import Learner
from ..models import Affine, Model, ReceptiveFields, choose_variance, cover
from ..training import FirstLook, Validation
from .base import Policy


class LocallyLinearPolicy(Policy):
    """Linear models in Gaussian receptive fields, averaged by their weights (section III-D).

    Each local model is learnt on its own, its threshold too. Its regressors
    are ``((x − c_m) / σ, 1)``: centred on the field and free of units.

    Parameters
    ----------
    variance : float, optional
        The fields' σ², in squared units of the state. By default a quarter of
        the states' total variance, more where that takes over 100 fields.
    at_least : float
        Fields are added until every sample has at least this weight in one.
    centres : array_like, shape (M, n), optional
        Use these instead.
    learner : Learner or str, optional
        Or its name: "robust", "hybrid", "inconsistency", "direct"; :class:`~unconstrain.Hybrid` by default.
    validation : Folds or HeldOut, optional
        What the learner chooses its thresholds on; ten folds by default.

    Attributes
    ----------
    solution_ : Solution
        Weights (M, d, n + 1) over ``((x − origin) / σ, 1)``, with one origin
        for all fields, and what the data determined.
    fields_ : ReceptiveFields
        The fields in use.
    """

    def __init__(
        self,
        variance: float | None = None,
        at_least: float = 0.7,
        centres: ArrayLike | None = None,
        learner: Learner | str | None = None,
        validation: Validation | None = None,
    ) -> None:
        self.variance = variance
        self.at_least = at_least
        self.centres = centres
        self.learner = learner
        self.validation = validation

    def place(self, look: FirstLook) -> Model:
        """Lay fields over the states seen at first look; regressors share one origin."""
        states = look.different
        variance = self.variance if self.variance is not None else choose_variance(states, self.at_least)
        if self.centres is None:
            fields = cover(states, variance, self.at_least)
        else:
            fields = ReceptiveFields(as_matrix(self.centres, "centres"), variance)
        return Model(Affine(fields.centres.mean(axis=0), np.sqrt(variance)), fields)

    @property
    def fields_(self) -> ReceptiveFields:
        """The fields in use."""
        return cast(ReceptiveFields, self._fitted_model().fields)
