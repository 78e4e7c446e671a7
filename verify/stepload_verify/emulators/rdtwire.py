"""The emulator's end of RDT: a UDP port, and the device's page over HTTP."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from stepload_drivers.ati.rdt import Command, request


class RdtWire:
    """A UDP port that answers whoever spoke last, as the device does, and its page on a TCP port.

    `options` are what the driver has to be given.
    """

    def __init__(self) -> None:
        self._sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sock.bind(("127.0.0.1", 0))
        self._sock.setblocking(False)
        self._peer: tuple[str, int] | None = None
        self._other: socket.socket | None = None
        self._pages: ThreadingHTTPServer | None = None
        self.port: int = self._sock.getsockname()[1]
        self.address = f"127.0.0.1:{self.port}"

    def serve_page(self, page: Callable[[], str]) -> int:
        """Answer every GET with `page()`, "" not at all; returns the port."""

        class Page(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                if text := page():
                    self.send_response(200)
                    self.end_headers()
                    self.wfile.write(text.encode())

            def log_message(self, format: str, *args: object) -> None:
                pass

        pages = self._pages = ThreadingHTTPServer(("127.0.0.1", 0), Page)
        pages.daemon_threads = True
        threading.Thread(target=pages.serve_forever, args=(0.05,), daemon=True).start()
        return pages.server_port

    def fileno(self) -> int:
        return self._sock.fileno()

    def read(self) -> bytes:
        try:
            data, self._peer = self._sock.recvfrom(2048)
        except OSError:
            return b""
        return data

    def write(self, data: bytes) -> bool:
        if self._peer is None:
            return False
        try:
            return self._sock.sendto(data, self._peer) == len(data)
        except OSError:
            return False

    def usurp(self) -> None:
        """Let a second client ask for the stream, once."""
        if self._other is None:
            self._other = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._other.sendto(request(Command.START), ("127.0.0.1", self.port))

    def close(self) -> None:
        pages, self._pages = self._pages, None
        if pages is not None:
            pages.shutdown()
            pages.server_close()
        with contextlib.suppress(OSError):
            self._sock.close()
        if self._other is not None:
            self._other.close()
