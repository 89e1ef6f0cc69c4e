"""What every room stands on: errors, checks, array libraries, threads."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, ["arrays", "errors", "threads"])
