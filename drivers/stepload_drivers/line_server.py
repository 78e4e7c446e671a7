"""A device's end of a TCP connection that carries lines of text, for emulators."""

from __future__ import annotations

import socket
import threading
import time
from typing import Self

LOOK_S = 0.05


class LineServer:
    """Serves one client after the other on a free port of loopback, while used as a context.

    A subclass gives `line`, `take` or both.

    Args:
        rate_hz: how often `line` is sent.

    Attributes:
        options: of the driver that is to reach it.
        silent: whether nothing is sent any more, though the connection stays open.
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
            server.settimeout(LOOK_S)
            while not self._halt.is_set():
                try:
                    link, _ = server.accept()
                except TimeoutError:
                    continue
                with link:
                    self._talk(link)

    def _talk(self, link: socket.socket) -> None:
        """Talk to one client until it goes."""
        due_s, rest = time.monotonic(), b""
        try:
            while not self._halt.is_set():
                data = self._received(link, due_s)
                if data == b"":
                    return
                *lines, rest = (rest + (data or b"")).replace(b"\r", b"\n").split(b"\n")
                answer = b"".join(self.take(line) for line in lines if line)
                if data is None:
                    due_s = max(due_s + self._period_s, time.monotonic())
                    answer += self.line()
                if answer and not self.silent:
                    link.settimeout(1.0)
                    link.sendall(answer)
        except OSError:
            return

    def _received(self, link: socket.socket, until_s: float) -> bytes | None:
        """What the client has sent; empty: it has gone, None: nothing until then."""
        link.settimeout(max(1e-4, until_s - time.monotonic()))
        try:
            return link.recv(4096)
        except TimeoutError:
            return None
