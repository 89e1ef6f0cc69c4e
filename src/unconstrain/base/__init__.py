"""What every room stands on: errors, checks, settings, array libraries, threads, files."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__, ["arrays", "display", "errors", "estimators", "files", "foreign", "parameters", "threads"]
)
