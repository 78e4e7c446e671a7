"""The child's end of the datagram socket: never blocks, never loses, keeps order."""

from __future__ import annotations

import select
import socket
import time
from collections import deque

from stepload_drivers.ur.wire import MAX_BYTES

BACKLOG = 60_000
"""Messages kept for a run that does not read: two minutes at 500 Hz; then the oldest go."""


class Link:
    """Queue in front of a SOCK_SEQPACKET socket."""

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
