"""Both ends of a TCP connection: a driver's link, and an emulator that sends lines of text."""

from __future__ import annotations

import contextlib
import select
import socket
import threading
import time
from collections.abc import Iterator
from typing import Self

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode

WRITE_S = 0.5


class TcpLink:
    """A connection to `host` and `port`.

    Raises:
        DeviceError: from every call: nobody answers within `timeout_s`, or the connection is gone.
    """

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        self._where = f"{host}:{port}"
        with self._there():
            self._socket = socket.create_connection((host, port), timeout_s)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket.settimeout(WRITE_S)

    @contextlib.contextmanager
    def _there(self) -> Iterator[None]:
        try:
            yield
        except (OSError, ValueError) as error:
            raise DeviceError(
                f"TCP {self._where}: {error}",
                code=FaultCode.NOT_CONNECTED,
                hint="check power, cable and address, and that nothing else has the connection",
            ) from error

    def read(self, timeout_s: float = 0.05) -> bytes:
        """What has arrived; waits up to `timeout_s` for the first byte."""
        with self._there():
            if not select.select([self._socket], [], [], timeout_s)[0]:
                return b""
            if not (data := self._socket.recv(65536)):
                raise ConnectionError("the device has closed the connection")
        return data

    def write(self, data: bytes) -> None:
        """Send all of `data`."""
        with self._there():
            self._socket.sendall(data)

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._socket.close()


class LineServer:
    """Serves one client after the other on a free port of loopback, while used as a context.

    A subclass gives `line`, which is sent `rate_hz` times a second, `take` or both. `options` are
    those of a driver that is to reach it; while `silent`, nothing is sent on the open connection.
    """

    def __init__(self, rate_hz: float) -> None:
        self.silent = False
        self._period_s = 1.0 / rate_hz
        self._server = socket.create_server(("127.0.0.1", 0))
        self.options = {"host": "127.0.0.1", "port": self._server.getsockname()[1]}
        self._halt = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def line(self) -> bytes:
        """What the device sends each period; empty: nothing."""
        return b""

    def take(self, line: bytes) -> bytes:
        """What the device answers to a line, which comes without its end; empty: nothing."""
        return b""

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._halt.set()
        self._thread.join()

    def serve_for_good(self) -> None:
        """Print the options that reach it, and serve until the program is ended."""
        with self:
            print(*(f"--options {key}={value}" for key, value in self.options.items()), flush=True)
            self._halt.wait()

    def _serve(self) -> None:
        with self._server as server:
            server.settimeout(0.05)
            while not self._halt.is_set():
                with contextlib.suppress(OSError):  # nobody has come, or the client has gone
                    link, _ = server.accept()
                    with link:
                        self._talk(link)

    def _talk(self, link: socket.socket) -> None:
        due_s, rest = time.monotonic(), b""
        while not self._halt.is_set():
            link.settimeout(max(1e-4, due_s - time.monotonic()))
            answer = b""
            try:
                if not (data := link.recv(4096)):
                    return
                *lines, rest = (rest + data).replace(b"\r", b"\n").split(b"\n")
                answer = b"".join(self.take(line) for line in lines if line)
            except TimeoutError:
                due_s = max(due_s + self._period_s, time.monotonic())
                answer = self.line()
            if answer and not self.silent:
                link.settimeout(WRITE_S)
                link.sendall(answer)
