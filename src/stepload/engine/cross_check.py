"""The second force channel: its filtered force, and its comparison with the main one (R5).

The channels have different delays and periods: while the force moves, their readings in one tick
are not of the same moment. But over the last `skew_s`, which covers delays and periods, both have
read the same stretch of time, so the ranges of their readings overlap unless one of them errs. The
gap between the ranges is the difference: motion makes none, a wrong channel does.
"""

from __future__ import annotations

import math
from collections import deque

RATE_SIGMAS = 4.0
"""Standard deviations of the rate's own noise that count as no rise."""


def filter_times(period_s: float, late_s: float) -> tuple[float, float, float]:
    """Time constant of a channel's filter, its share of a new reading, and the lag of two in a row
    behind one on a ramp, for readings that are late by up to `late_s`."""
    tau_s = max(0.25 * late_s, 2.0 * period_s)
    alpha = period_s / tau_s
    return tau_s, alpha, tau_s * (1.0 - alpha)


class SecondFilter:
    """The second channel's force, filtered, and the peak before the arm can give way.

    Two equal low-pass filters in a row: the gap between them is the rate. `smooth_n` is the
    filtered force.

    Args:
        period_s: of the tick.
        late_s: longest time in s from a target to its effect on this channel's readings.
        noise_n: noise (sd) of one reading; `expect` replaces it.
    """

    def __init__(self, period_s: float, late_s: float, noise_n: float) -> None:
        _, self._alpha, self._span_s = filter_times(period_s, late_s)
        self._late_s = late_s
        self.smooth_n = self._slow_n = 0.0
        self.expect(noise_n)

    def expect(self, noise_n: float) -> None:
        """Count with noise of this sd from now on."""
        self._noise_n = RATE_SIGMAS * (noise_n * math.sqrt(self._alpha / (2.0 - self._alpha)))
        self._rate_noise_n_per_s = self._noise_n / self._span_s

    def restart(self, force_n: float) -> None:
        """Begin at rest with this force."""
        self.smooth_n = self._slow_n = force_n

    def peak_n(self, force_n: float) -> float:
        """Add the force of one tick; the magnitude in N that the force reaches within `late_s`."""
        alpha = self._alpha
        self.smooth_n = smooth_n = self.smooth_n + alpha * (force_n - self.smooth_n)
        self._slow_n = slow_n = self._slow_n + alpha * (smooth_n - self._slow_n)
        slope = (smooth_n - slow_n) / self._span_s
        if smooth_n < 0.0:
            smooth_n, slope = -smooth_n, -slope
        rise = slope - self._rate_noise_n_per_s
        peak_n = smooth_n + self._noise_n
        return peak_n + rise * self._late_s if rise > 0.0 else peak_n


class _Range:
    """Lowest and highest of the last filtered readings of one channel; `noise_n` is their noise."""

    def __init__(self, ticks: int, alpha: float, noise_n: float) -> None:
        self._alpha = alpha
        self.noise_n = noise_n * math.sqrt(alpha / (2.0 - alpha))
        self._readings = deque([math.nan] * ticks, ticks)
        self._n = self.low_n = self.high_n = math.nan

    def restart(self) -> None:
        self._n = math.nan

    def add(self, reading_n: float) -> None:
        """Add a reading."""
        n, readings = self._n, self._readings
        if n != n:
            n = self.low_n = self.high_n = reading_n
            readings.extend([n] * len(readings))
        oldest_n = readings[0]
        self._n = n = n + self._alpha * (reading_n - n)
        readings.append(n)
        if n <= self.low_n:
            self.low_n = n
        elif oldest_n == self.low_n:
            self.low_n = min(readings)
        if n >= self.high_n:
            self.high_n = n
        elif oldest_n == self.high_n:
            self.high_n = max(readings)


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
        main, second = self._main, self._second
        main.add(main_n)
        second.add(second_n)
        low_n, high_n = main.low_n + main.noise_n, main.high_n - main.noise_n
        if not low_n < high_n:  # nothing is left without the noise: the middle
            low_n = high_n = 0.5 * (low_n + high_n)
        second_low_n, second_high_n = second.low_n + second.noise_n, second.high_n - second.noise_n
        if not second_low_n < second_high_n:
            second_low_n = second_high_n = 0.5 * (second_low_n + second_high_n)
        if second_low_n > high_n:
            self.difference_n = second_low_n - high_n
        elif second_high_n < low_n:
            self.difference_n = second_high_n - low_n
        else:
            self.difference_n = 0.0
