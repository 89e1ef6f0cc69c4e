"""One recording as several demonstrations, with a stand between any two."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..demonstration import Recording
from ..readers.table import rows_of
from ..remarks import Remark
from .plausibility.subject import LEAST_ROWS, Subject

HARDLY = 0.1
"""A piece that covers less than this share of what half of the pieces cover moves hardly."""


def between_stands(subject: Subject) -> list[Recording]:
    """What moves between stands, called ``NAME.1``, ``NAME.2``, ..., where a recipe cuts there; else the recording."""
    whole, every = subject.recording, _between(subject) if subject.recipe.pauses == "cut" else []
    if len(every) < 2:
        return [whole]
    extents = [float(np.linalg.norm(np.ptp(one.states, axis=0))) if len(one.rows) >= LEAST_ROWS else 0 for one in every]
    moving = [one for one, far in zip(every, extents, strict=True) if far >= HARDLY * np.median(extents)]
    said = f"cut where it stands still, into {whole.name}.1 to {whole.name}.{len(moving)}; leave_out= leaves some out."
    said += f" {len(every) - len(moving)} more hardly moved, and are left out." * (len(every) > len(moving))
    notes = [(*whole.remarks, Remark("cut", said)), *[()] * len(moving)]
    return [
        replace(one.recording, name=f"{whole.name}.{number + 1}", remarks=notes[number])
        for number, one in enumerate(moving)
    ]


def _between(subject: Subject) -> list[Subject]:
    """What is between stands, until nothing stands still."""
    edges = [subject.row(row) for stand in subject.stands for row in stand]
    bounds = list(pairwise([0, *edges, len(subject.recording)]))[::2] if edges else []
    parts = [replace(subject, recording=rows_of(subject.recording, slice(*rows))) for rows in bounds]
    return [one for part in parts for one in _between(part)] or [subject]
