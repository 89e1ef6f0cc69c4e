"""The paper next door: its systems, data and experiments. It uses the library; nothing in the library uses it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__, ["commands", "datasets", "experiments", "pages", "simulation", "systems"]
)
