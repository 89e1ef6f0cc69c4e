"""Locally linear policies (section III-D)."""

from typing import Literal, cast

from numpy.typing import ArrayLike

from ..base.arrays import as_matrix
from ..learners import Learner
from ..models import Affine, Model, ReceptiveFields, spaces
from ..training import FirstLook, Validation
from .base import Asked, Policy


class LocallyLinearPolicy(Policy):
    """Linear models in Gaussian receptive fields, averaged by their weights (section III-D).

    Each is learnt on its own, its threshold too, on ``((x − c_m) / σ, 1)``: centred on the field and free of units.

    Parameters
    ----------
    variance : float, "cubic", "auto" or None
        The fields' σ². None is a quarter of the states' total variance, more where that takes over 100 fields. Infinity
        is one affine model for all states, "cubic" one of third degree. "auto" takes these two, then the default, then
        halves of it, down to a sixteenth, until two in turn are worse by estimated error, in four times as long.
    at_least : float
        Fields are added until every sample has at least this weight in one.
    centres : array_like, shape (M, n), optional
        Use these instead.
    learner, validation, space, scale : optional
        As in :class:`~unconstrain.ParametricPolicy`.

    Attributes
    ----------
    solution_ : Solution
        Weights (M, d, n + 1) over ``((x − origin) / σ, 1)``, with one origin, and what the data determined; of a cubic
        model (1, d, p) over its monomials.
    fields_ : ReceptiveFields
        The fields in use, among the coordinates of the state space; around one model for all, those of support.
    variance_ : float or "cubic"
        Their σ², infinity for one affine model.

    Examples
    --------
    >>> states = np.random.default_rng(0).normal(size=(40, 2))
    >>> actions = -states * np.eye(2)[np.arange(40) % 2]  # now one coordinate is held, now the other
    >>> uc.LocallyLinearPolicy(9.0, learner="hybrid").fit(states, actions).predict([[1.0, 2.0]]).round(3)
    array([[-1., -2.]])
    """

    _usual = Model.USUAL

    def __init__(
        self,
        variance: float | Literal["auto", "cubic"] | None = "auto",
        at_least: float = 0.7,
        centres: ArrayLike | None = None,
        learner: Learner | str | None = None,
        validation: Validation | None = None,
        space: spaces.Space | None = None,
        scale: Asked = None,
    ) -> None:
        self.variance = variance
        self.at_least = at_least
        self.centres = centres
        self.learner = learner
        self.validation = validation
        self.space = space
        self.scale = scale

    def places(self, look: FirstLook) -> dict[str, Model]:
        """Lay fields of each variance over the states seen at first look; regressors share one origin."""
        centres = None if self.centres is None else as_matrix(self.centres, "centres")
        if centres is not None and self.scale_ is not None:
            centres = self.scale_.state(centres)
        return Model.of_widths(look.states, look.actions, self.variance, self.at_least, centres, look.embedding)

    @property
    def fields_(self) -> ReceptiveFields:
        """The fields in use."""
        fields = self._fitted_model().fields
        return cast(ReceptiveFields, getattr(fields, "around", fields))

    @property
    def variance_(self) -> float | Literal["cubic"]:
        """Their σ², infinity for one affine model."""
        model = self._fitted_model()
        return model.fields.variance if isinstance(model.features, Affine) else "cubic"
