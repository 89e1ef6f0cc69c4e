"""The page to play with: strokes on a plate, the rail that holds them, and three learners beside each other."""

from .alone import assembled


def play_page() -> str:
    """Make the page, a whole HTML document that needs nothing else."""
    return assembled("play.html")
