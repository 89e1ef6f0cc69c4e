"""Least-squares regression on the observed actions."""

from dataclasses import dataclass

import numpy as np

from ..risks import SECONDARY_NOISE, eigensystem, minimum, standard_risk, unvec
from ..training import Training
from .learner import Learner
from .solution import Solution


@dataclass(frozen=True)
class Direct(Learner):
    """Minimise the standard risk alone: least-squares regression on the observed actions (eq. 5).

    Examples
    --------
    >>> states = np.array([[0.0], [1.0], [2.0]])
    >>> uc.ParametricPolicy(uc.Affine(), uc.Direct()).fit(states, -states).predict([[3.0]])
    array([[-3.]])
    """

    def learn(self, training: Training) -> Solution:
        """Learn from all folds; there is no setting to choose."""
        whole = training.folds.whole
        models, d, p = whole.cross.shape
        spectrum, _ = eigensystem(whole.gram)
        rank = (spectrum > SECONDARY_NOISE * spectrum[:, -1:]).sum(axis=1)
        weights = unvec(minimum(standard_risk(whole)), d)
        return Solution(weights, d * rank, d * p, np.zeros(models), method="direct")
