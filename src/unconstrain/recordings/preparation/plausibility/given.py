"""Demonstrations that came from no recording: what is cheap to see in them, in sentences."""

from collections.abc import Sequence

import numpy as np

from ...demonstration import Demonstration, Recording
from ..recipes import Recipe
from .checks import all_zero, reversed_in_time, targets
from .sets import compare, outline
from .subject import Subject

MOST_ROWS = 5000
"""Longer demonstrations are looked at up to here."""

MOST = 50
"""Of more demonstrations, so many are looked at."""


def doubts_about(demonstrations: Sequence[Demonstration]) -> dict[str, str]:
    """What is not as it seems in demonstrations, a sentence for each code."""
    some = [one for one in demonstrations[:: -(-len(demonstrations) // MOST)] if _is_of_usual_size(one)]
    subjects = [_subject(demo, f"{number}") for number, demo in enumerate(some)]
    first: dict[str, str] = {}
    for subject, beside in zip(subjects, compare([outline(one) for one in subjects]), strict=True):
        alone = [check(subject) for check in (targets, reversed_in_time, all_zero)]
        for remark in (*filter(None, alone), *beside):
            first.setdefault(remark.code, remark.about(subject.recording.title))
    return first


def _is_of_usual_size(demo: Demonstration) -> bool:
    """Whether squares of its numbers are more than nothing."""
    sizes = np.abs(np.hstack([demo.states, demo.actions]))
    return bool(sizes[sizes > 0].min(initial=1.0) > 1e-100)


def _subject(demo: Demonstration, number: str) -> Subject:
    states = tuple(f"x{column + 1}" for column in range(demo.states.shape[1]))
    actions = tuple(f"u{column + 1}" for column in range(demo.actions.shape[1]))
    table = np.hstack([demo.states[:MOST_ROWS], demo.actions[:MOST_ROWS]])
    times = None if demo.times is None else demo.times[:MOST_ROWS]
    return Subject(Recording((*states, *actions), table, times, demo.name or number), Recipe(states, actions))
