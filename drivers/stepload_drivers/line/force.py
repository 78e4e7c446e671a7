"""One-axis force sensors that send lines of text: the base class, and a driver for any of them."""

from __future__ import annotations

import logging
import math
from typing import Annotated, Any, ClassVar

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import Baud, Choice, Setting, Verbatim
from stepload.declaration.sections import SECTION, key
from stepload.rig.device import ForceSensor, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.samples import ForceSample, Status
from stepload_drivers.line.codec import TERMINATORS, escaped_bytes, line_pattern, number_of
from stepload_drivers.line.sensor import LineSensor, LineSettings
from stepload_drivers.serialport import Port
from stepload_drivers.stream import Stream
from stepload_drivers.streamed import STALE_S, MaxAge
from stepload_drivers.units import UNITS_N

FROZEN_S = 1.0
_log = logging.getLogger(__name__)
DEFAULT_PATTERN = r"(?P<force>[+-]?\d+(?:\.\d+)?)"


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class SerialOptions:
    """Options that every driver on `LineForceSensor` wants."""

    port: Port
    baud: Annotated[Baud, key("bit rate")] = 9600
    range_n: Annotated[
        float,
        Setting("N", 1e-3, 1e6),
        key("rated load; a reading of that size is an overload"),
    ]
    max_age_s: MaxAge = STALE_S
    frozen_s: Annotated[
        float,
        Setting("s", 0.05, 3600.0),
        key("time after which exactly repeated readings are a fault"),
    ] = FROZEN_S


class LineForceSensor(LineSensor[ForceSample], ForceSensor):
    """A load cell whose every line is one force; the force goes into Fz, all else is zero.

    A driver on this base gives `reading`: one line to newton. What it may give besides: `_identify`
    where the device tells who it is.

    Args:
        told: port, bit rate, rated load, and the silence and repetition that are faults.
        rate_hz: readings per second.
        terminator: what ends a line.
        request: bytes that ask for one reading; empty: the device sends by itself.
        zero: bytes that make the present force the device's zero; empty: it cannot.
        model, serial_number: for the record, where the device does not tell.
    """

    DRIVER: ClassVar[str]

    def __init__(
        self,
        told: SerialOptions,
        *,
        rate_hz: float,
        terminator: bytes = b"\r",
        request: bytes = b"",
        zero: bytes = b"",
        model: str = "unknown",
        serial_number: str = "unknown",
    ) -> None:
        settings = LineSettings(
            name=f"load cell on {told.port}",
            port=told.port,
            baud=told.baud,
            rate_hz=rate_hz,
            terminator=terminator,
            request=request,
            max_age_s=told.max_age_s,
            frozen_s=told.frozen_s,
            refuse_latency=True,
        )
        super().__init__(
            settings, Identity(self.DRIVER, model, serial_number, "unknown", "unknown")
        )
        self._range_n = told.range_n
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


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class LineOptions(SerialOptions):
    """Options of a load cell that the plan alone describes."""

    rate_hz: Annotated[float, Setting("Hz", 0.5, 2000.0), key("readings per second")]
    pattern: Annotated[
        Verbatim, key("regular expression of a whole line, number in group `force`")
    ] = DEFAULT_PATTERN
    unit: Annotated[str, Choice(tuple(UNITS_N)), key("unit of the number")]
    terminator: Annotated[
        str, Choice(tuple(TERMINATORS)), key("what ends a line; CR takes CR LF too")
    ] = "CR"
    request: Annotated[
        Verbatim, key("sent to get one reading (\\r, \\n allowed); empty: it streams")
    ] = ""
    zero: Annotated[
        Verbatim, key("sent to zero the device (\\r, \\n allowed); empty: it cannot")
    ] = ""
    model: Annotated[Verbatim, key("model, for the record")] = "load cell"
    serial_number: Annotated[Verbatim, key("serial number, for the record")] = "unknown"


class LineSerial(LineForceSensor):
    """Any load cell or amplifier with lines of text, described by the plan alone."""

    DRIVER = "line_serial"
    OPTIONS: ClassVar[type] = LineOptions

    def __init__(self, **options: Any) -> None:
        told = LineOptions(**options)
        pattern = line_pattern(told.pattern, "force")
        self._number = number_of(pattern, "force", UNITS_N[told.unit])
        super().__init__(
            told,
            rate_hz=told.rate_hz,
            terminator=TERMINATORS[told.terminator],
            request=escaped_bytes(told.request),
            zero=escaped_bytes(told.zero),
            model=told.model,
            serial_number=told.serial_number,
        )

    def reading(self, line: str) -> float:
        return self._number(line)
