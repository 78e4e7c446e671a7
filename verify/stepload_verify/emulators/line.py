"""An emulated load cell: one line of text a reading, streamed or on request."""

from __future__ import annotations

from stepload_drivers.line.codec import TERMINATORS, escaped_bytes
from stepload_drivers.units import UNITS_N
from stepload_verify.emulators.emulator import Measured
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.physics import AXES, WrenchSource

ZERO = b"Z\r"


class LineCell:
    """Sign, digits, point and `decimals` decimals, e.g. "+0012.3456" in `unit`; `Z` zeroes it.

    Args:
        request: text that asks for one reading (\\r, \\n allowed); empty: it streams.
        rated_n: rated load; the amplifier clips at 1.2 times of it.
    """

    def __init__(
        self,
        source: WrenchSource,
        board: FaultBoard,
        rate_hz: float = 100.0,
        request: str = "",
        unit: str = "N",
        decimals: int = 4,
        terminator: str = "CR",
        rated_n: float = 200.0,
    ) -> None:
        self._measured = Measured(source, board, rated_n)
        self._index = AXES.index(source.axis[1:])
        self._board = board
        self._rate_hz = rate_hz
        self._request = escaped_bytes(request)
        self._unit_n = UNITS_N[unit]
        self._decimals = decimals
        self._terminator = TERMINATORS[terminator]
        self._limit_n = 1.2 * rated_n
        self._zero_n = 0.0
        self._input = b""
        self.options: dict[str, object] = {
            "rate": rate_hz,
            "unit": unit,
            "range": rated_n,
            "zero": "Z\\r",
            "request": request,
            "terminator": terminator,
        }

    @property
    def period_s(self) -> float | None:
        return None if self._request else 1.0 / self._rate_hz

    def receive(self, data: bytes, now_s: float) -> list[list[bytes]]:
        if self._board.on("deaf"):
            return []
        self._input = (self._input + data)[-64:]
        if ZERO in self._input:
            self._input = self._input.replace(ZERO, b"")
            self._zero_n = self._force_n(now_s)
        if not self._request:
            return []
        *requested, self._input = self._input.split(self._request)
        return [self.sample(now_s) for _ in requested]

    def restart(self, now_s: float) -> list[list[bytes]]:
        self._input, self._zero_n = b"", 0.0
        return []

    def sample(self, time_s: float) -> list[bytes]:
        force_n = min(max(self._force_n(time_s), -self._limit_n), self._limit_n) - self._zero_n
        text = f"{force_n / self._unit_n:+0{6 + self._decimals}.{self._decimals}f}"
        if self._board.on("nan"):
            text = "+nan"
        return [text.encode() + self._terminator]

    def _force_n(self, time_s: float) -> float:
        return self._measured.wrench(time_s)[self._index]
