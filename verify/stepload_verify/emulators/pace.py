"""When an emulated controller's next period is due, on a host that may come late."""

from __future__ import annotations

import math

CATCH_UP_PERIODS = 10
"""Largest number of periods that are made up for after a stall of the host; the rest is skipped."""
APART = 0.5
"""Time between two periods that are made up for, as a share of the period. Packages sent at one
moment look like one to a client that keeps the newest only: a late host would look like a lossy
cable."""


class Pace:
    """Periods of `period_s` from `start_s` on, on the clock of the host (s).

    `late` counts the periods that began more than one period after their time, `skipped` those
    that never did.
    """

    def __init__(self, period_s: float, start_s: float) -> None:
        self.period_s = period_s
        self.late = 0
        self.skipped = 0
        self._next_s = start_s + period_s
        self._last_s = -math.inf

    @property
    def due_s(self) -> float:
        """When the next period begins."""
        return max(self._next_s, self._last_s + APART * self.period_s)

    def begin(self, now_s: float) -> int:
        """Begin the next period, which is due; returns how many are skipped before it."""
        behind = int((now_s - self._next_s) / self.period_s)
        skipped = max(0, behind - CATCH_UP_PERIODS)
        self.skipped += skipped
        self.late += behind > 0
        self._next_s += (skipped + 1) * self.period_s
        self._last_s = now_s
        return skipped
