"""What is to be said of a policy where it is used: columns, units, centring, what is subtracted, hash."""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from textwrap import wrap
from typing import Any, Self

import numpy as np

from ..base.display import legible, speed_of, with_unit
from ..models import ClosedForm

_WIDTH = 116

CENTRED = "relative to the mean of each demonstration; subtract that of the place from states before"
"""Of states that were centred."""


@dataclass(frozen=True)
class Description:
    """What a policy's numbers mean, in words.

    Parameters
    ----------
    states, actions : sequence of str
        Names of the columns.
    units : mapping of str to str
        Units of some columns.
    lines : mapping of str to str
        What else is to be said, by what it is of.
    fastest : float
        At least the largest size of a demonstrated action, where that is known.
    """

    states: Sequence[str]
    actions: Sequence[str]
    units: Mapping[str, str] = field(default_factory=dict)
    lines: Mapping[str, str] = field(default_factory=dict)
    fastest: float = 0.0

    @classmethod
    def of(cls, form: ClosedForm, learnt: str = "", notes: Mapping[str, Any] | None = None) -> Self:
        """Describe a closed form by the notes that were saved beside the policy."""
        notes = dict(notes or {})
        recipe, units, _ = notes.pop("recipe", {}), notes.pop("units", {}), notes.pop("digests", None)
        states = _named(recipe.get("states"), form.columns, "x")
        given = recipe.get("actions") or [*map(speed_of, recipe.get("states") or ())]
        lines = {"centring": CENTRED if recipe.get("centre") else "none" if recipe else "", "learnt by": learnt}
        lines["subtracted inside"] = ", ".join(f"{value:.6g}" for value in form.origin)
        lines |= {name: _said(value) for name, value in notes.items()}
        lines["recorded in degrees"] = ", ".join(recipe.get("degrees") or ())
        lines["guided"] = form.correction.promise if form.correction else ""
        lines["sha256"] = digest(form)
        actions = _named(given, form.sizes[1], "u")
        return cls(states, actions, units, {name: said for name, said in lines.items() if said})

    @property
    def whole(self) -> dict[str, str]:
        """Everything, by what it is of."""
        states, actions = (
            ", ".join(with_unit(name, self.units.get(name)) for name in names) for names in (self.states, self.actions)
        )
        return {"states": states, "actions": actions, **self.lines}

    def comment(self) -> Iterator[str]:
        """Lines for a comment in C, which nothing in them ends or begins."""
        for name, said in self.whole.items():
            text = legible(f"{name}: {said}").replace("\n", " ").replace("\\", "/")
            yield from wrap(text.replace("*/", "* /").replace("/*", "/ *"), _WIDTH, subsequent_indent="    ")


def digest(form: ClosedForm) -> str:
    """SHA-256 of a closed form: the same for the same policy, another for another."""
    found = hashlib.sha256(repr(form.embedding.space).encode())
    guide = form.correction
    added = [] if guide is None else [*guide.tables.values(), np.array(list(guide.numbers.values()))]
    own = form.origin, form.maps, form.exponents, form.monomials, form.precisions, form.embedding.frame
    for table in (*own, *added):
        if table is not None:
            found.update(f"{table.shape}".encode() + np.ascontiguousarray(table, np.float64).tobytes())
    return found.hexdigest()


def _named(names: Sequence[str] | None, count: int, letter: str) -> list[str]:
    """Names of so many columns; letters and numbers where they are not known."""
    known = list(names or ())
    return known if len(known) == count else [f"{letter}{place}" for place in range(1, count + 1)]


def _said(value: Any) -> str:
    value = f"{value:.6g}" if isinstance(value, float) else value
    return value if isinstance(value, str) else json.dumps(value) if value not in (None, [], {}) else ""
