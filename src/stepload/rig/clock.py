"""The only two sources of time: the host's monotonic clock and a simulated one."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Time as the engine sees it. Nothing else in stepload reads the time by itself."""

    virtual: bool
    """True when time passes only through `sleep_until`; a run is then as fast as can be."""

    def now_s(self) -> float:
        """Seconds on this clock; never goes back."""

    def sleep_until(self, time_s: float) -> None:
        """Return at `time_s` or as soon after it as possible; at once if it is past."""


class MonotonicClock:
    """The host's monotonic clock (CLOCK_MONOTONIC)."""

    virtual = False

    def now_s(self) -> float:
        return time.monotonic()

    def sleep_until(self, time_s: float) -> None:
        remaining_s = time_s - time.monotonic()
        if remaining_s > 0.0:
            time.sleep(remaining_s)
