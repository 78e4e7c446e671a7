"""Comparison of the two force channels (R5).

The channels have different delays and periods: while the force moves, their readings in one tick
are not of the same moment. But over the last `skew_s`, which covers delays and periods, both have
read the same stretch of time, so the ranges of their readings overlap unless one of them errs. The
gap between the ranges is the difference: motion makes none, a wrong channel does.
"""

from __future__ import annotations

import math
from collections import deque


class _Range:
    """Lowest and highest of the last filtered readings of one channel, without their noise."""

    def __init__(self, ticks: int, alpha: float, noise_n: float) -> None:
        self._alpha = alpha
        self._noise_n = noise_n * math.sqrt(alpha / (2.0 - alpha))
        self._readings = deque([math.nan] * ticks, ticks)
        self._n = self._low_n = self._high_n = math.nan

    def restart(self) -> None:
        self._n = math.nan

    def add(self, reading_n: float) -> tuple[float, float]:
        """Add a reading; (lowest, highest) less the noise, both the middle if nothing is left."""
        n, readings = self._n, self._readings
        if n != n:
            n = self._low_n = self._high_n = reading_n
            readings.extend([n] * len(readings))
        oldest_n, low_n, high_n = readings[0], self._low_n, self._high_n
        self._n = n = n + self._alpha * (reading_n - n)
        readings.append(n)
        if n <= low_n:
            self._low_n = low_n = n
        elif oldest_n == low_n:
            self._low_n = low_n = min(readings)
        if n >= high_n:
            self._high_n = high_n = n
        elif oldest_n == high_n:
            self._high_n = high_n = max(readings)
        low, high = low_n + self._noise_n, high_n - self._noise_n
        if low < high:
            return low, high
        middle = 0.5 * (low + high)
        return middle, middle


class CrossCheck:
    """Ranges of both channels over the last `skew_s`; `difference_n` is the gap between them.

    Args:
        period_s: of the tick.
        skew_s: upper bound on how much older one channel's reading may be than the other's.
        filter_s: time constant of the filter on each channel.
        noise_n: noise (sd) of one reading of the main and of the second channel.
    """

    def __init__(
        self, period_s: float, skew_s: float, filter_s: float, noise_n: tuple[float, float]
    ) -> None:
        alpha = min(1.0, period_s / filter_s)
        ticks = 1 + math.ceil(skew_s / period_s - 1e-9)
        self._main, self._second = (_Range(ticks, alpha, each) for each in noise_n)
        self.difference_n = 0.0

    def restart(self) -> None:
        """Forget what was read: the zeros have changed."""
        self._main.restart()
        self._second.restart()
        self.difference_n = 0.0

    def add(self, main_n: float, second_n: float) -> None:
        """Take in what both channels read in this tick, tared."""
        low_n, high_n = self._main.add(main_n)
        second_low_n, second_high_n = self._second.add(second_n)
        if second_low_n > high_n:
            self.difference_n = second_low_n - high_n
        elif second_high_n < low_n:
            self.difference_n = second_high_n - low_n
        else:
            self.difference_n = 0.0
