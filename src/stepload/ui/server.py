"""Serves the page of a folder until Ctrl+C."""

from __future__ import annotations

import os
import secrets
import socket
from collections.abc import Callable
from pathlib import Path

import uvicorn

from stepload.errors import BadInputError
from stepload.live.view import check_certificate
from stepload.ui.app import Page
from stepload.ui.door import Door

LEAVE_S = 1
"""Time for requests that go on when the server ends."""


def serve(
    directory: Path,
    host: str,
    port: int,
    started: Callable[[Door], None],
    certificate: Path | None = None,
    key: Path | None = None,
) -> None:
    """Serve until a signal comes; `started` is called when browsers can connect.

    Raises:
        BadInputError: no such directory, an address on the network without TLS, a certificate
            that cannot be used, or an address that is taken.
    """
    if not directory.is_dir():
        raise BadInputError(f"{directory} is no directory", hint="name the one with runs and plans")
    check_certificate("--host", host, certificate, key)
    with _bound(host, port) as listener:
        bound = listener.getsockname()[1]
        door = Door(host, bound, certificate is not None, secrets.token_urlsafe(24))
        page = Page(directory, door, lambda: server.should_exit)
        config = uvicorn.Config(
            page.app, http="h11", ws="none", loop="asyncio", lifespan="off",
            log_config=None, log_level="critical", access_log=False, server_header=False,
            proxy_headers=False, limit_concurrency=64, timeout_graceful_shutdown=LEAVE_S,
            ssl_certfile=certificate, ssl_keyfile=key,
        )  # fmt: skip
        server = uvicorn.Server(config)
        try:
            config.load()
        except (OSError, ValueError) as error:  # ssl's own
            raise BadInputError(
                f"{certificate}, {key}: cannot be used: {error}", hint="a PEM certificate, its key"
            ) from error
        started(door)
        try:
            server.run(sockets=[listener])
        except KeyboardInterrupt:
            pass
        finally:
            page.close()


def _bound(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        why = os.strerror(error.errno) if error.errno and error.errno > 0 else str(error)
        raise BadInputError(f"{host}:{port}: {why}", hint="another --host or --port") from error
