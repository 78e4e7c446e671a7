"""The application behind the page, served until Ctrl+C: JSON, and the live run as events."""

from __future__ import annotations

import json
import os
import resource
import secrets
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import suppress
from importlib import resources
from pathlib import Path
from typing import Any, TypeVar

import anyio
import uvicorn
from anyio import BrokenWorkerProcess, to_process, to_thread
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route
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
REQUESTS = ("pause", "resume", "stop")
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
Result = TypeVar("Result")


async def apart(patience_s: float, function: Callable[..., Result], *arguments: Any) -> Result:
    """What a function of a module returns, in a process that is killed if it takes longer.

    Raises:
        BadInputError: it took longer, or the process was killed.
        Exception: the function's own.
    """
    to_process.current_default_process_limiter().total_tokens = MOST_PROCESSES
    try:
        with anyio.fail_after(patience_s):
            return await to_process.run_sync(_bounded, function, arguments, cancellable=True)
    except TimeoutError:
        message = f"it took longer than {patience_s:g} s and was given up"
        raise BadInputError(message) from None
    except BrokenWorkerProcess as error:
        raise BadInputError("the process that read it was killed") from error


def _bounded(function: Callable[..., Result], arguments: tuple[Any, ...]) -> Result:
    """Its result, in a process that takes little of the computer and then waits for the next."""
    here = os.PRIO_PROCESS, 0
    os.setpriority(*here, max(PROCESS_NICE, os.getpriority(*here)))
    resource.setrlimit(resource.RLIMIT_AS, (MOST_PROCESS_BYTES, MOST_PROCESS_BYTES))
    return function(*arguments)


class Json(JSONResponse):
    """Anything stepload knows; NaN and infinities become null."""

    def render(self, content: Any) -> bytes:
        return json_text(content).encode()


def _assets() -> dict[str, tuple[bytes, str]]:
    """Every file of the page by its path, with its type: nothing else is served from disk."""
    found = {}
    home = resources.files("stepload.ui") / "assets"
    for place, prefix in ((home, "/"), (home / "uplot", "/uplot/")):
        for each in place.iterdir():
            kind = _TYPES.get(Path(each.name).suffix)
            if kind and each.is_file():
                found[prefix + each.name] = (each.read_bytes(), kind)
    found["/"] = found.pop("/index.html")
    return found


class Page:
    """The page of one folder.

    Args:
        root: the folder; nothing outside it is read.
        over: whether the server is ending.
    """

    def __init__(self, root: Path, door: Door, over: Callable[[], bool]) -> None:
        self._root = root.resolve()
        self._door, self._over = door, over
        self._files = _assets()
        self._watching = 0
        routes = [
            Route(f"/api/{path}", self._answered(answer), methods=[method])
            for path, method, answer in (
                ("runs", "GET", self._runs),
                ("curves", "GET", self._curves),
                ("report", "GET", self._report),
                ("live", "GET", self._live),
                ("plans", "GET", self._plans),
                ("plan", "GET", self._plan),
                ("preflight", "POST", self._preflight),
                ("request", "POST", self._request),
            )
        ]
        files = [Route(path, self._file) for path in self._files]
        self.app: ASGIApp = guarded(Starlette(routes=[*routes, *files]), door)

    async def _read(self, function: Callable[..., Result], *arguments: str) -> Result:
        return await apart(READ_S, function, self._root, *arguments)

    @staticmethod
    def _answered(answer: Callable[[Request], Awaitable[Response]]) -> Any:
        """An error of ours is an answer with its text and what to do."""

        async def endpoint(request: Request) -> Response:
            try:
                return await answer(request)
            except SteploadError as error:
                return Json({"error": error.message, "hint": error.hint}, 400)

        return endpoint

    async def _file(self, request: Request) -> Response:
        content, kind = self._files[request.url.path]
        return Response(content, media_type=kind)

    async def _runs(self, _: Request) -> Response:
        return Json({"folder": str(self._root), "runs": await self._read(folder.run_rows)})

    async def _curves(self, request: Request) -> Response:
        return Json(await self._read(folder.curves_of, _name(request, "run")))

    async def _report(self, request: Request) -> Response:
        page = await self._read(folder.report_of, _name(request, "run"))
        return HTMLResponse(page, headers={"content-security-policy": REPORT_POLICY})

    async def _plans(self, _: Request) -> Response:
        return Json({"plans": await self._read(folder.plan_names)})

    async def _plan(self, request: Request) -> Response:
        return Json({"text": await self._read(folder.plan_text, _name(request, "name"))})

    async def _preflight(self, request: Request) -> Response:
        name, text = await _body(request)
        text = text.encode("utf-8", "replace").decode()
        return Json(await apart(CHECK_S, folder.check, self._root, name or "plan.yaml", text))

    async def _request(self, request: Request) -> Response:
        """Pause, resume or stop a run, as its own terminal does."""
        if not self._door.knows(request.headers.get(TOKEN, "")):
            return Json({"error": "this needs the token that `stepload ui` printed"}, 401)
        name, word = await _body(request)
        if word not in REQUESTS:
            raise BadInputError(f"not {', '.join(REQUESTS)}")
        directory = folder.record_at(self._root, name).parent
        return Json(await to_thread.run_sync(ask, directory, word))

    async def _live(self, request: Request) -> Response:
        record = folder.record_at(self._root, _name(request, "run"))
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


def _name(request: Request, key: str) -> str:
    return request.query_params.get(key, "")[:1000]


async def _body(request: Request) -> tuple[str, str]:
    """The texts `name` and `text` of a request.

    Raises:
        BadInputError: it is too large, or has none.
    """
    raw = b""
    async for piece in request.stream():
        raw += piece
        if len(raw) > 2 * MAX_BYTES:
            raise BadInputError(f"larger than {2 * MAX_BYTES >> 20} MiB", hint="a plan is short")
    try:
        told = json.loads(raw)
        name, text = told["name"], told["text"]
        if isinstance(name, str) and isinstance(text, str) and len(text) <= MAX_BYTES:
            return name[:1000], text
    except (ValueError, KeyError, TypeError, RecursionError):
        pass
    raise BadInputError("no name and text, or a text that is larger than a plan may be")


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
