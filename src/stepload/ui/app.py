"""The application behind the page, served until Ctrl+C: JSON, and the live run as events."""

from __future__ import annotations

import os
import resource
import secrets
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import anyio
import uvicorn
from anyio import BrokenWorkerProcess, to_process, to_thread
from pydantic import BaseModel, Field, ValidationError
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response, StreamingResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp

from stepload.errors import BadInputError, SteploadError
from stepload.jobs.pool import one_thread
from stepload.live.view import check_certificate
from stepload.plan.source import MAX_BYTES
from stepload.record.plain import json_text
from stepload.record.scan import DamageError
from stepload.session.control import ask
from stepload.ui import folder
from stepload.ui.door import TOKEN, Door, guarded
from stepload.ui.follow import Follower

CHECK_S, READ_S = 20.0, 60.0
"""Longest times of a preflight, and of reading a run, with the wait for their turn."""
MOST_PROCESSES, PROCESS_NICE = 2, 10
MOST_PROCESS_BYTES = 4 << 30
"""Memory that other people's files may make a process take."""
LEAVE_S = 1
"""Time for requests that go on when the server ends."""
PERIOD_S, BEAT_S = 0.1, 5.0
MOST_VIEWERS = 4
REPORT_POLICY = (
    "sandbox; default-src 'none'; img-src data:; style-src 'unsafe-inline'; frame-ancestors 'self'"
)
REQUESTS = ("pause", "stop")
"""None that moves the arm towards the payload: who paused may be reaching for it."""
Result = TypeVar("Result")


async def apart(patience_s: float, function: Callable[..., Result], *arguments: Any) -> Result:
    """What a function of a module returns, in a process that is killed if it takes longer.

    Raises:
        BadInputError: it took longer or too much memory, or the process was killed.
        Exception: the function's own.
    """
    to_process.current_default_process_limiter().total_tokens = MOST_PROCESSES
    try:
        with anyio.fail_after(patience_s):
            return await to_process.run_sync(_bounded, function, arguments, cancellable=True)
    except TimeoutError:
        message = f"it took longer than {patience_s:g} s and was given up"
        raise BadInputError(message) from None
    except MemoryError:
        message = f"it took more than {MOST_PROCESS_BYTES >> 30} GiB of memory"
        raise BadInputError(message) from None
    except BrokenWorkerProcess as error:
        raise BadInputError("the process that read it was killed") from error


def _bounded(function: Callable[..., Result], arguments: tuple[Any, ...]) -> Result:
    """Its result, in a process that takes little of the computer and then waits for the next."""
    here = os.PRIO_PROCESS, 0
    os.setpriority(*here, max(PROCESS_NICE, os.getpriority(*here)))
    resource.setrlimit(resource.RLIMIT_AS, (MOST_PROCESS_BYTES, MOST_PROCESS_BYTES))
    return function(*arguments)


def _json(told: Any, status: int = 200) -> Response:
    return Response(json_text(told), status, media_type="application/json")


class Told(BaseModel):
    """The body of a request: the name of a run or plan, and a word or the text of the plan."""

    name: str = Field(max_length=1000)
    text: str = Field(max_length=MAX_BYTES)


class Page:
    """The page of one folder.

    Args:
        root: the folder; nothing outside it is read.
        over: whether the server is ending.
    """

    def __init__(self, root: Path, door: Door, over: Callable[[], bool]) -> None:
        self._root = root.resolve()
        self._door, self._over = door, over
        self._watching = 0
        routes = [
            Route("/api/runs", self._runs),
            Route("/api/curves", self._curves),
            Route("/api/report", self._report),
            Route("/api/live", self._live),
            Route("/api/plans", self._plans),
            Route("/api/plan", self._plan),
            Route("/api/preflight", self._preflight, methods=["POST"]),
            Route("/api/request", self._request, methods=["POST"]),
            Mount("/", StaticFiles(directory=Path(__file__).with_name("assets"), html=True)),
        ]
        app = Starlette(routes=routes, exception_handlers={SteploadError: _refused})
        self.app: ASGIApp = guarded(app, door)

    async def _read(self, function: Callable[..., Result], *arguments: str) -> Result:
        return await apart(READ_S, function, self._root, *arguments)

    async def _runs(self, _: Request) -> Response:
        return _json({"folder": str(self._root), "runs": await self._read(folder.run_rows)})

    async def _curves(self, request: Request) -> Response:
        return _json(await self._read(folder.curves_of, request.query_params.get("run", "")))

    async def _report(self, request: Request) -> Response:
        page = await self._read(folder.report_of, request.query_params.get("run", ""))
        return HTMLResponse(page, headers={"content-security-policy": REPORT_POLICY})

    async def _plans(self, _: Request) -> Response:
        return _json({"plans": await self._read(folder.plan_names)})

    async def _plan(self, request: Request) -> Response:
        return _json(
            {"text": await self._read(folder.plan_text, request.query_params.get("name", ""))}
        )

    async def _preflight(self, request: Request) -> Response:
        told = await _body(request)
        name = told.name or "plan.yaml"
        return _json(await apart(CHECK_S, folder.check, self._root, name, told.text))

    async def _request(self, request: Request) -> Response:
        """Pause or stop a run, as its own terminal does."""
        if not self._door.knows(request.headers.get(TOKEN, "")):
            return _json({"error": "Wrong token: it is in the address of stepload ui."}, 401)
        told = await _body(request)
        if told.text not in REQUESTS:
            raise BadInputError(f"not {', '.join(REQUESTS)}")
        directory = folder.record_at(self._root, told.name).parent
        return _json(await to_thread.run_sync(ask, directory, told.text))

    async def _live(self, request: Request) -> Response:
        record = folder.record_at(self._root, request.query_params.get("run", ""))
        if not folder.goes_on(record):  # the server itself follows no file that others have made
            raise BadInputError("this run is over", hint="its curves and report are shown")
        if self._watching >= MOST_VIEWERS:
            raise BadInputError(f"{MOST_VIEWERS} pages watch already", hint="close one of them")
        return StreamingResponse(self._events(record), media_type="text/event-stream")

    async def _events(self, record: Path) -> AsyncIterator[str]:
        """The live run as server-sent events, until it ends."""
        self._watching += 1
        follower = None
        try:
            follower = Follower(record)
            quiet_s = 0.0
            while not (follower.ended or self._over()):
                told = await to_thread.run_sync(follower.step)
                if told is not None:
                    yield f"data: {json_text(told)}\n\n"
                elif (quiet_s := quiet_s + PERIOD_S) >= BEAT_S:  # finds out who has left
                    quiet_s = 0.0
                    yield ": nothing new\n\n"
                await anyio.sleep(PERIOD_S)
        except (SteploadError, DamageError, OSError, ValueError, KeyError, TypeError) as error:
            yield f"data: {json_text({'ended': 'unread', 'problem': str(error)})}\n\n"
        finally:
            self._watching -= 1
            if follower is not None:
                follower.close()


def _refused(_: Request, error: Exception) -> Response:
    assert isinstance(error, SteploadError)
    return _json({"error": error.message, "hint": error.hint}, 400)


async def _body(request: Request) -> Told:
    """What a request tells.

    Raises:
        BadInputError: it is too large, or has none.
    """
    raw = b""
    async for piece in request.stream():
        raw += piece
        if len(raw) > 2 * MAX_BYTES:
            raise BadInputError(f"larger than {2 * MAX_BYTES >> 20} MiB", hint="a plan is short")
    try:
        return Told.model_validate_json(raw)
    except ValidationError as error:
        message = "no name and text, or a text that is larger than a plan may be"
        raise BadInputError(message) from error


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
    with _bound(host, port) as listener, one_thread():
        bound = listener.getsockname()[1]
        door = Door(host, bound, certificate is not None, secrets.token_urlsafe(24))
        config = uvicorn.Config(
            Page(directory, door, lambda: server.should_exit).app,
            http="h11", ws="none", loop="asyncio", lifespan="off",
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
        with suppress(KeyboardInterrupt):
            server.run(sockets=[listener])


def _bound(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        why = os.strerror(error.errno) if error.errno and error.errno > 0 else str(error)
        raise BadInputError(f"{host}:{port}: {why}", hint="another --host or --port") from error
