"""What a person looks at: pages and their figures. None needs a network.

Where jinja2 or matplotlib is not installed, they raise a ``MissingExtraError``.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__, ["constraint", "diagnosis", "figures", "fit", "html", "look", "play"]
)
