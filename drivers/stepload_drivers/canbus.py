"""CAN through python-can, with deadlines and without its silent failures.

`interface` is python-can's name of the adapter. Two of its interfaces are subclassed here:
slcan (one byte read per call, dies of a damaged line) and socketcand (a closed server reads as
silence for ever). All others are used as they are.
"""

from __future__ import annotations

import contextlib
import logging
import re
import select
import socket
import time
from typing import Annotated, Any

import can
import serial
from can.interfaces.slcan import slcanBus
from can.interfaces.socketcand import SocketCanDaemonBus

from stepload.declaration.quantities import PathText, Verbatim
from stepload.declaration.sections import key
from stepload.errors import BadInputError, DeviceError
from stepload.rig.faults import FaultCode
from stepload.rig.usb import MAX_LATENCY_MS, latency_timer_ms
from stepload_drivers.framing import CanFrame
from stepload_drivers.serialport import late_adapter

Interface = Annotated[Verbatim, key("python-can interface: socketcan, slcan, socketcand, pcan, …")]
Channel = Annotated[PathText, key("can0, /dev/ttyACM0, HOST:PORT/can0")]
WAIT_S = 0.1
"""Time limit of one read, so that a slow reader returns what it has."""
MAX_BATCH = 64
_log = logging.getLogger(__name__)


_SLCAN_LINE = re.compile(r"t([0-7][0-9A-Fa-f]{2})([0-8])((?:[0-9A-Fa-f]{2})*)", re.ASCII)
_STAMP_BYTES = 2


def slcan_frame(line: str) -> tuple[int, bytes] | None:
    """Id and data of a standard data frame's line (with or without time stamp), else None."""
    match = _SLCAN_LINE.fullmatch(line)
    if match is None:
        return None
    data, length = bytes.fromhex(match[3]), int(match[2])
    if len(data) not in (length, length + _STAMP_BYTES):
        return None
    return int(match[1], 16), data[:length]


class FastSlcan(slcanBus):
    """slcan that reads all that has arrived at once, and survives damaged lines.

    `damaged` counts lines that are no frame; slcan has no checksum, so a changed digit inside a
    well-formed line cannot be seen here. `early_s` is how long before its stamp, the time at which
    it was read, the last frame may have come.
    """

    def __init__(self, channel: str, **options: Any) -> None:
        self.damaged = 0
        self.early_s = 0.0
        self._lines: list[bytes] = []
        self._read_s = self._empty_s = time.monotonic()
        serial.Serial(channel, exclusive=True).close()  # before a command disturbs its owner
        super().__init__(channel, sleep_after_open=0.0, timeout=0.0, **options)
        self.serialPortOrig.exclusive = True

    def _read(self, timeout: float | None) -> str | None:
        if not self._lines:
            port = self.serialPortOrig
            begun_s = time.monotonic()
            if not select.select([port.fileno()], [], [], timeout)[0]:
                self._empty_s = begun_s + (timeout or 0.0)
                return None
            looked_s = time.monotonic()
            try:
                self._buffer += port.read(max(1, port.in_waiting))
            except (OSError, TypeError) as error:
                raise can.CanOperationError(f"slcan adapter is gone: {error}") from error
            self._read_s = time.monotonic()
            self.early_s, self._empty_s = self._read_s - self._empty_s, looked_s
            *lines, rest = self._buffer.replace(self._ERROR, self._OK).split(self._OK)
            self._buffer = bytearray(rest)
            self._lines = [bytes(line) for line in reversed(lines)]
        return self._lines.pop().decode("ascii", "replace") if self._lines else None

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        line = self._read(timeout)
        if not line or line in ("z", "Z"):
            return None, False
        frame = slcan_frame(line)
        if frame is None:
            self.damaged += 1
            return None, False
        return can.Message(self._read_s, frame[0], is_extended_id=False, data=frame[1]), False


GREETING = b"< hi >"


class WatchedSocketcand(SocketCanDaemonBus):
    """socketcand whose closed connection is an error instead of silence.

    It also opens a bus on which a device sends already: frames may follow the server's answer at
    once, which python-can 4.6 takes for a wrong answer.
    """

    @property
    def _link(self) -> socket.socket:
        link: socket.socket = getattr(self, "_SocketCanDaemonBus__socket")  # noqa: B009
        return link

    def _expect_msg(self, msg: str) -> None:
        answer = self._link.recv(len(msg)).decode("ascii", "replace")
        if answer != msg:
            raise can.CanInitializationError(f"expected {msg!r}, got {answer!r}")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        message, filtered = super()._recv_internal(timeout)  # type: ignore[no-untyped-call]
        if message is None:
            with contextlib.suppress(BlockingIOError):
                if self._link.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT) == b"":
                    raise can.CanOperationError("the socketcand server closed the connection")
        return message, filtered


def _gone(where: str, error: Exception) -> DeviceError:
    return DeviceError(
        f"CAN bus {where} is gone: {error}",
        code=FaultCode.NOT_CONNECTED,
        hint="check the adapter, its cable and power, then start anew",
    )


def _socketcand(channel: str, timeout_s: float) -> can.BusABC:
    """Connect to "HOST:PORT/BUS"; the greeting is tried first, with a deadline of our own."""
    address, _, bus = channel.partition("/")
    host, _, port = address.rpartition(":")
    if not (host and port.isdigit()):
        raise BadInputError(
            f"socketcand channel {channel!r} is not HOST:PORT/BUS", hint="e.g. 10.0.0.5:29536/can0"
        )
    with socket.create_connection((host, int(port)), timeout=timeout_s) as probe:
        if probe.recv(len(GREETING)) != GREETING:  # frames of a bus that is busy may follow
            raise can.CanInitializationError("no socketcand server answers there")
    return WatchedSocketcand(  # type: ignore[no-untyped-call]
        bus or "can0", host, int(port), tcp_tune=True
    )


class CanLink:
    """An open CAN bus; its errors are `DeviceError`."""

    def __init__(self, interface: str, channel: str, bitrate: int, timeout_s: float) -> None:
        self.where = f"{interface} {channel}"
        latency_ms = latency_timer_ms(channel) if interface == "slcan" else None
        try:
            if interface == "slcan":
                self._bus: can.BusABC = FastSlcan(channel, bitrate=bitrate)
            elif interface == "socketcand":
                self._bus = _socketcand(channel, timeout_s)
            else:
                self._bus = can.Bus(interface=interface, channel=channel, bitrate=bitrate)
        except (can.CanError, OSError, ValueError, ImportError) as error:
            raise DeviceError(
                f"CAN bus {self.where} cannot be opened: {error}",
                code=FaultCode.NOT_CONNECTED,
                hint="check interface, channel, bit rate, and that the link is up",
            ) from error
        _log.debug("CAN bus %s open: %d bit/s", self.where, bitrate)
        if latency_ms is not None and latency_ms > MAX_LATENCY_MS:
            self.close()
            raise late_adapter(channel, latency_ms)

    @property
    def damaged(self) -> int:
        """Number of lines from the adapter that are no frames."""
        return getattr(self._bus, "damaged", 0)

    def send(self, frame_id: int, data: bytes) -> None:
        """Send one standard data frame.

        Raises:
            DeviceError: the adapter is gone or its queue is full.
        """
        message = can.Message(arbitration_id=frame_id, data=data, is_extended_id=False)
        try:
            self._bus.send(message, timeout=0.5)
        except (can.CanError, OSError) as error:
            raise _gone(self.where, error) from error

    def receive(self, timeout_s: float = WAIT_S) -> list[CanFrame]:
        """All data frames that have arrived; waits up to `timeout_s` for the first.

        Raises:
            DeviceError: the adapter is gone.
        """
        frames: list[CanFrame] = []
        try:
            message = self._bus.recv(timeout_s)
            while message is not None:
                if not (message.is_error_frame or message.is_remote_frame):
                    early_s = getattr(self._bus, "early_s", 0.0)
                    data = bytes(message.data)
                    frames.append(
                        CanFrame(message.arbitration_id, data, message.timestamp, early_s)
                    )
                message = self._bus.recv(0) if len(frames) < MAX_BATCH else None
        except (can.CanError, OSError) as error:
            raise _gone(self.where, error) from error
        return frames

    def discard_input(self) -> None:
        """Discard all received frames."""
        while self.receive(0.0):
            pass

    def close(self) -> None:
        _log.debug("CAN bus %s closed", self.where)
        with contextlib.suppress(can.CanError, OSError, ValueError):
            self._bus.shutdown()
        if isinstance(self._bus, slcanBus):
            with contextlib.suppress(OSError):
                self._bus.serialPortOrig.close()
