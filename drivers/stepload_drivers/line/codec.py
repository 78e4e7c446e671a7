"""Lines of text in a byte stream, and the finite number in each, by a pattern of the plan."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from stepload.errors import BadInputError

TERMINATORS = {"CR": b"\r", "LF": b"\n", "CRLF": b"\r\n"}
MAX_LINE_BYTES = 128


def escaped_bytes(text: str) -> bytes:
    r"""The bytes of a command in a plan, in which `\r` and `\n` may be written as escapes.

    Raises:
        BadInputError: not ASCII.
    """
    try:
        return text.replace("\\r", "\r").replace("\\n", "\n").encode("ascii")
    except UnicodeEncodeError as error:
        raise BadInputError(f"command {text!r} is not ASCII") from error


class LineDecoder:
    """Finds readings in a byte stream.

    Args:
        number: the value of one line (stripped, without terminator); raises ValueError for a line
            that is none.
        terminator: what ends a line.

    The text before the first terminator may be cut and is not used. `damaged` counts lines that
    are no reading, are longer than 128 bytes, or whose number is not finite.
    """

    def __init__(self, number: Callable[[str], float], terminator: bytes) -> None:
        self._number = number
        self._terminator = terminator
        self._buffer = b""
        self._whole = False
        self.damaged = 0

    def feed(self, data: bytes) -> list[float]:
        """All readings complete with `data`, oldest first."""
        *lines, rest = (self._buffer + data).split(self._terminator)
        if lines and not self._whole:
            self._whole = True
            lines = lines[1:]
        if len(rest) > MAX_LINE_BYTES:
            self.damaged += self._whole
            rest, self._whole = b"", False
        self._buffer = rest
        return [value for line in lines if (value := self._reading(line)) is not None]

    def begin_line(self) -> None:
        """Treat the next byte as the beginning of a line (the device is known to be silent)."""
        self._buffer, self._whole = b"", True

    def _reading(self, line: bytes) -> float | None:
        text = line.strip().decode("ascii", "replace")
        if not text:
            return None
        try:
            value = self._number(text) if len(text) <= MAX_LINE_BYTES else math.nan
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self.damaged += 1
            return None
        return value


MAX_CHOICES = 15
"""What may give back, an option (`?`) or an alternative counted once: each doubles the time."""
REPETITION = 4
"""What a repetition counts for: three, and three choices, take some 0.1 s on the longest line."""

_ESCAPE_OR_SET = re.compile(r"\\.|\[\^?\]?(?:\\.|[^\]\\])*\]", re.DOTALL)
_SPECIAL = re.compile(r"\(\?(?!P<|<?[=!]|[:>]).", re.DOTALL)
_GROUP_KIND = re.compile(r"(?<=\()\?(?:P<\w+>|<?[=!]|[:>])")
_FIXED_OR_POSSESSIVE = re.compile(r"(?:[*+?]|\{\d*,?\d*\})\+|(?<!\))\{\d+\}")
_OPTION = re.compile(r"\?|\{0?,1\}")
_REPETITION = re.compile(r"[*+]|\{\d*,?\d*\}")


def line_pattern(pattern: str, group: str) -> re.Pattern[str]:
    """The compiled `pattern`, whose only named group is `group`.

    A repeated group can take time that doubles with every character, and several repetitions in a
    row a power of the line's length. Both are refused, except where possessive (`*+`, `++`), since
    a possessive repetition gives nothing back. Flags (`(?x)`), comments and conditions are refused
    because they hide what is repeated.

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
    bare = _ESCAPE_OR_SET.sub("x", pattern)
    if special := _SPECIAL.search(bare):
        raise BadInputError(
            f"pattern {pattern!r} holds {special[0]!r}: no flags, comments, conditions or "
            "references",
            hint="write letters of both cases as [kK], and no blanks that the line does not have",
        )
    if problem := _may_be_slow(bare):
        raise BadInputError(
            f"pattern {pattern!r} {problem}: a damaged line could hold the run up",
            hint=r"write repetitions that need not give back as possessive: \s*+ for \s*",
        )
    return compiled


def _may_be_slow(bare: str) -> str:
    """The problem with the repetitions of a pattern without escapes and sets; empty: none."""
    gives_back = _FIXED_OR_POSSESSIVE.sub("", _GROUP_KIND.sub("", bare))
    options = len(_OPTION.findall(gives_back)) + gives_back.count("|")
    repeated = _OPTION.sub("", gives_back)
    if re.search(r"\)[*+{]", repeated):
        return "repeats a group"
    choices = options + REPETITION * len(_REPETITION.findall(repeated))
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
