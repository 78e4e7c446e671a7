"""Detection of a standstill of the TCP, from measured poses, not from commands."""

from __future__ import annotations

from collections import deque

from stepload_drivers.ur.state import UrState

WINDOW_S = 0.04
STILL_M = 5e-5


class Standstill:
    """Looks back over `WINDOW_S` of controller time."""

    def __init__(self) -> None:
        self._window: deque[UrState] = deque()

    def add(self, state: UrState) -> None:
        self._window.append(state)
        while state.timestamp_s - self._window[0].timestamp_s > WINDOW_S + 0.02:
            self._window.popleft()

    @property
    def still(self) -> bool:
        """Whether no coordinate moved by more than `STILL_M` in a full window."""
        if not self._window:
            return False
        covered_s = self._window[-1].timestamp_s - self._window[0].timestamp_s
        if covered_s < WINDOW_S:
            return False
        spans = zip(*(state.pose[:3] for state in self._window), strict=True)
        return all(max(span) - min(span) <= STILL_M for span in spans)
