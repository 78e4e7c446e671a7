"""A digital gauge that sends or answers with lines of text over a serial port."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import Baud, Choice, Flag, Setting, Verbatim
from stepload.declaration.sections import SECTION, key
from stepload.rig.device import DisplacementSensor, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.samples import DisplacementSample, Status
from stepload_drivers.line.codec import TERMINATORS, escaped_bytes, line_pattern, number_of
from stepload_drivers.line.sensor import LineSensor, LineSettings
from stepload_drivers.serialport import Port
from stepload_drivers.stream import Stream

STALE_S = 0.5
UNITS_M = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254}
DEFAULT_PATTERN = r"(?:\d\dA)?(?P<value>[+-]?\d+(?:\.\d+)?)"


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class GaugeOptions:
    """Options of a digital gauge with a serial port."""

    port: Port
    baud: Annotated[Baud, key("bit rate")] = 9600
    rate_hz: Annotated[float, Setting("Hz", 0.5, 1000.0), key("readings per second")] = 10.0
    request: Annotated[
        Verbatim, key("sent to get one reading (\\r, \\n allowed); empty: it streams")
    ] = ""
    pattern: Annotated[
        Verbatim, key("regular expression of a whole line, number in group `value`")
    ] = DEFAULT_PATTERN
    terminator: Annotated[str, Choice(tuple(TERMINATORS)), key("what ends a line")] = "CR"
    unit: Annotated[str, Choice(tuple(UNITS_M)), key("unit of the number")] = "mm"
    inverted: Annotated[Flag, key("the reading falls when the gap closes")] = False
    range_m: Annotated[float, Setting("m", 0.0, 10.0), key("largest possible |reading|")] = 0.1
    model: Annotated[Verbatim, key("model, for the record")] = "digital gauge"
    serial_number: Annotated[Verbatim, key("serial number, for the record")] = "unknown"


class GaugeSerial(LineSensor[DisplacementSample], DisplacementSensor):
    """Displacement gauge across the contact.

    It does not identify itself over this protocol: model and serial number are what the rig file
    says. A gauge at rest repeats its reading exactly, so repetition is no fault here.
    """

    DRIVER = "gauge_serial"
    VALUE = "displacement_m"
    OPTIONS: ClassVar[type] = GaugeOptions

    def __init__(self, **options: Any) -> None:
        told = GaugeOptions(**options)
        settings = LineSettings(
            name=f"gauge on {told.port}",
            port=told.port,
            baud=told.baud,
            rate_hz=told.rate_hz,
            terminator=TERMINATORS[told.terminator],
            request=escaped_bytes(told.request),
            max_age_s=STALE_S,
            frozen_s=math.inf,
            refuse_latency=False,
        )
        super().__init__(
            settings, Identity(self.DRIVER, told.model, told.serial_number, "unknown", "unknown")
        )
        scale = UNITS_M[told.unit] * (-1.0 if told.inverted else 1.0)
        self._number = number_of(line_pattern(told.pattern, "value"), "value", scale)
        self._range_m = told.range_m

    def reading(self, line: str) -> float:
        return self._number(line)

    def _sample(
        self, value: float, sequence: int, time_s: float, stream: Stream[DisplacementSample]
    ) -> DisplacementSample:
        status = 0
        if abs(value) > self._range_m:
            status = int(Status.OVERRANGE)
            stream.latch(
                FaultCode.OUT_OF_RANGE,
                f"{self._name} reads {value * 1e3:.4f} mm (range ± {self._range_m * 1e3:g} mm)",
                "check `unit`, `pattern` and `range` against the gauge's manual",
            )
        return DisplacementSample(sequence, math.nan, time_s, status, value)
