"""Polls remote control outside the loop, so that data continue meanwhile."""

from __future__ import annotations

import contextlib
import threading
import time

from stepload.errors import DeviceError
from stepload_drivers.ur.client import Dashboard
from stepload_drivers.ur.preflight import REMOTE

ASK_S = 0.2
EVERY_S = 1.0


class RemoteCheck:
    """Questions to the dashboard, on a connection made beforehand: see `ports.ControlPort`.

    `remote` is None where the controller cannot or does not report it (PolyScope below 5.6).
    """

    def __init__(self, host: str) -> None:
        self.remote: bool | None = None
        self._thread: threading.Thread | None = None
        self._dashboard: Dashboard | None = None
        self._asked_s = time.monotonic()
        self._final = False
        self._tells = True
        with contextlib.suppress(DeviceError):
            self._dashboard = Dashboard(host, time.monotonic() + ASK_S)

    def poll(self) -> None:
        """Ask once every `EVERY_S`, for as long as the answers make sense."""
        if self._asking or time.monotonic() - self._asked_s < EVERY_S:
            return
        self._start()

    def done(self) -> bool:
        """Whether a question put after the first call is answered or given up."""
        if self._asking:
            return False
        if not self._final:
            self._final = True
            self._start()
        return not self._asking

    @property
    def _asking(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    def _start(self) -> None:
        self._asked_s = time.monotonic()
        if self._dashboard is not None and self._tells:
            self._thread = threading.Thread(target=self._ask, daemon=True)
            self._thread.start()

    def end_program(self) -> None:
        """Send the dashboard's stop, also outside the loop; whether it is obeyed is not known."""
        threading.Thread(target=self._stop, daemon=True).start()

    def _stop(self) -> None:
        if self._thread is not None:
            self._thread.join(ASK_S)
        if self._dashboard is not None:
            with contextlib.suppress(DeviceError):
                self._dashboard.ask("stop", time.monotonic() + ASK_S)

    def _ask(self) -> None:
        assert self._dashboard is not None
        try:
            reply = self._dashboard.ask("is in remote control", time.monotonic() + ASK_S)
            self.remote = REMOTE.get(reply.lower())
            self._tells = self.remote is not None
        except DeviceError:  # a late answer would be taken for the next question's
            self.remote = None
            self._dashboard = None
