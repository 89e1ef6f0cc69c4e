"""Marks, and the thresholds of everything that is judged, each with its reason; pages and commands say the same."""

from __future__ import annotations

from enum import Enum
from functools import partial
from textwrap import wrap
from typing import NamedTuple

GOOD, FAIR = 0.9, 0.7
"""Explained share of motion. Along it a prediction misses √(1 − share) of a typical action: at the first a third, at
the second more than half, beyond which little but the rough direction is left."""

MOSTLY, PARTLY = 0.95, 0.7
"""Share of recorded states at which the policy is determined: of the rest, one in twenty is an edge."""

WELL = 0.8
"""Share of recorded states at which all recordings tell the policy, from which on a check mark stands: at the others
about half of an action is across the motion; if all of that is wrong, as much is missed as at :data:`GOOD`."""

OTHERWISE = 1.2
"""Size or pace of a roll-out over that demonstrated, or the inverse, from which on it is another movement."""

FEW, FAR_OFF = 0.25, 1.5
"""Share of roll-outs that may be that far off, and how far a single one, so that the others speak for the policy."""

FORBIDDEN = 0.05
"""Share of recorded motion that a constraint given would not allow, from which on it is likely another."""

UNITS = {"metres and millimetres": 1000.0, "degrees and radians": 57.3}
"""Units that are mixed up, and how many of one are the other."""

NEARBY = 0.6
"""Support of nearly all recorded states: they are within one width of a kernel, exp(−½). Below, none came by."""

MISFIT = 1.5
"""Residuals above this many times the noise by differences in time are mostly misfit of the model."""

SMALL = 0.1
"""An undetermined spread below this share of the typical action is negligible."""

ENOUGH = 3
"""Demonstrations that have to show something for it to be sure."""

WIDTH = 80
"""Columns of a terminal that sentences are broken for."""


class Mark(Enum):
    """How it stands, and the sign of it."""

    GOOD = "✔"
    DOUBTFUL = "!"
    BAD = "✖"


class Verdict(NamedTuple):
    """A judgement in one sentence, and what follows from it, in sentences that may be empty."""

    mark: Mark
    said: str
    trust: str = ""
    doubt: str = ""
    next: str = ""

    def rest(self) -> list[tuple[str, str]]:
        """What to trust, where not, and what to do next, as far as there is something to say."""
        named = (("Trust", self.trust), ("Do not trust", self.doubt), ("Next", self.next))
        return [(name, text) for name, text in named if text]

    def to_json(self) -> dict[str, str]:
        """With the name of the mark."""
        return self._asdict() | {"mark": self.mark.name.lower()}

    def lines(self) -> list[str]:
        """For a terminal of 80 columns; a command that comes next, or follows in a line of its own, stays whole."""
        whole = partial(wrap, width=WIDTH, break_on_hyphens=False)  # options and paths can be copied
        said = whole(f"{self.mark.value} {self.said}", subsequent_indent="  ")
        for name, text in self.rest():
            prose, *commands = f"{name}: {text}".split("\n")
            named = prose.startswith("Next: unconstrain ")
            said += [f"  {prose}"] if named else whole(prose, initial_indent="  ", subsequent_indent="    ")
            said += [f"    {command}" for command in commands]
        return said


def graded(
    share: float, good: float = GOOD, fair: float = FAIR, told: float | None = None, under: bool = False
) -> tuple[Mark, str]:
    """The mark of a share, in whole percents as said, and a word for it; where recordings tell too little, in what."""
    share = round(share, 2)
    mark, word = (Mark.GOOD, "good") if share >= good else (Mark.DOUBTFUL, "fair")
    if share < fair:
        return Mark.BAD, "poor"
    if (allowed := allowed_by(told)) is Mark.GOOD:
        return mark, word
    where = "under this one, but of movement under others" if under else "along the motion, but across it"
    mark = Mark.BAD if allowed is Mark.BAD and mark is not Mark.GOOD and not under else Mark.DOUBTFUL
    return mark, f"{word} {where} recordings tell too little"


def allowed_by(told: float | None) -> Mark:
    """The best mark where all recordings together tell a policy at such a share of their states, or it is not known."""
    return Mark.GOOD if told is None or told >= WELL else Mark.DOUBTFUL if told >= PARTLY else Mark.BAD


def doubted(found: Verdict, how: str) -> Verdict:
    """Go on in a sentence that leaves a verdict no better than doubtful."""
    joined = f"{found.said} {'But' if found.mark is Mark.GOOD else 'And'} {how}."
    return found._replace(mark=no_better(found.mark), said=joined)


def no_better(mark: Mark) -> Mark:
    """Doubtful, or bad as it is."""
    return Mark.BAD if mark is Mark.BAD else Mark.DOUBTFUL
