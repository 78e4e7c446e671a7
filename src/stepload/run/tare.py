"""Zero in free air: mean, noise and slope of both force channels, kept for the record."""

from __future__ import annotations

import math
from dataclasses import dataclass

from stepload.run.supervisor import Supervisor

LEAST_READINGS = 3
SURE_SIGMAS = 3.0


@dataclass(frozen=True, slots=True)
class Tare:
    """One look at the channels at rest in free air, not tared; second channel NaN where none.

    `noise_n` is the standard deviation about the slope.
    """

    time_s: float
    duration_s: float
    samples: int
    mean_n: float
    noise_n: float
    slope_n_per_s: float
    second_mean_n: float
    second_noise_n: float

    @property
    def mean_error_n(self) -> float:
        """Standard error of `mean_n`."""
        return self.noise_n / math.sqrt(self.samples)

    @property
    def second_mean_error_n(self) -> float:
        """Standard error of `second_mean_n`."""
        return self.second_noise_n / math.sqrt(self.samples)

    @property
    def sure_noise_n(self) -> float:
        """Lower bound (3 sigma) of the noise."""
        return self.noise_n * (1.0 - SURE_SIGMAS / math.sqrt(2.0 * self.samples))

    @property
    def sure_slope_n_per_s(self) -> float:
        """Lower bound (3 sigma) of the drift's size; 0 where none is sure."""
        error = self.noise_n * math.sqrt(12.0 / self.samples) / self.duration_s
        return max(0.0, abs(self.slope_n_per_s) - SURE_SIGMAS * error)


class _Line:
    """Mean, and scatter about a straight line, of readings as they come (Welford's sums)."""

    __slots__ = ("mean", "mean_s", "stt", "stx", "sxx")

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
        """Of the line, per second."""
        return self.stx / self.stt if self.stt > 0.0 else 0.0


class TareWindow:
    """Takes readings in while the arm rests; as cheap at the end as at the beginning."""

    __slots__ = ("_end_s", "_force", "_second", "count", "start_s")

    def __init__(self) -> None:
        self._force, self._second = _Line(), _Line()
        self.start_s = self._end_s = math.nan
        self.count = 0

    def add(self, time_s: float, force_n: float, second_n: float) -> None:
        """Take one reading of each channel in, in N, not tared."""
        if not self.count:
            self.start_s = time_s
        self._end_s = time_s
        self.count = count = self.count + 1
        since_s = time_s - self.start_s
        self._force.add(count, since_s, force_n)
        self._second.add(count, since_s, second_n)

    def offer(self, now_s: float, sup: Supervisor, duration_s: float) -> Tare | None:
        """Take a fresh reading in; the figures once the readings cover this long."""
        if sup.force.fresh:
            self.add(now_s, sup.force.raw_n, sup.second_raw_n)
        if self.count < LEAST_READINGS or now_s - self.start_s < duration_s:
            return None
        return self.result()

    def result(self) -> Tare:
        """The figures; needs `LEAST_READINGS`.

        Raises:
            ValueError: fewer.
        """
        count, force, second = self.count, self._force, self._second
        if count < LEAST_READINGS:
            raise ValueError(f"a tare needs {LEAST_READINGS} readings, there are {count}")
        return Tare(
            self._end_s, self._end_s - self.start_s, count, force.mean, force.noise(count),
            force.slope, second.mean, second.noise(count),
        )  # fmt: skip
