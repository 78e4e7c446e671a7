"""Asks for remote control aside of the loop, so that data go on flowing meanwhile."""

from __future__ import annotations

import contextlib
import threading
import time

from stepload.errors import DeviceError
from stepload_drivers.ur.client import Dashboard
from stepload_drivers.ur.preflight import REMOTE

ASK_S = 0.2


class RemoteCheck:
    """One question to the dashboard, on a connection made beforehand: see `ports.ControlPort`.

    `remote` is None where the controller cannot or does not say.
    """

    def __init__(self, host: str) -> None:
        self.remote: bool | None = None
        self._thread: threading.Thread | None = None
        self._dashboard: Dashboard | None = None
        with contextlib.suppress(DeviceError):
            self._dashboard = Dashboard(host, time.monotonic() + ASK_S)

    def done(self) -> bool:
        """Whether the answer is there or given up; the first call asks."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._ask, daemon=True)
            self._thread.start()
        return not self._thread.is_alive()

    def end_program(self) -> None:
        """Send the dashboard's stop, aside of the loop too; whether it is obeyed is not told."""
        threading.Thread(target=self._stop, daemon=True).start()

    def _stop(self) -> None:
        if self._dashboard is not None:
            with contextlib.suppress(DeviceError):
                self._dashboard.ask("stop", time.monotonic() + ASK_S)

    def _ask(self) -> None:
        if self._dashboard is None:
            return
        try:
            reply = self._dashboard.ask("is in remote control", time.monotonic() + ASK_S)
        except DeviceError:
            return
        self.remote = REMOTE.get(reply.lower())
