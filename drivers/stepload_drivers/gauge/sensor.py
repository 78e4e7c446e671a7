"""A digital gauge that sends or answers with lines of text over a serial port."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from stepload.rig.device import DisplacementSensor, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.options import Option
from stepload.rig.samples import DisplacementSample, Status
from stepload_drivers.line.codec import TERMINATORS, escaped_bytes
from stepload_drivers.line.pattern import line_pattern, number_of
from stepload_drivers.line.sensor import LineSensor, LineSettings
from stepload_drivers.options import values
from stepload_drivers.stream import Stream

STALE_S = 0.5
UNITS_M = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254}
DEFAULT_PATTERN = r"(?:\d\dA)?(?P<value>[+-]?\d+(?:\.\d+)?)"


class GaugeSerial(LineSensor[DisplacementSample], DisplacementSensor):
    """Displacement gauge across the contact.

    It does not identify itself over this protocol: model and serial number are what the rig file
    says. A gauge at rest repeats its reading exactly, so repetition is no fault here.
    """

    DRIVER = "gauge_serial"
    VALUE = "displacement_m"
    OPTIONS: ClassVar[Mapping[str, Option]] = {
        "port": Option("text", "serial port, e.g. /dev/serial/by-id/…", required=True),
        "baud": Option("integer", "bit rate", default=9600),
        "rate": Option(
            "quantity", "readings per second", unit="Hz", default=10.0, low=0.5, high=1000.0
        ),
        "request": Option(
            "text", "sent to get one reading (\\r, \\n allowed); empty: it streams", default=""
        ),
        "pattern": Option(
            "text",
            "regular expression of a whole line, number in group `value`",
            default=DEFAULT_PATTERN,
        ),
        "terminator": Option("text", "what ends a line", default="CR", choices=tuple(TERMINATORS)),
        "unit": Option("text", "unit of the number", default="mm", choices=tuple(UNITS_M)),
        "inverted": Option("boolean", "the reading falls when the gap closes", default=False),
        "range": Option("quantity", "largest possible |reading|", unit="m", default=0.1, low=0.0),
        "model": Option("text", "model, for the record", default="digital gauge"),
        "serial_number": Option("text", "serial number, for the record", default="unknown"),
    }

    def __init__(self, **options: Any) -> None:
        told = values(self.OPTIONS, options)
        settings = LineSettings(
            name=f"gauge on {told['port']}",
            port=told["port"],
            baud=told["baud"],
            rate_hz=told["rate"],
            terminator=TERMINATORS[told["terminator"]],
            request=escaped_bytes(told["request"]),
            max_age_s=STALE_S,
            frozen_s=math.inf,
            refuse_latency=False,
        )
        model, serial_number = told["model"], told["serial_number"]
        super().__init__(
            settings, Identity(self.DRIVER, model, serial_number, "unknown", "unknown")
        )
        scale = UNITS_M[told["unit"]] * (-1.0 if told["inverted"] else 1.0)
        self._number = number_of(line_pattern(told["pattern"], "value"), "value", scale)
        self._range_m = told["range"]

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
