"""The emulator's end of a wire: a pseudo-terminal, or a TCP server; whole writes or none."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import socket
import tty
from abc import ABC, abstractmethod
from typing import Protocol

MAX_READ = 65536


class Wire(Protocol):
    """A byte stream to any connected client. `address` is what a driver connects to."""

    address: str

    def fileno(self) -> int:
        """File descriptor that becomes readable when bytes or a client arrive; -1 when closed."""
        ...

    def read(self) -> bytes:
        """What has arrived; never waits."""
        ...

    def write(self, data: bytes) -> bool:
        """Send all of `data`, or nothing when the other end does not take it."""
        ...

    def close(self) -> None: ...


class Whole(ABC):
    """Writes all or nothing: the rest of a write that began goes first."""

    _rest = b""

    @abstractmethod
    def _put(self, data: bytes) -> int:
        """Write what the other end takes of it; how many bytes that were."""

    def write(self, data: bytes) -> bool:
        if self._rest:
            self._rest = self._rest[self._put(self._rest) :]
            if self._rest:
                return False
        put = self._put(data)
        self._rest = data[put:] if put else b""
        return put > 0


class PtyWire(Whole):
    """A raw pseudo-terminal. It has back-pressure where a UART has none, so what does not fit is
    dropped, as an overrun would."""

    def __init__(self) -> None:
        self._master, self._slave = pty.openpty()
        tty.setraw(self._master)
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.address = os.ttyname(self._slave)

    def fileno(self) -> int:
        return self._master

    def read(self) -> bytes:
        try:
            return os.read(self._master, MAX_READ)
        except (BlockingIOError, OSError):
            return b""

    def _put(self, data: bytes) -> int:
        try:
            return os.write(self._master, data)
        except (BlockingIOError, OSError):
            return 0

    def steal(self, most: int) -> bytes:
        """Read at the host's end, as a second process on the same port would."""
        if not select.select([self._slave], [], [], 0.0)[0]:
            return b""
        return os.read(self._slave, most)

    def close(self) -> None:
        for name in ("_slave", "_master"):
            descriptor = getattr(self, name)
            setattr(self, name, -1)
            if descriptor >= 0:
                with contextlib.suppress(OSError):
                    os.close(descriptor)


class TcpWire(Whole):
    """A server on loopback for one client at a time; a new client replaces the old one."""

    def __init__(self, greeting: bytes = b"", port: int = 0) -> None:
        self._greeting = greeting
        self._server = socket.create_server(("127.0.0.1", port))
        self._server.setblocking(False)
        self._client: socket.socket | None = None
        self.address = f"127.0.0.1:{self._server.getsockname()[1]}"

    def fileno(self) -> int:
        return self._server.fileno()

    def client_fileno(self) -> int:
        """The connected client's descriptor, -1 without one."""
        return self._client.fileno() if self._client is not None else -1

    def accept(self) -> None:
        """Take a waiting client, if any, and greet it."""
        with contextlib.suppress(BlockingIOError, OSError):
            client, _ = self._server.accept()
            self._drop_client()
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            client.setblocking(False)
            self._client, self._rest = client, b""
            if self._greeting:
                client.sendall(self._greeting)

    def read(self) -> bytes:
        self.accept()
        if self._client is None:
            return b""
        try:
            data = self._client.recv(MAX_READ)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._drop_client()
        return data

    def _put(self, data: bytes) -> int:
        if self._client is None:
            return 0
        try:
            return self._client.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            self._drop_client()
            return 0

    def _drop_client(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None

    def close(self) -> None:
        self._drop_client()
        self._server.close()
