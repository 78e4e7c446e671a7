"""The application behind the page: what it shows as JSON, the live run as a stream of events."""

from __future__ import annotations

import hashlib
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from importlib import resources
from pathlib import Path
from typing import Any

import anyio
from anyio import CapacityLimiter, to_thread
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp

from stepload.errors import BadInputError, SteploadError
from stepload.plan.source import MAX_BYTES
from stepload.record.plain import json_text
from stepload.record.scan import DamageError
from stepload.session.control import ask
from stepload.ui import folder
from stepload.ui.checked import check
from stepload.ui.door import TOKEN, Door, Guard
from stepload.ui.follow import Follower
from stepload.ui.worker import Worker

CHECK_S, READ_S = 20.0, 60.0
"""Longest times of a preflight, and of reading a run."""
PERIOD_S, BEAT_S = 0.1, 5.0
MOST_VIEWERS = 4
REPORT_POLICY = (
    "sandbox; default-src 'none'; img-src data:; style-src 'unsafe-inline'; frame-ancestors 'self'"
)
REQUESTS = ("pause", "stop")
"""None that moves the arm towards the payload: who paused may be reaching for it."""
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}


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
        self._reader, self._checker = Worker(READ_S), Worker(CHECK_S)
        self._viewers = CapacityLimiter(MOST_VIEWERS)
        self._watching = 0

    @property
    def app(self) -> ASGIApp:
        """Its application."""
        routes = [
            Route(path, self._answered(answer), methods=[method])
            for path, method, answer in (
                ("/api/runs", "GET", self._runs),
                ("/api/curves", "GET", self._curves),
                ("/api/report", "GET", self._report),
                ("/api/live", "GET", self._live),
                ("/api/plans", "GET", self._plans),
                ("/api/plan", "GET", self._plan),
                ("/api/preflight", "POST", self._preflight),
                ("/api/request", "POST", self._request),
            )
        ]
        files = [Route(path, self._file) for path in self._files]
        return Guard(Starlette(routes=[*routes, *files]), self._door)

    def close(self) -> None:
        """End its processes."""
        self._reader.close()
        self._checker.close()

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

    async def _runs(self, request: Request) -> Response:
        rows = await self._reader.do(folder.run_rows, self._root)
        digest = hashlib.sha256(json_text(rows).encode()).hexdigest()[:16]
        if request.query_params.get("seen") == digest:
            return Json({"seen": digest})
        return Json({"seen": digest, "folder": str(self._root), "runs": rows})

    async def _curves(self, request: Request) -> Response:
        return Json(await self._reader.do(folder.curves_of, self._root, _name(request, "run")))

    async def _report(self, request: Request) -> Response:
        page = await self._reader.do(folder.report_of, self._root, _name(request, "run"))
        return HTMLResponse(page, headers={"content-security-policy": REPORT_POLICY})

    async def _plans(self, _: Request) -> Response:
        return Json({"plans": await self._reader.do(folder.plan_names, self._root)})

    async def _plan(self, request: Request) -> Response:
        name = _name(request, "name")
        return Json({"text": await self._reader.do(folder.plan_text, self._root, name)})

    async def _preflight(self, request: Request) -> Response:
        told = await _body(request)
        text = told["text"].encode("utf-8", "replace").decode()
        return Json(await self._checker.do(check, self._root, told["name"] or "plan.yaml", text))

    async def _request(self, request: Request) -> Response:
        """Pause or stop a run, as its own terminal does."""
        if not self._door.knows(request.headers.get(TOKEN, "")):
            return Json({"error": "Wrong token: it is in the address of stepload ui."}, 401)
        told = await _body(request)
        if told["text"] not in REQUESTS:
            raise BadInputError(f"not {', '.join(REQUESTS)}")
        directory = folder.record_at(self._root, told["name"]).parent
        return Json(await to_thread.run_sync(ask, directory, told["text"]))

    async def _live(self, request: Request) -> Response:
        record = folder.record_at(self._root, _name(request, "run"))
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
                told = await to_thread.run_sync(follower.step, limiter=self._viewers)
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


async def _body(request: Request) -> dict[str, str]:
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
        name, text = told.get("name"), told.get("text")
        if isinstance(name, str) and isinstance(text, str) and len(text) <= MAX_BYTES:
            return {"name": name[:1000], "text": text}
    except (ValueError, AttributeError, RecursionError):
        pass
    raise BadInputError("no name and text, or a text that is larger than a plan may be")
