"""Lines of text as digital gauges send them ("+0012.345", "01A+0.0012")."""

from __future__ import annotations

import math
import re

UNITS_M = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254}
TERMINATORS = {"CR": b"\r", "LF": b"\n", "CRLF": b"\r\n"}
MAX_LINE_BYTES = 128


class LineDecoder:
    """Finds readings in a byte stream.

    Args:
        pattern: regular expression that must match a whole line (without terminator); its group
            `value` is the number.
        unit_m: metres per unit of that number.
        terminator: what ends a line.

    The text before the first terminator may be cut and is not used. `damaged` counts lines that do
    not match, or are longer than 128 bytes, or whose number is not finite.
    """

    def __init__(self, pattern: str, unit_m: float, terminator: bytes) -> None:
        self._pattern = re.compile(pattern)
        self._unit_m = unit_m
        self._terminator = terminator
        self._buffer = b""
        self._whole = False
        self.damaged = 0

    def feed(self, data: bytes) -> list[float]:
        """All readings complete with `data`, in m, oldest first."""
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
        """Take what comes next as the beginning of a line (the device is known to be silent)."""
        self._buffer, self._whole = b"", True

    def _reading(self, line: bytes) -> float | None:
        text = line.strip().decode("ascii", "replace")
        if not text:
            return None
        match = self._pattern.fullmatch(text) if len(text) <= MAX_LINE_BYTES else None
        try:
            value = float(match["value"]) if match else math.nan
        except (ValueError, TypeError):
            value = math.nan
        if not math.isfinite(value):
            self.damaged += 1
            return None
        return value * self._unit_m
