"""How objects that hold arrays show themselves, in a terminal and in a notebook; and how far long work has come."""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from difflib import get_close_matches
from html import escape
from typing import Any, TypeVar

Listener = Callable[[str, int, int], None]
"""Called with what is counted, such as ``"segments: fold"``, the number that begins, and of how many."""

Item = TypeVar("Item")

_UNIT = r"_(mm|cm|deg|rad)$"

_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)


def innermost(policy: Any) -> Any:
    """The policy that is guided or moved, or itself."""
    return innermost(policy.policy) if hasattr(policy, "policy") else policy


class Shown:
    """Mixed into a class that says what it is made of in a few words; dataclasses then need ``repr=False``."""

    def _summary(self) -> tuple[str, ...]:
        """Parts such as ``"200 samples"`` or ``"variance=0.04"``, none of them an array."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(self._summary())})"

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><td>{escape(part)}</td></tr>" for part in self._summary())
        return f"<table><thead><tr><th>{type(self).__name__}</th></tr></thead><tbody>{rows}</tbody></table>"


class ShownWithSolution:
    """Mixed into an estimator of scikit-learn: its table in a notebook, and below it what was learnt."""

    def _html_repr(self) -> str:
        settings: str = super()._html_repr()  # type: ignore[misc]
        solution: Any = vars(self).get("solution_")
        return settings if solution is None else settings + solution._repr_html_()


def legible(name: str) -> str:
    r"""A name as text that has an encoding: bytes of a file's name that are no UTF-8 are shown, as ``"\udcff"``."""
    return name.encode("utf-8", "backslashreplace").decode()


def counted(number: int, noun: str) -> str:
    """A number of things: ``"1 sample"``, ``"2 samples"``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def percent(share: float) -> str:
    """A share such as ``"12%"``; ``"<1%"`` and ``">99%"`` where rounding would say none or all of what is not."""
    rounded, exact = f"{share:.0%}", not 1e-9 < share % 1.0 < 1.0 - 1e-9  # sums of weights are all to rounding
    return rounded if exact else {"0%": "<1%", "-0%": "<1%", "100%": ">99%"}.get(rounded, rounded)


def percents(parts: Sequence[float]) -> list[str]:
    """Parts of a whole, as by :func:`percent`, rounded so that together they are 100%."""
    whole = [round(100.0 * sum(parts[: k + 1])) - round(100.0 * sum(parts[:k])) for k in range(len(parts))]
    return [percent(part) if much in (0, 100) else f"{much}%" for part, much in zip(parts, whole, strict=True)]


def shortened(name: str, most: int = 40) -> str:
    """A name in quotes, its middle left out where it is long."""
    return repr(name if len(name) <= most else f"{name[: most // 2]}…{name[-most // 2 + 1 :]}")


def with_unit(name: str, unit: str | None) -> str:
    """A column's name with its unit, ``"x (mm)"``; as it is where it says one, but ``"yaw [deg]"`` in rad is not."""
    short = bare(name)
    turned = bool(unit and unit.startswith("rad")) and re.match(r"\W*(deg|[°º])", name[len(short) :], re.IGNORECASE)
    said = short != name or unit_of([name]) == unit
    return f"{short} ({unit})" if unit and (turned or not said) else name


def unit_of(names: Iterable[str]) -> str:
    """The unit that all names of columns say, ``"mm"`` of ``"x [mm]"`` and ``"x_mm"``; empty where they say none."""
    units = {"".join(re.findall(_UNIT, one)) or one[len(bare(one)) :].strip(" ()[]") for one in names}
    return units.pop() if len(units) == 1 else ""


def bare(name: str) -> str:
    """A column's name without the unit in it: ``"x"`` of ``"x [mm]"``."""
    return re.sub(r"\s*(\[[^\[\]\d][^\[\]]*\]|\([^()\d][^()]*\))$", "", name)


def speed_of(name: str) -> str:
    """What the velocity of a column is called: ``"vx"`` of ``"x"``, ``"vx [mm/s]"`` of ``"x [mm]"``."""
    return f"v{bare(name)}" + re.sub(r"([\])])$", r"/s\1", name[len(bare(name)) :])


def listed(names: Sequence[str], most: int = 30) -> str:
    """Names with commas between, the first of many."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def meant(asked: Sequence[str], known: Iterable[str]) -> str:
    """A question after what somebody may have meant by names that are none of the known; empty where none is near."""
    plain = {form.casefold(): one for one in [*known][::-1] for form in (re.sub(_UNIT, "", one), bare(one), one)}
    forms = (form.casefold() for name in asked for form in (name, re.split(r"[._/ ]", bare(name))[-1]))
    close = [get_close_matches(form, plain, n=2, cutoff=0.7) for form in forms]
    for mark, apart in (("..", r"\s*[-–:]\s*"), (",", r"[\s;]+")):
        if several := [parts for name in asked if {*(parts := re.split(apart, name))} <= {*known} and parts[1:]]:
            return f" Write {mark.join(several[0])}."
    near = dict.fromkeys(plain[found] for each in close for found in each)
    return f" Did you mean {' or '.join(map(repr, near))}?" if near else ""


def has_no_column(name: str, missing: Sequence[str], columns: Sequence[str], words: Sequence[str] = ()) -> str:
    """Say that a recording lacks columns, which ones it has, of numbers and of words, and what may have been meant."""
    same = {bare(one): one for one in columns}
    if all("" != unit_of([one]) != unit_of([same.get(bare(one), "")]) != "" for one in missing):
        other = f"'{name}' has {same[bare(missing[0])]!r}, not {missing[0]!r} as the others or as asked for"
        return f"{other}: another unit; convert it."
    of_words = f", and of words, for group=, {listed(words)}" if words else ""
    instead = meant(missing, columns)
    has = f"it has {listed(columns)}{of_words}.{instead}"
    clocks = [one for one in missing if not instead and re.fullmatch(r"t|[tT]ime|([tT]ime_?)?[sS]tamps?", one)]
    read = f" A clock such as {clocks[0]!r} is read as the time and is no state: leave it out." if clocks else ""
    return f"'{name}' has no column {listed([*map(repr, missing)])}; {has}{read}"


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Tell a listener what goes on inside the block, in its threads too."""
    before = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(before)


def tell(what: str, number: int, of: int) -> None:
    """Say that the so-manyth of some begins."""
    if (listener := _listener.get()) is not None:
        listener(what, number, of)


def counted_off(items: Sequence[Item], what: str) -> Iterator[Item]:
    """Each item, said as it begins."""
    for number, item in enumerate(items, start=1):
        tell(what, number, len(items))
        yield item
