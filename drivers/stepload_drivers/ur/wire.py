"""Messages between the run's process and the child that holds ur_rtde, one per datagram of a
SOCK_SEQPACKET socket, and the child's end of it.

The first byte is the kind. Samples and targets are packed; the rest, which is rare, is JSON.
"""

from __future__ import annotations

import json
import select
import socket
import struct
import time
from collections import deque
from dataclasses import asdict
from typing import Any

from stepload.rig.device import ArmConfiguration
from stepload_drivers.motion import NO_SHIFT, Shift
from stepload_drivers.ur.state import UrState

SAMPLE = b"s"
TARGET = b"t"
BEAT = b"b"
STAGE = b"g"
HELLO = b"h"
FAULT = b"f"
REQUEST = b"r"
REPLY = b"a"
CONFIGURATION = b"c"

MAX_BYTES = 8192
BACKLOG = 60_000
"""Messages kept for a run that does not read: two minutes at 500 Hz; then the oldest go."""

_SAMPLE = struct.Struct("=cd13d3iI")
_TARGET = struct.Struct("=c3d")


def pack_sample(receive_time_s: float, state: UrState) -> bytes:
    """One data package and the host's monotonic time at which it was seen."""
    stamp_s, pose, wrench, *words = state
    return _SAMPLE.pack(SAMPLE, receive_time_s, stamp_s, *pose, *wrench, *words)


def unpack_sample(message: bytes) -> tuple[float, UrState]:
    """Inverse of `pack_sample`.

    Raises:
        ValueError: not a sample message.
    """
    if len(message) != _SAMPLE.size or message[:1] != SAMPLE:
        raise ValueError(f"not a sample: {len(message)} bytes of kind {message[:1]!r}")
    v = _SAMPLE.unpack(message)
    return v[1], UrState(v[2], v[3:9], v[9:15], *v[15:])


def pack_target(position_m: float, shift_m: Shift = NO_SHIFT) -> bytes:
    return _TARGET.pack(TARGET, position_m, *shift_m)


def unpack_target(message: bytes) -> tuple[float, Shift]:
    """Travel along the approach, and across it."""
    _, position_m, x_m, y_m = _TARGET.unpack(message)
    return position_m, (x_m, y_m)


def pack_json(kind: bytes, **fields: Any) -> bytes:
    """A rare message.

    Raises:
        ValueError: longer than a datagram may be.
    """
    message = kind + json.dumps(fields).encode()
    if len(message) > MAX_BYTES:
        raise ValueError(f"message of {len(message)} bytes, the limit is {MAX_BYTES}")
    return message


def unpack_json(message: bytes) -> dict[str, Any]:
    return dict(json.loads(message[1:]))


def pack_configuration(configuration: ArmConfiguration) -> bytes:
    return pack_json(CONFIGURATION, **asdict(configuration))


def unpack_configuration(message: bytes) -> ArmConfiguration:
    values: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in unpack_json(message).items()
    }
    return ArmConfiguration(**values)


class Link:
    """The child's end of the socket: a queue that never blocks, never loses, keeps order."""

    def __init__(self, sock: socket.socket) -> None:
        sock.setblocking(False)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 20)
        self._sock = sock
        self._backlog: deque[bytes] = deque(maxlen=BACKLOG)
        self.closed = False

    def send(self, message: bytes) -> None:
        self._backlog.append(message)
        self._flush()

    def _flush(self) -> None:
        try:
            while self._backlog:
                self._sock.send(self._backlog[0])
                self._backlog.popleft()
        except BlockingIOError:
            return
        except OSError:
            self.closed = True
            self._backlog.clear()

    def receive(self, wait_s: float) -> list[bytes]:
        """What arrived, waiting at most `wait_s` for the first."""
        if self.closed:
            time.sleep(wait_s)
            return []
        writers = [self._sock] if self._backlog else []
        select.select([self._sock], writers, [], wait_s)
        self._flush()
        messages = []
        try:
            while message := self._sock.recv(MAX_BYTES):
                messages.append(message)
            self.closed = True
        except BlockingIOError:
            pass
        except OSError:
            self.closed = True
        return messages

    def drain(self, timeout_s: float) -> None:
        """Last chance for what is queued."""
        if self._backlog and not self.closed:
            select.select([], [self._sock], [], timeout_s)
            self._flush()
