"""A sensor read by one thread: the common part of `stepload.rig.device.Device`."""

from __future__ import annotations

import contextlib
import logging
import math
import os
import threading
import time
from abc import abstractmethod
from collections.abc import Callable
from operator import attrgetter
from typing import Annotated, Any, ClassVar, Generic, TypeVar

from stepload.declaration.quantities import Setting, Verbatim
from stepload.declaration.sections import key
from stepload.errors import DeviceError
from stepload.rig.device import Device, Health, Identity
from stepload.rig.faults import Fault, FaultCode
from stepload_drivers.stream import Stream

Sample = TypeVar("Sample")
Reply = TypeVar("Reply")

STALE_S = 0.1
REPLY_S = 0.5
"""Time in s for an answer; it is asked before and after a run. A sensor takes some ms, a busy host
more."""
_log = logging.getLogger(__name__)
MaxAge = Annotated[
    float, Setting("s", 0.02, 5.0), key("silence after which the sensor counts as dead")
]
OtherSensor = Annotated[Verbatim, key("refuse a sensor with another serial number")]


class Deadline:
    """A moment by which `open` must be done."""

    def __init__(self, timeout_s: float) -> None:
        self._at_s = time.monotonic() + timeout_s
        self._timeout_s = timeout_s

    @property
    def running(self) -> bool:
        """Whether there is time left."""
        return time.monotonic() < self._at_s

    def left_s(self, what: str) -> float:
        """Seconds left.

        Raises:
            DeviceError: none left while waiting for `what`.
        """
        left_s = self._at_s - time.monotonic()
        if left_s <= 0.0:
            raise DeviceError(
                f"{what}: not there within {self._timeout_s:g} s",
                code=FaultCode.NOT_CONNECTED,
                hint="check power, cable, port name and bit rate",
            )
        return left_s


def ask_twice(
    log: logging.Logger,
    name: str,
    request: str,
    deadline: Deadline,
    exchange: Callable[[Deadline], Reply | None],
    hint: str,
) -> Reply:
    """The reply to a request, which `exchange` sends; sent twice when the first goes unanswered.

    Args:
        exchange: sends the request and waits for its reply until the deadline it is given.

    Raises:
        DeviceError: no reply.
    """
    for _ in range(2):
        wait = Deadline(min(REPLY_S, deadline.left_s(f"{name}: {request}")))
        reply = exchange(wait)
        log.debug("%s <- %s -> %s", name, request, "no answer" if reply is None else reply)
        if reply is not None:
            return reply
    raise DeviceError(
        f"{name} does not answer {request} within {REPLY_S:g} s",
        code=FaultCode.NOT_CONNECTED,
        hint=hint,
    )


def require_serial_number(name: str, found: str, expected: str) -> None:
    """Refuse another device than the rig file names; an empty `expected` takes any.

    Raises:
        DeviceError: another serial number.
    """
    if expected and found != expected:
        raise DeviceError(
            f"{name} has serial number {found!r}, the rig file says {expected!r}",
            code=FaultCode.WRONG_DEVICE,
            hint="connect the right device, or correct `serial_number` in the rig file",
        )


def prefer_this_thread() -> None:
    """First in, first out, at the lowest real-time priority; threads started later inherit it.

    A thread that waits for its turn with the interpreter held makes the run's loop wait as well.
    """
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))


class Reader(threading.Thread):
    """Reads until stopped; whatever the sensor raises becomes the stream's fault.

    The fault is logged here: a log that blocks must not hold up the engine's thread.
    """

    def __init__(self, sensor: Streamed[Sample], stream: Stream[Sample]) -> None:
        super().__init__(name=f"read {stream.name}", daemon=True)
        self._sensor = sensor
        self._stream = stream
        self._halt = threading.Event()
        self._logged = False

    def run(self) -> None:
        prefer_this_thread()
        try:
            while not self._halt.is_set():
                began_s = time.monotonic()
                self._sensor._read(self._stream)
                self._stream.looked(began_s)
                if self._stream.latched is not None:
                    self._log_fault()
        except DeviceError as error:
            self._stream.latch(FaultCode(error.code), error.message, error.hint)
        except Exception as error:
            self._stream.latch(
                FaultCode.DRIVER,
                f"{self._stream.name}: the reader died of {type(error).__name__}: {error}",
                "a bug of the driver: please report it with the record",
            )

        self._log_fault()

    def _log_fault(self) -> None:
        """Log the stream's fault once."""
        fault = self._stream.latched
        if fault is not None and not self._logged:
            self._logged = True
            _log.warning("%s: fault %s: %s", self._stream.name, fault.code.value, fault.message)

    def stop(self) -> None:
        self._halt.set()
        self.join(timeout=2.0)
        self._log_fault()


class Streamed(Device, Generic[Sample]):
    """Open, drain, health, fault, safe and close of a sensor that is read by a thread.

    A subclass gives `_connect`, which sets `_link`, `_new_stream` and `_read`, and `_stop` where
    the data must be stopped. `_read` waits at most about 0.1 s and is called only from the reader
    thread, all else only from the engine's.
    """

    VALUE: ClassVar[str] = "wrench"
    """The field of a sample that must not repeat itself exactly for long."""

    _name: str
    _period_s: float
    _stream: Stream[Sample] | None = None
    _reader: Reader | None = None
    _link: Any = None

    @abstractmethod
    def _connect(self, deadline: Deadline) -> Identity:
        """Open the port, identify, configure, start the data."""

    @abstractmethod
    def _new_stream(self) -> Stream[Sample]:
        """A new stream for the rate that `_connect` has determined."""

    @abstractmethod
    def _read(self, stream: Stream[Sample]) -> None:
        """Move what has arrived into `stream`."""

    def _empty_stream(self, stale_s: float, frozen_s: float) -> Stream[Sample]:
        """A stream of this sensor at its period, with a count of 1 for a link known as slow."""
        stream: Stream[Sample] = Stream(
            self._name, self._period_s, stale_s, frozen_s, attrgetter(self.VALUE)
        )
        if getattr(self._link, "slow", False):
            stream.count("slow_latency_timer")
        return stream

    def _stop(self, link: Any) -> None:
        """Stop the data; may raise."""

    def _disconnect(self) -> None:
        """Stop the data and release the port; may raise, may be called unconnected."""
        link, self._link = self._link, None
        if link is not None:
            with contextlib.closing(link):
                self._stop(link)

    def open(self, timeout_s: float) -> Identity:
        self.close()
        deadline = Deadline(timeout_s)
        try:
            identity = self._connect(deadline)
            stream = self._new_stream()
            self._stream = stream
            self._reader = Reader(self, stream)
            self._reader.start()
            stream.wait_first(deadline.left_s(stream.name))
        except BaseException:
            self.close()
            raise
        _log.info("%s: open at %.6g Hz, %s", stream.name, 1.0 / stream.period_s, identity)
        return identity

    def drain(self) -> list[Sample]:
        return self._stream.drain() if self._stream else []

    def health(self) -> Health:
        return self._stream.health() if self._stream else Health(0, 0, 0.0, math.inf, 0.0, {})

    def fault(self) -> Fault | None:
        return self._stream.fault() if self._stream else None

    def safe(self, timeout_s: float) -> None:
        """Do nothing: a sensor drives nothing, and its data must show the arm's retract."""

    def close(self) -> None:
        if self._reader is not None and self._stream is not None:
            self._reader.stop()
            self._reader = None
            _log.info("%s: closed, %s", self._stream.name, self._stream.health())
        with contextlib.suppress(Exception):
            self._disconnect()
