"""One-axis force sensors that send lines of text: the base class, and a driver for any of them."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from typing import Any, ClassVar

from stepload.rig.device import ForceSensor, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.options import Option
from stepload.rig.samples import ForceSample, Status
from stepload_drivers.line.codec import TERMINATORS, escaped_bytes
from stepload_drivers.line.pattern import line_pattern, number_of
from stepload_drivers.line.sensor import LineSensor, LineSettings
from stepload_drivers.options import values
from stepload_drivers.stream import Stream
from stepload_drivers.streamed import MAX_AGE, STALE_S
from stepload_drivers.units import UNITS_N

FROZEN_S = 1.0
_log = logging.getLogger(__name__)
DEFAULT_PATTERN = r"(?P<force>[+-]?\d+(?:\.\d+)?)"

SERIAL_OPTIONS: Mapping[str, Option] = {
    "port": Option("text", "serial port, e.g. /dev/serial/by-id/…", required=True),
    "baud": Option("integer", "bit rate", default=9600, low=50.0, high=4e6),
    "range": Option(
        "quantity", "rated load; a reading of that size is an overload", unit="N", required=True,
        low=1e-3,
    ),
    "max_age": MAX_AGE,
    "frozen": Option(
        "quantity", "time after which exactly repeated readings are a fault", unit="s",
        default=FROZEN_S, low=0.05, high=3600.0,
    ),
}  # fmt: skip
"""Options that every driver on `LineForceSensor` wants."""


class LineForceSensor(LineSensor[ForceSample], ForceSensor):
    """A load cell whose every line is one force; the force goes into Fz, all else is zero.

    A driver on this base gives `reading`: one line to newton. What it may give besides: `_identify`
    where the device tells who it is.

    Args:
        port: serial port.
        baud: bit rate in bit/s.
        rate_hz: readings per second.
        range_n: rated load in N; a reading of that size or beyond is the fault `overload`.
        terminator: what ends a line.
        request: bytes that ask for one reading; empty: the device sends by itself.
        zero: bytes that make the present force the device's zero; empty: it cannot.
        max_age_s: silence after which it counts as dead, at least five periods.
        frozen_s: time after which exactly repeated readings are a fault.
        model, serial_number: for the record, where the device does not tell.
    """

    DRIVER: ClassVar[str]

    def __init__(
        self,
        *,
        port: str,
        baud: int,
        rate_hz: float,
        range_n: float,
        terminator: bytes = b"\r",
        request: bytes = b"",
        zero: bytes = b"",
        max_age_s: float = STALE_S,
        frozen_s: float = FROZEN_S,
        model: str = "unknown",
        serial_number: str = "unknown",
    ) -> None:
        settings = LineSettings(
            name=f"load cell on {port}",
            port=port,
            baud=baud,
            rate_hz=rate_hz,
            terminator=terminator,
            request=request,
            max_age_s=max_age_s,
            frozen_s=frozen_s,
            refuse_latency=True,
        )
        super().__init__(
            settings, Identity(self.DRIVER, model, serial_number, "unknown", "unknown")
        )
        self._range_n = range_n
        self._zero = zero

    def _sample(
        self, value: float, sequence: int, time_s: float, stream: Stream[ForceSample]
    ) -> ForceSample:
        status = 0
        if abs(value) >= self._range_n:
            status = int(Status.OVERRANGE)
            stream.latch(
                FaultCode.OVERLOAD,
                f"{self._name} reads {value:.3f} N (rated load {self._range_n:g} N)",
                "unload; check the zero before going on, and `unit` and `range` in the plan",
            )
        wrench = (0.0, 0.0, value, 0.0, 0.0, 0.0)
        return ForceSample(sequence, math.nan, time_s, status, wrench, math.nan)

    def bias(self, timeout_s: float) -> bool:
        """Send the zero command, where there is one; no reply is waited for."""
        if self._link is None or not self._zero:
            return False
        self._link.write(self._zero)
        _log.info("%s: zeroed by its own command", self._name)
        return True


class LineSerial(LineForceSensor):
    """Any load cell or amplifier with lines of text, described by the plan alone."""

    DRIVER = "line_serial"
    OPTIONS: ClassVar[Mapping[str, Option]] = {
        **SERIAL_OPTIONS,
        "rate": Option(
            "quantity", "readings per second", unit="Hz", required=True, low=0.5, high=2000.0
        ),
        "pattern": Option(
            "text",
            "regular expression of a whole line, number in group `force`",
            default=DEFAULT_PATTERN,
        ),
        "unit": Option("text", "unit of the number", required=True, choices=tuple(UNITS_N)),
        "terminator": Option(
            "text", "what ends a line; CR takes CR LF too", default="CR", choices=tuple(TERMINATORS)
        ),
        "request": Option(
            "text", "sent to get one reading (\\r, \\n allowed); empty: it streams", default=""
        ),
        "zero": Option(
            "text", "sent to zero the device (\\r, \\n allowed); empty: it cannot", default=""
        ),
        "model": Option("text", "model, for the record", default="load cell"),
        "serial_number": Option("text", "serial number, for the record", default="unknown"),
    }

    def __init__(self, **options: Any) -> None:
        told = values(self.OPTIONS, options)
        pattern = line_pattern(told["pattern"], "force")
        self._number = number_of(pattern, "force", UNITS_N[told["unit"]])
        super().__init__(
            port=told["port"],
            baud=told["baud"],
            rate_hz=told["rate"],
            range_n=told["range"],
            terminator=TERMINATORS[told["terminator"]],
            request=escaped_bytes(told["request"]),
            zero=escaped_bytes(told["zero"]),
            max_age_s=told["max_age"],
            frozen_s=told["frozen"],
            model=told["model"],
            serial_number=told["serial_number"],
        )

    def reading(self, line: str) -> float:
        return self._number(line)
