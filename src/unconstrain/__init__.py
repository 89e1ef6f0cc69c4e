"""Learn the unconstrained policy behind movements recorded under unknown, changing constraints.

>>> import unconstrain as uc
>>> policy = uc.LocallyLinearPolicy().fit(states, actions, groups=groups)  # doctest: +SKIP
>>> policy.predict(states)  # doctest: +SKIP

Importing this package imports nothing heavy. The names and where they live are in ``__init__.pyi``, where type checkers
see them; each is imported on first use.
"""

from typing import Any

import lazy_loader

from .base import former

_attribute, _names, __all__ = lazy_loader.attach_stub(__name__, __file__)
former.install(__name__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version(__name__)
    try:
        return _attribute(name)
    except AttributeError as error:
        raise AttributeError(
            f"module {__name__!r} has no attribute {name!r}; it has {', '.join(sorted(__all__))}."
        ) from error


def __dir__() -> list[str]:
    return sorted(__all__)
