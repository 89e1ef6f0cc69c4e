"""Policies on fixed features (section III-C)."""

from collections.abc import Mapping
from typing import Literal

from ..base.errors import SettingError
from ..learners import Learner
from ..models import Everywhere, FeatureMap, KMeansRBF, Model, Placeable, spaces
from ..training import FirstLook, Validation
from .base import Asked, Policy


class ParametricPolicy(Policy):
    """A policy that is linear in fixed features, ``π̃(x) = W b(x)`` (section III-C).

    Parameters
    ----------
    features : callable or "auto", optional
        A feature map, such as :class:`~unconstrain.NormalisedRBF` or :class:`~unconstrain.Polynomial`, or anything that
        maps (N, n) to (N, p). By default 25 normalised RBFs placed on the data. "auto" chooses among affine, quadratic
        and cubic features, these RBFs and local models by estimated error.
    learner : Learner or str, optional
        Or its name: "robust", "hybrid", "inconsistency", "direct"; :class:`~unconstrain.Robust` by default.
    validation : Folds or HeldOut, optional
        What the learner chooses its threshold on; ten folds by default.
    space : Space, optional
        Which states are angles or orientations (:mod:`unconstrain.spaces`); by default as the demonstrations say.
        Features then see coordinates: of an angle its cosine and sine, of an orientation its rotation matrix.
    scale : sequence of float or "auto", optional
        So much of each state, and of each action where they are not as many, is taken as one: ``(1000, 1)`` where
        millimetres are beside radians. "auto" finds it where columns are unlike (:mod:`~unconstrain.models.scale`).
        Predictions stay in the units of the data. For states without angles and orientations.

    Attributes
    ----------
    solution_ : Solution
        Weights (1, d, p) and what the data determined.
    features_ : callable
        The features in use.

    Examples
    --------
    >>> states = np.random.default_rng(0).normal(size=(40, 2))
    >>> actions = -states * np.eye(2)[np.arange(40) % 2]  # now one coordinate is held, now the other
    >>> uc.ParametricPolicy(uc.Affine(), "hybrid").fit(states, actions).predict([[1.0, 2.0]]).round(3)
    array([[-1., -2.]])
    """

    def __init__(
        self,
        features: FeatureMap | Placeable | Literal["auto"] | None = None,
        learner: Learner | str | None = None,
        validation: Validation | None = None,
        space: spaces.Space | None = None,
        scale: Asked = None,
    ) -> None:
        self.features = features
        self.learner = learner
        self.validation = validation
        self.space = space
        self.scale = scale

    def places(self, look: FirstLook) -> Mapping[str, Model]:
        """Lay the features over the states seen at first look, or all that are to be chosen from."""
        if isinstance(self.features, str) and self.features == "auto":
            return Model.to_choose_from(look.states, look.actions, look.embedding)
        features = self.features if self.features is not None else KMeansRBF()
        if not callable(features) and not isinstance(features, Placeable):
            raise SettingError(f"features: got {features!r}, expected 'auto' or a function of states.")
        placed = features.place(look.states) if isinstance(features, Placeable) else features
        return {"": Model(placed, Everywhere(), look.embedding)}
