"""A page in headless Chromium, driven over its debugging pipe: what it logs, fetches and shows."""

from __future__ import annotations

import base64
import io
import json
import os
import shutil
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

PATH = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-extensions",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--remote-debugging-pipe",
    "--hide-scrollbars",
]


class Page:
    """One tab. Every event the browser sends is kept in `events`."""

    def __init__(self, write_fd: int, read_fd: int) -> None:
        self._write_fd, self._read_fd = write_fd, read_fd
        self._buffer = b""
        self._last_id = 0
        self._session = ""
        self.events: list[dict[str, Any]] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def _message(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            data = os.read(self._read_fd, 1 << 20)
            if not data:
                raise EOFError("the browser ended")
            self._buffer += data
        text, _, self._buffer = self._buffer.partition(b"\0")
        message: dict[str, Any] = json.loads(text)
        return message

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Send one command and wait for its result."""
        self._last_id += 1
        message = {"id": self._last_id, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write_fd, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._message()
            if answer.get("id") == self._last_id:
                assert "error" not in answer, answer
                result: dict[str, Any] = answer["result"]
                return result
            self.events.append(answer)

    def open(self, file: Path) -> None:
        """Load a file and wait until it and its pictures are there."""
        self.call("Page.navigate", url=file.resolve().as_uri())
        while not any(e["method"] == "Page.loadEventFired" for e in self.events):
            self.events.append(self._message())

    def evaluate(self, expression: str) -> Any:
        """The JSON value of a JavaScript expression."""
        return self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )["result"].get("value")

    def picture(self, selector: str) -> NDArray[np.float32]:
        """Pixels (height, width, channels) of one element."""
        from matplotlib.image import imread

        box = self.evaluate(
            f"(() => {{const r = document.querySelector({selector!r}).getBoundingClientRect();"
            "return {x: r.x + scrollX, y: r.y + scrollY, width: r.width, height: r.height}})()"
        )
        shot = self.call(
            "Page.captureScreenshot", captureBeyondViewport=True, clip={**box, "scale": 1}
        )
        pixels: NDArray[np.float32] = imread(io.BytesIO(base64.b64decode(shot["data"])))
        return pixels

    @property
    def complaints(self) -> list[str]:
        """Console errors and warnings, exceptions, log entries."""
        return [
            json.dumps(e["params"])
            for e in self.events
            if e["method"] in ("Runtime.exceptionThrown", "Log.entryAdded")
            or (e["method"] == "Runtime.consoleAPICalled" and e["params"]["type"] != "log")
        ]

    @property
    def requests(self) -> list[str]:
        """Every address asked for, except the page itself and data in it."""
        return [
            e["params"]["request"]["url"]
            for e in self.events
            if e["method"] == "Network.requestWillBeSent"
            and not e["params"]["request"]["url"].startswith(("data:", "file:", "about:"))
        ]


@contextmanager
def page(profile: Path) -> Iterator[Page]:
    """A fresh headless browser with one tab; ended with everything it started."""
    assert PATH
    to_child, to_browser = os.pipe()
    from_browser, from_child = os.pipe()

    def hand_over() -> None:
        os.dup2(to_child, 3)
        os.dup2(from_child, 4)

    # The browser wants 3 and 4, which the pipes may already be: move its ends out of the way first.
    for low, high in ((to_child, 203), (from_child, 204)):
        os.dup2(low, high)
        os.close(low)
    to_child, from_child = 203, 204
    browser = subprocess.Popen(
        [PATH, *FLAGS, f"--user-data-dir={profile}", "--window-size=1100,900"],
        preexec_fn=hand_over,
        pass_fds=(3, 4),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        os.close(to_child)
        os.close(from_child)
        yield Page(to_browser, from_browser)
    finally:
        os.killpg(browser.pid, signal.SIGKILL)
        browser.wait()
        os.close(to_browser)
        os.close(from_browser)
