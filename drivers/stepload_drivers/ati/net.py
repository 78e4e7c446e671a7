"""ATI Net F/T, Ethernet Axia, and what else speaks RDT over UDP."""

from __future__ import annotations

import contextlib
import logging
import math
import select
import socket
import time
from typing import Annotated, Any, ClassVar

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import PathText, Setting, Verbatim, number
from stepload.declaration.sections import SECTION, key
from stepload.errors import DeviceError
from stepload.rig.device import ForceSensor, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.samples import ForceSample, SixFloats, Status
from stepload_drivers.ati import box, rdt
from stepload_drivers.ati.box import HTTP_PORT
from stepload_drivers.ati.rdt import MONITOR, SUMMARY, Command, Record, step
from stepload_drivers.stream import JUMP_S, ClockWatch, Stream
from stepload_drivers.streamed import STALE_S, Deadline, MaxAge, Streamed, require_serial_number

FROZEN_S = 0.05
WAIT_S = 0.05
ASK_AGAIN_S = 0.2
MEASURED_RECORDS = 33
RATE_TOLERANCE = 0.05
LOOK_S = 5e-4
"""Least time between two reads of a stream faster than 1 kHz: several records are read at once."""
BUFFER_BYTES = 4 << 20
"""Requested buffer; Linux gives at most net.core.rmem_max, and counts some 800 bytes a datagram."""
MOST_AT_ONCE = 1024
LONGEST = 2048
_log = logging.getLogger(__name__)


class UdpLink:
    """A socket connected to `host` and `port`, so that the kernel drops datagrams of others.

    Raises:
        DeviceError: no such address, or no way to it.
    """

    def __init__(self, host: str, port: int) -> None:
        self.where = f"{host}:{port}"
        self._sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
            self._sock.connect((host, port))
            self._sock.setblocking(False)
        except OSError as error:
            self._sock.close()
            raise self._lost(error) from error
        _log.debug("UDP %s open", self.where)

    def _lost(self, error: OSError) -> DeviceError:
        return DeviceError(
            f"UDP {self.where}: {error}",
            code=FaultCode.NOT_CONNECTED,
            hint="check power, cable, the address, and that this computer has one in its network",
        )

    def send(self, data: bytes) -> None:
        """Send one datagram; whether it arrives is not known.

        Raises:
            DeviceError: it could not leave, or the peer has refused an earlier one.
        """
        _log.debug("UDP %s <- %s", self.where, data.hex())
        try:
            self._sock.send(data)
        except OSError as error:
            raise self._lost(error) from error

    def receive(self, timeout_s: float) -> list[bytes]:
        """All datagrams that have arrived; waits `timeout_s` for the first one.

        Raises:
            DeviceError: the peer reports that its port is closed.
        """
        taken: list[bytes] = []
        take, add = self._sock.recv, taken.append
        try:
            if select.select([self._sock], [], [], timeout_s)[0]:
                with contextlib.suppress(BlockingIOError):
                    for _ in range(MOST_AT_ONCE):
                        add(take(LONGEST))
        except OSError as error:
            raise self._lost(error) from error
        return taken

    def close(self) -> None:
        """Close the socket; idempotent."""
        self._sock.close()


_Port = Annotated[int, number(1, 65535)]


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class AtiNetOptions:
    """Options of a device that speaks RDT."""

    host: Annotated[PathText, key("address of the device, a number rather than a name")]
    port: Annotated[_Port, key("UDP port of RDT")] = rdt.PORT
    http_port: Annotated[_Port, key("port of its pages")] = HTTP_PORT
    rate_hz: Annotated[
        Annotated[float, Setting("Hz", 10.0, 8000.0)] | None,
        key("records per second; refuse a device that sends at another"),
    ] = None
    serial_number: Annotated[
        Verbatim, key("refuse another serial number of the active calibration")
    ] = ""
    max_age_s: MaxAge = STALE_S


class AtiNet(Streamed[ForceSample], ForceSensor):
    """An Ethernet force-torque sensor that streams RDT records to one client.

    Losses are counted by `rdt_sequence`, the device's time by `ft_sequence`. Nothing is set in the
    device: rate, units, filter and calibration are those of its own pages, and are read.
    """

    DRIVER = "ati_net"
    ADDRESS = ("host", "port")
    OPTIONS: ClassVar[type] = AtiNetOptions

    def __init__(self, **options: Any) -> None:
        self._options = AtiNetOptions(**options)
        self.rate_hz = self._options.rate_hz or 1000.0
        self._name = f"RDT sensor at {self._options.host}"
        self._link: UdpLink | None = None
        self._gone = False

    def _connect(self, deadline: Deadline) -> Identity:
        told = self._options
        described = box.read_box(
            box.fetch(told.host, told.http_port, self._name, deadline), self._name
        )
        require_serial_number(self._name, described.serial_number, told.serial_number)
        self._link = UdpLink(told.host, told.port)
        steps, self._last = self._first_records(self._link, deadline)
        self._internal_hz = described.internal_hz
        self.rate_hz = described.internal_hz / steps
        asked_hz = told.rate_hz or self.rate_hz
        if abs(self.rate_hz / asked_hz - 1.0) > RATE_TOLERANCE:
            raise DeviceError(
                f"{self._name} sends {self.rate_hz:.0f} records per second, the plan says "
                f"{asked_hz:.0f}",
                code=FaultCode.WRONG_DEVICE,
                hint="set its RDT output rate on its own web pages, or correct `rate`",
            )
        self._scale, self._status_word = described.scale, described.status
        self._rated_n = described.rated_n
        self._rated_text = ", ".join(f"{rated:g}" for rated in described.rated_n)
        return Identity(
            self.DRIVER,
            described.model,
            described.serial_number,
            described.firmware,
            described.calibration,
        )

    def _first_records(self, link: UdpLink, deadline: Deadline) -> tuple[float, Record]:
        """Start the stream; inner measurements from one record to the next, and the last record."""
        records: list[Record] = []
        requested_s = -math.inf
        while len(records) < MEASURED_RECORDS:
            deadline.left_s(f"{self._name}: records after the request")
            now_s = time.monotonic()
            if not records and now_s - requested_s > ASK_AGAIN_S:
                link.send(rdt.request(Command.START))
                requested_s = now_s
            records += filter(None, map(rdt.decode, link.receive(WAIT_S)))
        first, last = records[0], records[-1]
        sent = step(first.rdt_sequence, last.rdt_sequence)
        measured = step(first.ft_sequence, last.ft_sequence)
        if sent < 1 or measured < sent:
            raise DeviceError(
                f"{self._name}: {sent} records on its count of measurements went on by {measured}",
                code=FaultCode.CLOCK,
                hint="power it off and on; is it a device that speaks RDT?",
            )
        return measured / sent, last

    def _new_stream(self) -> Stream[ForceSample]:
        self._period_s = 1.0 / self.rate_hz
        self._pause_s = LOOK_S if self.rate_hz > 1000.0 * (1.0 + RATE_TOLERANCE) else 0.0
        self._sequence, self._measurements = 0, self._last.ft_sequence
        self._received_s = time.monotonic()
        self._gone = False
        self._watch = ClockWatch(self._options.max_age_s)
        return self._empty_stream(self._options.max_age_s, max(FROZEN_S, 25.0 * self._period_s))

    def _read(self, stream: Stream[ForceSample]) -> None:
        assert self._link is not None
        if self._pause_s:
            time.sleep(self._pause_s)
        data = self._link.receive(WAIT_S)
        arrival_s = time.monotonic()
        fresh: list[tuple[Record, int, float]] = []
        for datagram in data:
            record = rdt.decode(datagram)
            if record is None:
                stream.corrupt("length")
            elif self._is_next(record, stream):
                device_s = self._measurements / self._internal_hz
                fresh.append((record, self._sequence, device_s))
        if not fresh:
            if arrival_s - self._received_s > self._options.max_age_s and not self._gone:
                self._tell_silence(arrival_s - self._received_s, stream)
            return
        self._received_s = arrival_s
        times_s = self._watch.arrivals([device_s for *_, device_s in fresh], arrival_s, stream)
        samples = []
        for (record, sequence, device_s), time_s in zip(fresh, times_s, strict=True):
            wrench = self._scale.wrench(record.counts)
            status = self._status(record.status, wrench, stream)
            samples.append(ForceSample(sequence, device_s, time_s, status, wrench, math.nan))
        stream.put(samples, arrival_s)

    def _is_next(self, record: Record, stream: Stream[ForceSample]) -> bool:
        """Whether the record is newer than the last one; counts what was lost between the two."""
        sent = step(self._last.rdt_sequence, record.rdt_sequence)
        measured = step(self._last.ft_sequence, record.ft_sequence)
        jump = JUMP_S * self._internal_hz
        if abs(measured) > jump or (measured == 0 and sent > 0):
            stream.latch(
                FaultCode.CLOCK,
                f"{self._name}: its count of measurements went on by {measured} from one record to "
                f"the next ({self._internal_hz:.0f} a second)",
                "the device has restarted or its clock stands still: start anew, tare again",
            )
        if measured < 0 or (measured == 0 and sent <= 0):
            stream.count("repeated" if measured == 0 else "out_of_order")
            return False
        if sent <= 0:
            stream.count("begun_anew")
            sent = max(1, round(measured / self._internal_hz * self.rate_hz))
        stream.lose(sent - 1)
        self._sequence += sent
        self._measurements += measured
        self._last = record
        return True

    def _status(self, word: int, wrench: SixFloats, stream: Stream[ForceSample]) -> int:
        status = 0
        if any(abs(force) > rated for force, rated in zip(wrench, self._rated_n, strict=False)):
            status |= Status.OVERRANGE
            stream.latch(
                FaultCode.OVERLOAD,
                f"{self._name}: force {wrench[0]:.1f}, {wrench[1]:.1f}, {wrench[2]:.1f} N is "
                f"beyond its calibrated range of {self._rated_text} N",
                "unload, and check the sensor's zero before going on",
            )
        if word & ~(MONITOR | SUMMARY) or word == SUMMARY:
            overload = bool(word & self._status_word.overload)
            status |= Status.SATURATED if overload else Status.DEVICE_FAULT
            stream.latch(
                FaultCode.OVERLOAD if overload else FaultCode.DEVICE_REPORTS,
                f"{self._name} reports: {self._status_word.text(word)} (status {word:#010x})",
                "unload, then check the transducer's cable and the device's own web pages",
            )
        elif word:
            stream.count("status_bits")
        return int(status)

    def _tell_silence(self, age_s: float, stream: Stream[ForceSample]) -> None:
        """Why no data arrive: the device serves one client, and a second one takes the stream."""
        self._gone = True
        alive = box.answers(self._options.host, self._options.http_port)
        stream.latch(
            FaultCode.STALE,
            f"{self._name}: newest sample is {age_s:.3f} s old "
            f"(limit {self._options.max_age_s:g} s)"
            + (", although the device answers on its pages" if alive else ""),
            "another program has asked the device for its stream, which it sends to one only, or "
            "it was restarted: end the other one"
            if alive
            else "check power and cable; another program may have taken the stream",
        )

    def bias(self, timeout_s: float) -> bool:
        """Make the present force the device's zero; no reply is sent, so none is waited for."""
        if self._link is None:
            return False
        self._link.send(rdt.request(Command.BIAS))
        _log.info("%s: zeroed by its own command", self._name)
        return True

    def _stop(self, link: UdpLink) -> None:
        if not self._gone:  # else it would stop the stream of another client
            link.send(rdt.request(Command.STOP))
