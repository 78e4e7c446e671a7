"""The filtered force of one channel, its rate, and the peak before the arm can give way."""

from __future__ import annotations

import math

RATE_SIGMAS = 4.0
"""Standard deviations of the rate's own noise that count as no rise."""


class ForceFilter:
    """Two equal low-pass filters in a row; the gap between them is the rate.

    `smooth_n` is the filtered force, `slope_n_per_s` its rate.

    Args:
        period_s: of the tick.
        late_s: longest time in s from a target to its effect on this channel's readings.
        noise_n: noise (sd) of one reading; `expect` replaces it.
    """

    def __init__(self, period_s: float, late_s: float, noise_n: float) -> None:
        self.tau_s = max(0.25 * late_s, 2.0 * period_s)
        self.alpha = alpha = period_s / self.tau_s
        self.span_s = self.tau_s * (1.0 - alpha)  # by which the slower filter lags behind a ramp
        self._late_s = late_s
        self.smooth_n = self._slow_n = self.slope_n_per_s = 0.0
        self.expect(noise_n)

    def expect(self, noise_n: float) -> None:
        """Count with noise of this sd from now on."""
        self._noise_n = RATE_SIGMAS * (noise_n * math.sqrt(self.alpha / (2.0 - self.alpha)))
        self._rate_noise_n_per_s = self._noise_n / self.span_s

    def restart(self, force_n: float) -> None:
        """Begin at rest with this force."""
        self.smooth_n = self._slow_n = force_n
        self.slope_n_per_s = 0.0

    def add(self, force_n: float) -> None:
        """Add the force of one tick."""
        self.smooth_n = smooth_n = self.smooth_n + self.alpha * (force_n - self.smooth_n)
        self._slow_n = slow_n = self._slow_n + self.alpha * (smooth_n - self._slow_n)
        self.slope_n_per_s = (smooth_n - slow_n) / self.span_s

    def peak_n(self) -> float:
        """Magnitude in N that the force reaches within `late_s`."""
        slope = self.slope_n_per_s if self.smooth_n >= 0.0 else -self.slope_n_per_s
        rise = slope - self._rate_noise_n_per_s
        peak_n = abs(self.smooth_n) + self._noise_n
        return peak_n + rise * self._late_s if rise > 0.0 else peak_n
