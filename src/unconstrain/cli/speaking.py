"""What the library says to who calls it, in the words of who types: settings as options, names as what was meant."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable, Mapping
from difflib import get_close_matches

import click

ALSO = {
    "goal": "--guided",
    "states": "--state",
    "actions": "--action",
    "angles": "--angle",
    "differentiate": "--by",
    "groups": "--group",
}
"""Settings whose options are called otherwise than they are, or as another setting."""

OBJECTS = {
    "ParametricPolicy(Affine())": "--model affine",
    "a LocallyLinearPolicy": "--model local",
    "fewer features, or Folds(2)": "--folds 2",
    "a smaller dt": "a smaller --dt",
    "goal=, or orbit='shown' for a cycle": "--guided its place, a number for each state, or --guided cycle",
    "fit each by itself": "fit each by itself (its file alone, or --episodes with its name)",
    "guide the policy (uc.Guided)": "fit with --guided auto",
    "give it with goal=": "give it with --guided, a number for each state in the units of the data",
    "Take Hybrid()": "Take --learner hybrid",
    "the warnings of a survey": "what 'unconstrain inspect' warns of",
}
"""What is made in Python, and the options that make it."""

TIMES = {
    "s": ("sec", "secs", "second", "seconds"),
    "ms": ("msec", "millis", "millisecond", "milliseconds"),
    "us": ("usec", "µs", "micros", "microsecond", "microseconds"),
    "ns": ("nsec", "nanos", "nanosecond", "nanoseconds"),
}
"""How people write the units of time."""

_SETTING = re.compile(
    r"(?<![\w/'\".-])([a-z]\w*)=(\((?:'[^']*'|[^()'])*\)|'[^']*'|[A-Z]\w*\(\)|True\b|-?\d+(?:\.\d+)?(?!\.?[\w/])|(?=[,;:)\s]|\.(?:\s|$)))"
)
"""``name=value`` or ``name=``, but in no path."""


def as_typed(said: str, of_file: bool = False) -> str:
    """A sentence of the library with options of this command, or where it has none of another, in place of settings.

    One of a file begins with its name, which may be that of a setting.
    """
    context = click.get_current_context(silent=True)
    if context is None:
        return said
    options = _options(context)
    head, _, rest = said.partition(": ")
    said = f"{option}: {rest}" if not of_file and (option := _option(head, options)) else said
    for made, option in OBJECTS.items():
        said = said.replace(made, option)
    return _SETTING.sub(lambda found: _set(found, options), said)


def options_in(said: str) -> dict[str, str]:
    """Options that a sentence of the library gives a value, and the first value of each, empty of a flag."""
    every = _options(click.get_current_context())
    named = [(_option(found[1], every), found[2]) for found in _SETTING.finditer(said)]
    return {option: _plain(value) for option, value in reversed(named) if option and value}


def _options(context: click.Context) -> dict[str, str]:
    """Options of this command, and of others, by the names of their settings."""
    commands = getattr(context.find_root().command, "commands", {})
    own = commands.get(context.invoked_subcommand, context.command)
    every = [one for command in (*commands.values(), own) for one in command.params]
    return {one.name: one.opts[-1] for one in every if one.opts[-1].startswith("--")} | ALSO


def _option(name: str, options: Mapping[str, str]) -> str:
    """The option of a setting, whose name may say that it is in seconds; empty where there is none."""
    return options.get(name) or options.get(name.removesuffix("_s")) or ""


def _set(found: re.Match[str], options: Mapping[str, str]) -> str:
    option, value = _option(found[1], options), _plain(found[2])
    return f"{option} {shlex.quote(value) if value else ''}".rstrip() if option else found[0]


def _plain(value: str) -> str:
    """A value as it is typed, but for quotation marks."""
    if "'" in value:
        return ",".join(re.findall(r"'([^']*)'", value))
    return "none" if value == "()" else re.sub(r"[()\s]|True", "", value).lower()


def meant_of(value: str, known: Iterable[str]) -> str:
    """A question after which of some values of an option may have been meant; empty where none is near."""
    words = {one.casefold(): one for one in known}
    words |= {word.casefold(): unit for unit, written in TIMES.items() if unit in words for word in written}
    if value.casefold() in words:
        return f" Did you mean {words[value.casefold()]!r}?"
    near = dict.fromkeys(words[one] for one in get_close_matches(value.casefold(), words, n=2, cutoff=0.6))
    return f" Did you mean {' or '.join(map(repr, near))}?" if near else ""
