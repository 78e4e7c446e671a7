"""The page of an ATI box: whole, or cut short."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator

import pytest

from stepload_drivers.ati import box
from stepload_drivers.streamed import Deadline

HEAD = b"HTTP/1.1 200 OK\r\n"


def _answer(server: socket.socket, page: bytes) -> None:
    peer, _ = server.accept()
    with peer:
        peer.recv(4096)
        peer.sendall(page)


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server


def _fetch(server: socket.socket, page: bytes) -> str:
    threading.Thread(target=_answer, args=(server, page), daemon=True).start()
    return box.fetch(*server.getsockname(), "box", Deadline(0.4))


@pytest.mark.parametrize("told", [b"Content-Length: 8\r\n", b""])
def test_a_whole_page_is_read(server, told):
    assert _fetch(server, HEAD + told + b"\r\n<a>b</a>") == "<a>b</a>"
