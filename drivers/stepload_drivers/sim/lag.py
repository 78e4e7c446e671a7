"""What a force channel shows late: an earlier force, or the force through a filter."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

from stepload_drivers.sim.faults import LATE, Schedule

Forces = tuple[float, ...]


class Lag:
    """The force that a channel shows, one call per sample; as many components as `shown` is given.

    Args:
        faults: those of the channel's device.
        period_s: between two samples.
        prefix: of the kinds, where the faults have one.
    """

    def __init__(self, faults: Schedule, period_s: float, prefix: str = "") -> None:
        self._aged, self._old, self._filter = (prefix + kind for kind in LATE)
        self._period_s = period_s
        longest_s = max(faults.largest(self._aged), faults.largest(self._old))
        self._past: deque[Forces] = deque(maxlen=round(longest_s / period_s) + 1)
        self.remembers = longest_s > 0.0
        """Whether `shown` must be asked before the fault begins, too."""
        self._aging = 0
        self._filtered: Forces = ()

    def shown(self, truth: Forces, active: Mapping[str, float]) -> Forces:
        """What is shown now instead of `truth`."""
        self._past.append(truth)
        self._aging = self._aging + 1 if self._aged in active else 0
        lag = round(active.get(self._old, 0.0) / self._period_s)
        if self._aging:
            lag = min(self._aging - 1, round(active[self._aged] / self._period_s))
        truth = self._past[max(0, len(self._past) - 1 - lag)]
        if self._filter not in active:
            self._filtered = truth
            return truth
        part = 1.0 - math.exp(-self._period_s / active[self._filter])
        pairs = zip(self._filtered or truth, truth, strict=True)
        self._filtered = tuple([was + part * (now - was) for was, now in pairs])
        return self._filtered
