"""Settings of small frozen objects, read and changed as scikit-learn does with its estimators'."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, Self

from .errors import SettingError


class Parameters:
    """Mixed into a dataclass whose fields are its settings, for a grid search over ``learner__alpha``."""

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return the settings by name."""
        return {one.name: getattr(self, one.name) for one in fields(self)}  # type: ignore[arg-type]

    def set_params(self, **params: Any) -> Self:
        """Change settings in place, checked as when it was made; all of them or none.

        Raises
        ------
        SettingError
            If there is no setting of that name, or a value is refused.
        """
        known = self.get_params()
        for name in params:
            if name not in known:
                raise SettingError(
                    f"{name}: {type(self).__name__} has no such setting, expected one of {', '.join(known) or 'none'}."
                )
        vars(self).update(vars(replace(self, **params)))  # type: ignore[type-var]
        return self
