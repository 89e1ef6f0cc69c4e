"""What every learner is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from ..base.parameters import Parameters
from ..risks import inconsistency, vec
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

    def solve(self, training: Training) -> Solution:
        """What was learnt, with weights over the features φ(x)."""
        return self.learn(training).over(training.model)

    def held_out_score(self, training: Training) -> float:
        """Share of the motion in each fold that is explained by what is learnt from the others.

        From the moments alone, each model by itself in its own field; NaN where there is nothing to hold out, or where
        the learner needs the samples.
        """
        filled = training.folds.filled
        if self.needs_samples or len(filled) < 2:
            return float("nan")
        missed = moved = 0.0
        for i in filled:
            part, rest = training.folds.parts[i], training.of_folds([j for j in filled if j != i])
            missed += float(np.clip(inconsistency(part)(vec(self.learn(rest).weights)), 0.0, None).sum())
            moved += float(part.energy.sum())
        return 1.0 - missed / moved if moved > 0 else float("nan")
