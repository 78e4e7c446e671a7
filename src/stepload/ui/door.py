"""Who may ask the server for what: host and origin of each request, and the token."""

from __future__ import annotations

import base64
import binascii
import secrets
import socket
from dataclasses import dataclass

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from stepload.live.view import is_loopback

TOKEN = "x-stepload-token"  # noqa: S105
HEADERS = {
    "content-security-policy": "default-src 'self'; img-src 'self' data:; object-src 'none'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'self'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cache-control": "no-store",
}  # fmt: skip
ANY = ("0.0.0.0", "::")  # noqa: S104


@dataclass(frozen=True)
class Door:
    """Where the page is served: `everything` needs the token where others reach the address."""

    host: str
    port: int
    tls: bool
    token: str

    @property
    def everything(self) -> bool:
        return not is_loopback(self.host)

    @property
    def url(self) -> str:
        """The address for a browser, with the token in the part that it does not send."""
        host = socket.gethostname() if self.host in ANY else self.host
        host = f"[{host}]" if ":" in host else host
        return f"{self._scheme}://{host}:{self.port}/#token={self.token}"

    @property
    def _scheme(self) -> str:
        return "https" if self.tls else "http"

    def _is_ours(self, host: str) -> bool:
        """Whether a Host header names this server: a page of a foreign name may reach it too."""
        if self.host in ANY:  # the token is needed for everything
            return bool(host)
        names = {"localhost", "127.0.0.1", "[::1]"} if not self.everything else set()
        names.add(f"[{self.host}]" if ":" in self.host else self.host)
        standard = {443: "https", 80: "http"}.get(self.port) == self._scheme
        return any(host == f"{name}:{self.port}" or (standard and host == name) for name in names)

    def knows(self, told: str) -> bool:
        """Whether a text is the token."""
        return secrets.compare_digest(told.encode(), self.token.encode())

    def refusal(self, method: str, path: str, headers: Headers) -> tuple[int, str] | None:
        """Status and reason where a request is refused."""
        host = headers.get("host", "")
        if not self._is_ours(host.lower()):
            return 421, "another host name than that of the page"
        if self.everything and not (
            self.knows(headers.get(TOKEN, "")) or self.knows(_password(headers))
        ):
            return 401, "the token is missing: any name, and the token as the password"
        if path != "/" and headers.get("sec-fetch-site", "none") not in ("same-origin", "none"):
            return 403, "a request from another page"
        if method in ("GET", "HEAD"):
            return None
        if headers.get("origin", "") not in ("", f"{self._scheme}://{host}"):
            return 403, "a request from another page"
        if headers.get("content-type", "").partition(";")[0] != "application/json":
            return 415, "only JSON is taken"
        return None


def _password(headers: Headers) -> str:
    """The password of basic authorization, for which a browser asks by itself."""
    kind, _, coded = headers.get("authorization", "").partition(" ")
    if kind.lower() != "basic":
        return ""
    try:
        return base64.b64decode(coded).decode().partition(":")[2]
    except (binascii.Error, ValueError):
        return ""


def guarded(inner: ASGIApp, door: Door) -> ASGIApp:
    """An application behind a door; each answer forbids what the page does not need."""

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            return

        async def guarded_send(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        answer = inner
        if refused := door.refusal(scope["method"], scope["path"], Headers(scope=scope)):
            status, why = refused
            ask = {"www-authenticate": 'Basic realm="stepload"'} if status == 401 else None
            answer = JSONResponse({"error": why}, status, ask)
        await answer(scope, receive, guarded_send)

    return app
