"""A digital gauge that sends or answers with lines of text over a serial port."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Mapping
from typing import ClassVar

from stepload.errors import BadInputError
from stepload.rig.device import DisplacementSensor, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.options import Option
from stepload.rig.samples import DisplacementSample, Status
from stepload_drivers.arrival import ArrivalCounter, spread_back
from stepload_drivers.gauge.codec import TERMINATORS, UNITS_M, LineDecoder
from stepload_drivers.serialport import WAIT_S, SerialPort
from stepload_drivers.stream import Stream
from stepload_drivers.streamed import Deadline, Streamed

STALE_S = 0.5
ANSWER_PERIODS = 3.0
DEFAULT_PATTERN = r"(?:\d\dA)?(?P<value>[+-]?\d+(?:\.\d+)?)"


class GaugeSerial(Streamed[DisplacementSample], DisplacementSensor):
    """Displacement gauge across the contact.

    It does not identify itself over this protocol: model and serial number are what the rig file
    says. A gauge at rest repeats its reading exactly, so repetition is no fault here.
    """

    DRIVER = "gauge_serial"
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

    def __init__(
        self,
        *,
        port: str,
        baud: int = 9600,
        rate: float = 10.0,
        request: str = "",
        pattern: str = DEFAULT_PATTERN,
        terminator: str = "CR",
        unit: str = "mm",
        inverted: bool = False,
        range: float = 0.1,
        model: str = "digital gauge",
        serial_number: str = "unknown",
    ) -> None:
        try:
            groups = re.compile(pattern).groupindex
        except re.error as error:
            raise BadInputError(f"pattern {pattern!r} is no regular expression: {error}") from error
        if "value" not in groups:
            raise BadInputError(
                f"pattern {pattern!r} has no group `value`",
                hint=r"e.g. (?P<value>[+-]?\d+\.\d+)",
            )
        self.rate_hz = rate
        self._path, self._baud = port, baud
        self._pattern, self._terminator = pattern, TERMINATORS[terminator]
        self._unit_m = -UNITS_M[unit] if inverted else UNITS_M[unit]
        self._range_m = range
        self._request = request.replace("\\r", "\r").replace("\\n", "\n").encode("ascii")
        self._identity = Identity(self.DRIVER, model, serial_number, "unknown", "unknown")
        self._name = f"gauge on {port}"
        self._port: SerialPort | None = None

    def _connect(self, deadline: Deadline) -> Identity:
        self._port = SerialPort(self._path, self._baud, refuse_latency=False)
        self._port.discard_input()
        return self._identity

    def _new_stream(self) -> Stream[DisplacementSample]:
        self._period_s = 1.0 / self.rate_hz
        self._decoder = LineDecoder(self._pattern, self._unit_m, self._terminator)
        if self._request:
            self._decoder.begin_line()
        self._arrivals = ArrivalCounter(self._period_s)
        self._sequence = self._damaged = 0
        self._last_s = -math.inf
        self._asked_s = -math.inf
        self._answered = True
        stream: Stream[DisplacementSample] = Stream(
            self._name, self._period_s, max(STALE_S, 5.0 * self._period_s)
        )
        if self._port is not None and self._port.slow:
            stream.count("slow_latency_timer")
        return stream

    def _read(self, stream: Stream[DisplacementSample]) -> None:
        assert self._port is not None
        data = self._port.read(self._ask(stream) if self._request else WAIT_S)
        arrival_s = time.monotonic()
        readings = self._decoder.feed(data)
        stream.corrupt("damaged", self._decoder.damaged - self._damaged)
        self._damaged = self._decoder.damaged
        if not readings:
            return
        if self._request:
            self._answered = True
            times = [arrival_s] * len(readings)
        else:
            lost = self._arrivals.arrived(len(readings), arrival_s)
            stream.lose(lost)
            self._sequence += max(0, lost)
            times = spread_back(len(readings), arrival_s, self._arrivals.period_s, self._last_s)
        self._last_s = arrival_s
        stream.put(
            [self._sample(r, t, stream) for r, t in zip(readings, times, strict=True)], arrival_s
        )

    def _ask(self, stream: Stream[DisplacementSample]) -> float:
        """Send a request when it is time; seconds until the next look."""
        assert self._port is not None
        now_s = time.monotonic()
        if not self._answered and now_s - self._asked_s > ANSWER_PERIODS * self._period_s:
            stream.count("timeouts")
            stream.lose(1)
            self._sequence += 1
            self._answered = True
        if self._answered and now_s - self._asked_s >= self._period_s:
            self._port.write(self._request)
            self._asked_s = now_s
            self._answered = False
        return WAIT_S if not self._answered else min(WAIT_S, self._asked_s + self._period_s - now_s)

    def _sample(
        self, reading_m: float, time_s: float, stream: Stream[DisplacementSample]
    ) -> DisplacementSample:
        self._sequence += 1
        status = 0
        if abs(reading_m) > self._range_m:
            status = int(Status.OVERRANGE)
            stream.latch(
                FaultCode.OUT_OF_RANGE,
                f"{self._name} reads {reading_m * 1e3:.4f} mm (range ± {self._range_m * 1e3:g} mm)",
                "check `unit`, `pattern` and `range` against the gauge's manual",
            )
        return DisplacementSample(self._sequence, math.nan, time_s, status, reading_m)

    def _disconnect(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            port.close()
