"""The page of an ATI box, from a device that is slow, or cuts it short."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator

import pytest

from stepload.errors import DeviceError
from stepload_drivers.ati import box
from stepload_drivers.streamed import Deadline

HEAD = b"HTTP/1.1 200 OK\r\n"


def _answer(server: socket.socket, first: bytes, drip: bytes) -> None:
    peer, _ = server.accept()
    with peer:
        peer.recv(4096)
        try:
            peer.sendall(first)
            for _ in range(100 if drip else 0):
                peer.sendall(drip)
                time.sleep(0.1)
        except OSError:  # cut off
            pass


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server


def _fetch(server: socket.socket, first: bytes, drip: bytes = b"") -> str:
    threading.Thread(target=_answer, args=(server, first, drip), daemon=True).start()
    return box.fetch(*server.getsockname(), "box", Deadline(0.4))


@pytest.mark.parametrize(("first", "drip"), [(HEAD, b"X: y\r\n"), (HEAD + b"\r\n", b"<")])
def test_a_page_that_drips_holds_nobody_up(server, first, drip):
    """Each byte would give it the whole time again."""
    begun_s = time.monotonic()
    with pytest.raises(DeviceError, match=r"its page: not there within 0\.4 s"):
        _fetch(server, first, drip)
    assert time.monotonic() - begun_s < 1.5


@pytest.mark.parametrize("told", [b"Content-Length: 8\r\n", b""])
def test_a_whole_page_is_read(server, told):
    assert _fetch(server, HEAD + told + b"\r\n<a>b</a>") == "<a>b</a>"
