"""Base class of the learners."""

from abc import ABC, abstractmethod
from typing import ClassVar, Self
from warnings import warn

from ..base.parameters import Parameters
from ..models import Model, Scale
from ..risks import inconsistency, vec
from ..training import Training
from .solution import Solution
from .thresholds import judged

LOST = "Samples of before are not stored: all is learnt from sums alone, less well, without uncertainty. Fit all anew."


class Learner(Parameters, ABC):
    """Computes a solution from training data. A subclass implements ``learn``.

    Learners are dataclasses; their fields are their settings.

    Examples
    --------
    >>> isinstance(uc.Hybrid(), uc.Learner), isinstance(uc.Robust(), uc.Learner)
    (True, True)
    """

    needs_samples: ClassVar[bool] = False
    """Whether ``learn`` cannot do without ``training.samples``, which are then kept, however many they are."""

    uses_samples: ClassVar[bool] = False
    """Whether ``learn`` uses ``training.samples`` where they are kept, and can do with the moments elsewhere."""

    @abstractmethod
    def learn(self, training: Training) -> Solution:
        """Learn from all folds; choose settings, if any, by cross-validation over them.

        Parameters
        ----------
        training : Training
            ``training.folds`` are the moments of each fold in the features ``T_m φ``.

        Returns
        -------
        Solution
            Weights (M, d, p) over these features.
        """

    def solve(self, training: Training, before: Solution | None = None) -> Solution:
        """The solution with weights over the features φ(x), in the units of what was given; ``before`` it another.

        Raises
        ------
        InvalidDataError
            If it is not finite.
        """
        found = self.learn(training).over(training.model)
        found = found.in_units(training.action_unit, training.weight_unit).checked()
        if self.uses_samples and before is not None and before.belief is not None and found.belief is None:
            warn(LOST, stacklevel=7)
        return found

    def within(self, scale: Scale) -> Self:
        """The same learner for states and actions in such units of a policy's own."""
        return self

    def takes(self, model: Model) -> bool:
        """Whether it can learn in a model, of several that a policy has to choose from."""
        return True

    def held_out_score(self, training: Training) -> float:
        """Cross-validated share of the squared motion explained: one minus the inconsistency over the energy.

        From the moments alone, each model evaluated in its own receptive field. NaN where nothing can be held out, or
        where the learner needs the samples.
        """
        folds = training.folds
        filled = folds.filled
        if self.needs_samples or len(filled) < 2:
            return float("nan")
        loss = energy = 0.0
        for i in filled:
            part, rest = folds.parts[i], training.of_folds([j for j in filled if j != i])
            loss += float(judged(inconsistency(part), vec(self.learn(rest).weights)).sum())
            energy += float(part.energy.sum())
        return 1.0 - loss / energy if energy > 0 else float("nan")
