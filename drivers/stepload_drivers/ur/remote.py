"""Asks for remote control aside of the loop, so that data go on flowing meanwhile."""

from __future__ import annotations

import threading

from stepload_drivers.ur.preflight import in_remote_control

ASK_S = 0.2


class RemoteCheck:
    """One question to the dashboard; `remote` is None when it was not answered."""

    def __init__(self, host: str) -> None:
        self.remote: bool | None = None
        self._thread = threading.Thread(target=self._ask, args=(host,), daemon=True)
        self._thread.start()

    def _ask(self, host: str) -> None:
        self.remote = in_remote_control(host, ASK_S)

    @property
    def done(self) -> bool:
        return not self._thread.is_alive()
