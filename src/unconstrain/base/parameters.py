"""Settings, read and changed as scikit-learn does with its estimators': ``learner__alpha`` is the learner's alpha."""

from collections import defaultdict
from collections.abc import Callable, Collection
from copy import copy
from functools import wraps
from inspect import signature
from typing import Any, Self, TypeVar

from .errors import SettingError

Method = TypeVar("Method", bound=Callable[..., Any])


class Parameters:
    """Mixed into a class whose attributes are the arguments that it was made with."""

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return the settings by name; those of settings too, unless told otherwise."""
        own = {name: getattr(self, name) for name in signature(type(self)).parameters}
        inner = {f"{name}__{key}": value for name, part in own.items() for key, value in _settings_of(part).items()}
        return {**own, **inner} if deep else own

    def set_params(self, **params: Any) -> Self:
        """Change settings in place, checked as when it was made; all of them or none.

        Raises
        ------
        SettingError
            If there is no setting of that name, or a value is refused.
        """
        if not params:
            return self
        own, inner = self.get_params(deep=False), defaultdict[str, dict[str, Any]](dict)
        for key, value in params.items():
            name, nested, rest = key.partition("__")
            self._check_name(name, own)
            if nested:
                inner[name][rest] = value
            else:
                own[name] = value
        for name, values in inner.items():
            own[name] = _changed(name, own[name], values)
        changed = type(self)(**own)
        for name in own:
            object.__setattr__(self, name, getattr(changed, name))
        return self

    def _check_name(self, name: str, known: Collection[str]) -> None:
        if name not in known:
            raise SettingError(
                f"{name}: {type(self).__name__} has no such setting, expected one of {', '.join(known) or 'none'}."
            )


def others_by_name(method: Method) -> Method:
    """Refuse more than states and actions by their place: next could come weights, or groups."""

    @wraps(method)
    def called(*given: Any, **named: Any) -> Any:
        if len(given) > 3:
            said = f"{(name := method.__name__)}: got {len(given) - 1} arrays, expected two, and the others by name, as"
            raise SettingError(f"{said} {name}(states, actions, groups=groups) after uc.stack, or sample_weight=.")
        return method(*given, **named)

    return called  # type: ignore[return-value]  # of the same signature, for who reads it


def _settings_of(part: Any) -> dict[str, Any]:
    readable = hasattr(part, "get_params") and not isinstance(part, type)
    return part.get_params() if readable else {}


def _changed(name: str, part: Any, values: dict[str, Any]) -> Any:
    """A copy of a setting with settings of its own changed: others may hold the same object."""
    if not hasattr(part, "set_params"):
        raise SettingError(
            f"{name}__{next(iter(values))}: {name} is {part!r}, which has no settings; set {name} to an object first."
        )
    return copy(part).set_params(**values)
