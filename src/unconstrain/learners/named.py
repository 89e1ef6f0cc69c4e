"""Learners by name."""

from ..base.errors import SettingError
from .direct import Direct
from .hybrid import Hybrid
from .inconsistency import Inconsistency
from .learner import Learner
from .robust import Robust

BY_NAME: dict[str, type[Learner]] = {
    "robust": Robust,
    "hybrid": Hybrid,
    "inconsistency": Inconsistency,
    "direct": Direct,
}


def named(learner: Learner | str | None) -> Learner:
    """The learner itself, or by name with its default settings; :class:`~unconstrain.Robust` for None.

    Raises
    ------
    SettingError
        If it is neither.
    """
    if learner is None:
        return Robust()
    if isinstance(learner, str) and learner in BY_NAME:
        return BY_NAME[learner]()
    if not isinstance(learner, Learner):
        raise SettingError(
            f"learner: got {learner!r}, expected one of {', '.join(map(repr, BY_NAME))}, or a Learner such as Hybrid()."
        )
    return learner
