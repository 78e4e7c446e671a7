"""Pause, resume and stop from another process: a Unix socket in the run's directory.

A socket answers only while the process that bound it lives, so nobody can reach another process by
a number that was used again. Only the run's own user (and root) is listened to.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import stat
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from stepload.engine.operator import Operator
from stepload.errors import BadInputError

NAME = "control"
CLIENT_TIMEOUT_S = 2.0
MAX_REQUEST_BYTES = 64
MAX_ANSWER_BYTES = 4096
_CREDENTIALS = struct.Struct("3i")

Status = Callable[[], dict[str, object]]


@contextmanager
def _address(directory: Path) -> Iterator[str]:
    """A path to the socket that is short enough whatever the directory is called."""
    fd = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    try:
        yield f"/proc/self/fd/{fd}/{NAME}"
    finally:
        os.close(fd)


def _is_socket(path: Path) -> bool:
    try:
        return stat.S_ISSOCK(path.lstat().st_mode)
    except OSError:
        return False


@contextmanager
def listening(directory: Path, operator: Operator, status: Status) -> Iterator[str]:
    """Take requests for a run while it goes on.

    Yields:
        Why no requests can be taken ("" where they can); a file system without sockets is no reason
        not to run.
    """
    path = directory / NAME
    server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_CLOEXEC)
    try:
        if _is_socket(path):
            path.unlink()
        with _address(directory) as address:
            server.bind(address)
        server.listen(4)
    except OSError as error:
        server.close()
        yield f"`stepload pause` will not reach this run: {error.strerror}"
        return
    over, wake = socket.socketpair()
    thread = threading.Thread(
        target=_serve, args=(server, over, operator, status), name="control", daemon=True
    )
    thread.start()
    try:
        yield ""
    finally:
        wake.close()
        thread.join()
        over.close()
        server.close()
        with contextlib.suppress(OSError):
            path.unlink()


def _serve(server: socket.socket, over: socket.socket, operator: Operator, status: Status) -> None:
    import select

    while True:
        ready, _, _ = select.select([server, over], [], [])
        if over in ready:
            return
        with contextlib.suppress(OSError):
            client, _ = server.accept()
            with client:
                client.settimeout(CLIENT_TIMEOUT_S)
                client.sendall(json.dumps(_answer(client, operator, status)).encode() + b"\n")


def _answer(client: socket.socket, operator: Operator, status: Status) -> dict[str, object]:
    packed = client.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    _, user, _ = _CREDENTIALS.unpack(packed)
    if user not in (0, os.getuid()):
        return {"error": "the run belongs to another user"}
    request = client.recv(MAX_REQUEST_BYTES).strip()
    if request in (b"pause", b"resume"):
        operator.paused = request == b"pause"
    elif request == b"stop":
        operator.unload()
    elif request != b"status":
        return {"error": "not pause, resume, stop or status"}
    return {"paused": operator.paused, "stops": operator.stop_level > 0, **status()}


def ask(directory: Path, request: str) -> dict[str, Any]:
    """Send "pause", "resume", "stop" or "status" to the run in `directory`; its answer.

    Raises:
        BadInputError: no run is going on there, or it refuses.
    """
    nobody = BadInputError(
        f"no run is going on in {directory}", hint="name the directory that `stepload run` told"
    )
    if not _is_socket(directory / NAME):
        raise nobody
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
        client.settimeout(CLIENT_TIMEOUT_S)
        try:
            with _address(directory) as address:
                client.connect(address)
            client.sendall(request.encode() + b"\n")
            raw = b""
            while not raw.endswith(b"\n") and len(raw) < MAX_ANSWER_BYTES:
                if not (piece := client.recv(MAX_ANSWER_BYTES)):
                    break
                raw += piece
            answer = json.loads(raw)
        except ConnectionRefusedError:
            raise nobody from None
        except (OSError, ValueError) as error:
            raise BadInputError(f"the run in {directory} does not answer: {error}") from error
    if not isinstance(answer, dict) or "error" in answer:
        raise BadInputError(f"the run in {directory} refuses: {answer}")
    return answer
