"""Comparison of the two force channels: do they differ (R5), does one stand still (R4)?

The channels have different delays and periods: while the force moves, their readings in one tick
are not of the same moment. But over the last `skew_s`, which covers delays and periods, both have
read the same stretch of time, so the ranges of their readings overlap unless one of them errs. The
gap between the ranges is the difference: motion makes none, a wrong channel does.

A channel that repeats its reading gives no new information, however often it is sampled. How far
the other one has moved since its last change shows whether it is frozen.
"""

from __future__ import annotations

import math

FILTERS = 8.0
"""Time constants after which a filter holds 3e-4 of a step: 0.1 N of 300 N."""


class _Range:
    """Lowest and highest of the last filtered readings of one channel, without their noise."""

    def __init__(self, ticks: int, alpha: float, noise_n: float) -> None:
        self._alpha = alpha
        self._noise_n = noise_n * math.sqrt(alpha / (2.0 - alpha))
        self._readings = [math.nan] * ticks
        self._at = 0
        self._n = self._low_n = self._high_n = math.nan

    def restart(self) -> None:
        self._n = math.nan

    def add(self, reading_n: float) -> tuple[float, float]:
        """Add a reading; (lowest, highest) less the noise, both the middle if nothing is left."""
        readings, at = self._readings, self._at
        if self._n != self._n:
            self._n = self._low_n = self._high_n = reading_n
            readings[:] = [reading_n] * len(readings)
        oldest_n = readings[at]
        readings[at] = self._n = n = self._n + self._alpha * (reading_n - self._n)
        self._at = at + 1 if at + 1 < len(readings) else 0
        if n <= self._low_n:
            self._low_n = n
        elif oldest_n == self._low_n:
            self._low_n = min(readings)
        if n >= self._high_n:
            self._high_n = n
        elif oldest_n == self._high_n:
            self._high_n = max(readings)
        low, high = self._low_n + self._noise_n, self._high_n - self._noise_n
        if low < high:
            return low, high
        middle = 0.5 * (low + high)
        return middle, middle


class Standing:
    """How far the main channel has moved while the second one stood still, as `moved_n` in N.

    Within any window of `skew_s` a sound second sensor has sampled the force at least once. So
    where the main one has read above a level for that long, the second has sampled at least that
    level, and likewise below another one: the difference of the two is what it should have shown.
    What came and went between two of its samples does not count. The first window begins `skew_s`
    after the second's last change, and `FILTERS` time constants later, when the filter has
    forgotten what was before.

    Args:
        period_s: of the tick.
        skew_s, filter_s: as in `CrossCheck`.
    """

    def __init__(self, period_s: float, skew_s: float, filter_s: float) -> None:
        self._alpha = min(1.0, period_s / filter_s)
        self._last = [math.nan] * (1 + math.ceil(skew_s / period_s - 1e-9))
        self._wait = 2 * len(self._last) + math.ceil(FILTERS * filter_s / period_s - 1e-9)
        self.restart()

    def restart(self) -> None:
        self._at = self.ticks = 0
        self._main_n = self.second_n = math.nan
        self._low_n, self._high_n, self.moved_n = math.inf, -math.inf, 0.0

    def add(self, main_n: float, second_n: float) -> None:
        """Take in what both channels read in this tick."""
        last, at = self._last, self._at
        if self._main_n != self._main_n:
            self._main_n = main_n
            last[:] = [main_n] * len(last)
        last[at] = self._main_n = self._main_n + self._alpha * (main_n - self._main_n)
        self._at = at + 1 if at + 1 < len(last) else 0
        if second_n != self.second_n:
            self.second_n, self.ticks = second_n, 0
            self._low_n, self._high_n, self.moved_n = math.inf, -math.inf, 0.0
            return
        self.ticks += 1
        if self.ticks >= self._wait:
            self._low_n = min(self._low_n, max(last))
            self._high_n = max(self._high_n, min(last))
            self.moved_n = max(0.0, self._high_n - self._low_n)


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
