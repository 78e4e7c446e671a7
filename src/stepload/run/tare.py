"""Zero in free air: mean, noise and slope of both force channels, kept for the record."""

from __future__ import annotations

import math
from dataclasses import dataclass

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


class TareWindow:
    """Collects readings while the arm rests."""

    __slots__ = ("_force_n", "_second_n", "_time_s")

    def __init__(self) -> None:
        self._time_s: list[float] = []
        self._force_n: list[float] = []
        self._second_n: list[float] = []

    def add(self, time_s: float, force_n: float, second_n: float) -> None:
        """Take one reading of each channel in, in N, not tared."""
        self._time_s.append(time_s)
        self._force_n.append(force_n)
        self._second_n.append(second_n)

    @property
    def start_s(self) -> float:
        """Time of the first reading."""
        return self._time_s[0]

    @property
    def count(self) -> int:
        """Readings so far."""
        return len(self._time_s)

    def result(self) -> Tare:
        """The figures; needs `LEAST_READINGS`.

        Raises:
            ValueError: fewer.
        """
        count = len(self._time_s)
        if count < LEAST_READINGS:
            raise ValueError(f"a tare needs {LEAST_READINGS} readings, there are {count}")
        mean, noise, slope = _line(self._time_s, self._force_n)
        second_mean, second_noise, _ = _line(self._time_s, self._second_n)
        start_s, end_s = self._time_s[0], self._time_s[-1]
        return Tare(end_s, end_s - start_s, count, mean, noise, slope, second_mean, second_noise)


def _line(x: list[float], y: list[float]) -> tuple[float, float, float]:
    """Mean, scatter about the straight line, slope."""
    count = len(x)
    x_mean, y_mean = sum(x) / count, sum(y) / count
    sxx = sum((a - x_mean) ** 2 for a in x)
    sxy = sum((a - x_mean) * (b - y_mean) for a, b in zip(x, y, strict=True))
    slope = sxy / sxx if sxx > 0.0 else 0.0
    rest = sum((b - y_mean - slope * (a - x_mean)) ** 2 for a, b in zip(x, y, strict=True))
    return y_mean, math.sqrt(rest / (count - 2)), slope
