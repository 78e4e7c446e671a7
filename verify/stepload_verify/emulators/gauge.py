"""An emulated digital gauge: one line of text a reading, streamed or on request."""

from __future__ import annotations

from stepload_drivers.gauge.sensor import UNITS_M
from stepload_drivers.line.codec import TERMINATORS
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.physics import Physics

RANGE_M = 0.0125


class GaugeDevice:
    """Sign, four digits, point and `decimals` decimals, e.g. "+0000.1234" in `unit`."""

    def __init__(
        self,
        physics: Physics,
        board: FaultBoard,
        rate_hz: float = 10.0,
        request: bytes = b"",
        unit: str = "mm",
        decimals: int = 4,
        terminator: str = "CR",
    ) -> None:
        self._physics = physics
        self._board = board
        self._rate_hz = rate_hz
        self._request = request
        self._unit_m = UNITS_M[unit]
        self._decimals = decimals
        self._terminator = TERMINATORS[terminator]
        self._input = b""
        self._frozen_m: float | None = None

    @property
    def period_s(self) -> float | None:
        return None if self._request else 1.0 / self._rate_hz

    def receive(self, data: bytes, now_s: float) -> list[list[bytes]]:
        if not self._request or self._board.on("deaf"):
            return []
        *requested, self._input = (self._input + data).split(self._request)
        return [self.sample(now_s) for _ in requested]

    def restart(self, now_s: float) -> list[list[bytes]]:
        self._input = b""
        return []

    def sample(self, time_s: float) -> list[bytes]:
        value = self._closed_m(time_s) / self._unit_m
        text = f"{value:+0{6 + self._decimals}.{self._decimals}f}"
        if self._board.on("nan"):
            text = "ERR 4"
        return [text.encode() + self._terminator]

    def _closed_m(self, time_s: float) -> float:
        if self._board.on("zero"):
            return 0.0
        if self._board.on("freeze"):
            if self._frozen_m is None:
                self._frozen_m = self._physics.closed_m(time_s)
            return self._frozen_m
        self._frozen_m = None
        return (
            self._physics.closed_m(time_s) + (self._board.magnitude("overrange") or 0.0) * RANGE_M
        )
