"""A plan's regular expression for one line of text, refused where matching could take long."""

from __future__ import annotations

import re
from collections.abc import Callable

from stepload.errors import BadInputError

MAX_CHOICES = 15
"""What may give back, an option (`?`) or an alternative counted once: each doubles the time."""
REPETITION = 4
"""What a repetition counts for: three, and three choices, take some 0.1 s on the longest line."""

_TOKEN = re.compile(
    r"(?P<escape>\\.)|(?P<set>\[\^?\]?(?:\\.|[^\]\\])*\])"
    r"|(?P<special>\(\?(?!P<|<?[=!]|[:>]).)"
    r"|(?P<open>\((?:\?(?:P<\w+>|<?[=!]|[:>]))?)|(?P<close>\))|(?P<either>\|)"
    r"|(?P<quantity>\*|\+|\?|\{\d*,\d*\}|\{\d+\})(?P<mode>[+?]?)|(?P<other>.)",
    re.DOTALL,
)
_OPTIONAL = ("?", "{0,1}", "{,1}")
_FIXED = re.compile(r"\{\d+\}")


def line_pattern(pattern: str, group: str) -> re.Pattern[str]:
    """The compiled `pattern`, whose only named group is `group`.

    A repetition inside a repeated group can take time that doubles with every character, and
    several repetitions in a row a power of the line's length. Both are refused, except where
    possessive (`*+`, `++`), since a possessive repetition gives nothing back. Flags (`(?x)`),
    comments and conditions are refused because they hide what is repeated.

    Raises:
        BadInputError: no regular expression, other named groups than `group`, flags, or possibly
            slow.
    """
    try:
        compiled = re.compile(pattern)
    except re.error as error:
        raise BadInputError(f"pattern {pattern!r} is no regular expression: {error}") from error
    if set(compiled.groupindex) != {group}:
        raise BadInputError(
            f"pattern {pattern!r} needs one named group, `{group}`, and no other",
            hint=rf"e.g. (?P<{group}>[+-]?\d+\.\d+)",
        )
    if found := next((t["special"] for t in _TOKEN.finditer(pattern) if t["special"]), ""):
        raise BadInputError(
            f"pattern {pattern!r} holds {found!r}: no flags, comments, conditions or references",
            hint="write letters of both cases as [kK], and no blanks that the line does not have",
        )
    if problem := _may_be_slow(pattern):
        raise BadInputError(
            f"pattern {pattern!r} {problem}: a damaged line could hold the run up",
            hint=r"write repetitions that need not give back as possessive: \s*+ for \s*",
        )
    return compiled


def _may_be_slow(pattern: str) -> str:
    """The problem with the repetitions of `pattern`; empty: none."""
    open_groups = [False]  # whether the group at this depth has more than one way to match
    just_closed = False  # whether the last atom was a group with more than one way to match
    choices = 0
    for token in _TOKEN.finditer(pattern):
        kind, quantity = token.lastgroup, token["quantity"]
        gives_back = bool(quantity) and token["mode"] != "+" and not _FIXED.fullmatch(quantity)
        if gives_back:
            choices += 1 if quantity in _OPTIONAL else REPETITION
        choices += kind == "either"
        if just_closed and quantity and token["mode"] != "+" and quantity not in _OPTIONAL:
            return "repeats a group that itself repeats or has alternatives"
        if kind == "open":
            open_groups.append(False)
        elif gives_back or kind == "either":
            open_groups[-1] = True
        just_closed = False
        if kind == "close":
            just_closed = open_groups.pop()
            open_groups[-1] |= just_closed
    if choices > MAX_CHOICES:
        return (
            f"has {choices} choices that may be taken back (limit {MAX_CHOICES}; ? and | count "
            f"once, other repetitions {REPETITION} times)"
        )
    return ""


def number_of(pattern: re.Pattern[str], group: str, scale: float) -> Callable[[str], float]:
    """A function from a whole line to its number times `scale`.

    The function raises ValueError for a line that does not match.
    """

    def number(line: str) -> float:
        match = pattern.fullmatch(line)
        if match is None or match[group] is None or "_" in match[group]:
            raise ValueError(f"no reading: {line!r}")
        return float(match[group]) * scale

    return number
