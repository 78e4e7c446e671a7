"""Common base of all sensors that send, or answer with, one line of text per reading."""

from __future__ import annotations

import math
import time
from abc import abstractmethod
from typing import NamedTuple, TypeVar

from stepload.rig.device import Identity
from stepload_drivers.arrival import ArrivalCounter
from stepload_drivers.line.codec import LineDecoder
from stepload_drivers.serialport import WAIT_S, SerialPort
from stepload_drivers.stream import Stream
from stepload_drivers.streamed import Deadline, Streamed
from stepload_drivers.tcp import TcpLink

Sample = TypeVar("Sample")

ANSWER_PERIODS = 3.0
STALE_PERIODS = 5.0


class LineSettings(NamedTuple):
    """Communication settings of a text-line sensor, each as `LineForceSensor` has it.

    Besides, `name` is the sensor as the user knows it, for messages, a `frozen_s` of inf allows
    readings to repeat for ever, and `refuse_latency` refuses a USB adapter that delivers in bursts.
    """

    name: str
    rate_hz: float
    terminator: bytes
    request: bytes
    max_age_s: float
    frozen_s: float
    port: str = ""
    baud: int = 0
    refuse_latency: bool = False


class LineSensor(Streamed[Sample]):
    """Opens the port, sends requests if needed, and stamps, counts and checks the readings.

    Lines carry no counter and no clock: losses are estimated from arrival times, or counted as
    requests without an answer. A subclass gives `reading` and `_sample`, and may give `_identify`,
    or `_connect` where it is not read by a serial port.
    """

    rate_hz: float
    _link: SerialPort | TcpLink | None = None

    def __init__(self, settings: LineSettings, identity: Identity) -> None:
        self._line = settings
        self._identity = identity
        self._name = settings.name
        self.rate_hz = settings.rate_hz
        self._period_s = 1.0 / settings.rate_hz

    @abstractmethod
    def reading(self, line: str) -> float:
        """The value of one line in SI units.

        Raises:
            ValueError: the line is no reading; it is counted as damaged.
            DeviceError: the line reports a fault of the sensor; it is latched.
        """

    @abstractmethod
    def _sample(self, value: float, sequence: int, time_s: float, stream: Stream[Sample]) -> Sample:
        """The sample of one reading; latches a fault of its value."""

    def _identify(self, port: SerialPort, deadline: Deadline) -> Identity:
        """Identity of the device: as configured, unless a subclass reads it from the device."""
        return self._identity

    def _connect(self, deadline: Deadline) -> Identity:
        line = self._line
        port = self._link = SerialPort(line.port, line.baud, refuse_latency=line.refuse_latency)
        port.discard_input()
        return self._identify(port, deadline)

    def _new_stream(self) -> Stream[Sample]:
        line = self._line
        self._decoder = LineDecoder(self.reading, line.terminator)
        if line.request:
            self._decoder.begin_line()
        self._arrivals = ArrivalCounter(self._period_s)
        self._sequence = 0
        self._requested_s = -math.inf
        self._answered = True
        stale_s = max(line.max_age_s, STALE_PERIODS * self._period_s)
        return self._empty_stream(stale_s, line.frozen_s)

    def _read(self, stream: Stream[Sample]) -> None:
        assert self._link is not None
        data = self._link.read(self._ask(stream) if self._line.request else WAIT_S)
        arrival_s = time.monotonic()
        values = self._decoder.feed(data)
        stream.total("damaged", self._decoder.damaged, corrupt=True)
        if not values:
            return
        if self._line.request:
            self._answered = True
            times = [arrival_s] * len(values)
        else:
            lost, times = self._arrivals.stamped(len(values), arrival_s)
            stream.lose(lost)
            self._sequence += max(0, lost)
        samples = []
        for value, time_s in zip(values, times, strict=True):
            self._sequence += 1
            samples.append(self._sample(value, self._sequence, time_s, stream))
        stream.put(samples, arrival_s)

    def _ask(self, stream: Stream[Sample]) -> float:
        """Send a request when it is due; returns the seconds until the next check."""
        assert self._link is not None
        now_s = time.monotonic()
        if not self._answered and now_s - self._requested_s > ANSWER_PERIODS * self._period_s:
            stream.count("timeouts")
            stream.lose(1)
            self._sequence += 1
            self._answered = True
        due_s = self._requested_s + self._period_s
        if self._answered and now_s >= due_s:
            self._link.write(self._line.request)
            self._requested_s = due_s if now_s - due_s < self._period_s else now_s
            self._answered = False
        return (
            WAIT_S
            if not self._answered
            else min(WAIT_S, self._requested_s + self._period_s - now_s)
        )
