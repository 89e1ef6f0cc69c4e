"""What a person looks at: pages that need no network, and the figures in them."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, ["diagnosis", "figures", "fit", "html"])
