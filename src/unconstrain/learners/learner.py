"""What every learner is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from ..base.parameters import Parameters
from ..training import Training
from .solution import Solution


class Learner(Parameters, ABC):
    """Turns what was observed into a solution. A learner of your own is one method.

    Learners are dataclasses; their fields are their settings.
    """

    needs_samples: ClassVar[bool] = False
    """Whether it looks at ``training.samples``, which are then kept, or at the sums in ``training.folds`` alone."""

    @abstractmethod
    def learn(self, training: Training) -> Solution:
        """Learn from everything, choosing settings on the folds.

        Parameters
        ----------
        training : Training
            ``training.folds`` are the moments of each fold, over the features ``T_m φ``.

        Returns
        -------
        Solution
            With weights (M, d, p) over these features.
        """
