"""Cuts a byte stream into lines of text, and turns them into finite numbers."""

from __future__ import annotations

import math
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
