"""Zero in free air: mean, noise and slope of both force channels, kept for the record."""

from __future__ import annotations

import math
from collections.abc import Sequence

from stepload.engine.supervisor import Supervisor
from stepload.record.outcome import Tare

LEAST_READINGS = 3


class _Line:
    """Mean, and scatter about a straight line, of readings as they come (Welford's sums)."""

    def __init__(self) -> None:
        self.mean = self.mean_s = self.stt = self.stx = self.sxx = 0.0

    def add(self, count: int, time_s: float, value: float) -> None:
        """Take the `count`-th reading in."""
        dt, dx = time_s - self.mean_s, value - self.mean
        self.mean_s += dt / count
        self.mean += dx / count
        rest = time_s - self.mean_s
        self.stt += dt * rest
        self.stx += dx * rest
        self.sxx += dx * (value - self.mean)

    def noise(self, count: int) -> float:
        """Standard deviation about the line."""
        return math.sqrt(max(self.sxx - self.slope * self.stx, 0.0) / (count - 2))

    @property
    def slope(self) -> float:
        """Slope of the line per second."""
        return self.stx / self.stt if self.stt > 0.0 else 0.0


class TareWindow:
    """Collects readings while the arm rests, at a constant cost per reading."""

    def __init__(self) -> None:
        self._force, self._second = _Line(), _Line()
        self._wrench: list[float] = []
        self._first: Sequence[float] = ()
        self._live: set[int] = set()
        self.start_s = self._end_s = math.nan
        self.count = 0

    def add(
        self, time_s: float, force_n: float, second_n: float, wrench: Sequence[float] = ()
    ) -> None:
        """Take one reading of each channel in, in N, and the whole wrench; not tared."""
        if not self.count:
            self.start_s = time_s
        self._end_s = time_s
        self.count = count = self.count + 1
        since_s = time_s - self.start_s
        self._force.add(count, since_s, force_n)
        self._second.add(count, since_s, second_n)
        self._first = self._first or wrench
        self._live.update(i for i, value in enumerate(wrench[:3]) if value != self._first[i])
        means = self._wrench or wrench
        self._wrench = [
            mean + (value - mean) / count for mean, value in zip(means, wrench, strict=True)
        ]

    def offer(self, now_s: float, sup: Supervisor, duration_s: float) -> Tare | None:
        """Add a fresh reading; returns the result once the readings cover `duration_s`."""
        if sup.force.fresh:
            self.add(now_s, sup.force.raw_n, sup.second_raw_n, sup.force.wrench)
        if self.count < LEAST_READINGS or now_s - self.start_s < duration_s:
            return None
        return self.result()

    def result(self) -> Tare:
        """Mean, noise and slope of the readings so far; needs `LEAST_READINGS`.

        Raises:
            ValueError: there are fewer.
        """
        count, force, second = self.count, self._force, self._second
        if count < LEAST_READINGS:
            raise ValueError(f"a tare needs {LEAST_READINGS} readings, there are {count}")
        return Tare(
            self._end_s, self._end_s - self.start_s, count, force.mean, force.noise(count),
            force.slope, second.mean, second.noise(count), tuple(self._wrench),
            len(self._live),
        )  # fmt: skip
