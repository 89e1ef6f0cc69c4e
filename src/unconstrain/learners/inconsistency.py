"""Least squares after projection onto each recorded action."""

from dataclasses import dataclass

from ..risks import Moments, Path, inconsistency, lexicographic_path
from ..training import Training
from .learner import Learner
from .solution import Solution
from .thresholds import Averaging, check_settings, solve_at_threshold


@dataclass(frozen=True)
class Inconsistency(Learner):
    """Minimise the inconsistency alone (eqs 4, 7 and 14, 15).

    Parameters
    ----------
    threshold : float, optional
        Truncate eigenvalues up to this share of the largest; weights along
        their eigenvectors are zero. 0 leaves out rounding errors only. None
        chooses by the inconsistency on held-out data.
    averaging
        See :class:`Hybrid`.

    Examples
    --------
    >>> states = np.random.default_rng(0).normal(size=(40, 2))
    >>> actions = -states * np.eye(2)[np.arange(40) % 2]  # now one coordinate is held, now the other
    >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Inconsistency()).fit(states, actions)
    >>> policy.predict([[1.0, 2.0]]).round(3)
    array([[-1., -2.]])
    """

    threshold: float | None = 0.0
    averaging: Averaging = "geometric"

    def __post_init__(self) -> None:
        check_settings(self.threshold, self.averaging)

    def learn(self, training: Training) -> Solution:
        """Learn from all folds, at a threshold that is given or chosen by cross-validation."""
        return solve_at_threshold(
            training.folds, _path, inconsistency, self.threshold, self.averaging, method="inconsistency"
        )


def _path(moments: Moments) -> Path:
    return lexicographic_path(inconsistency(moments))
