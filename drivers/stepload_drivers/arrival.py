"""Arrival times of a device without clock and counter: spread bursts, find what was lost."""

from __future__ import annotations

import math

WINDOW_S = 0.128
LEARN_WINDOWS = 2
LEARN_GAIN = 0.1
MAX_RATE_ERROR = 0.02


def spread_back(count: int, arrival_s: float, period_s: float, not_before_s: float) -> list[float]:
    """Times of `count` samples that arrived together: the last now, the others a period apart.

    Never before `not_before_s` (the sample before them), so that time does not go back.
    """
    return [max(arrival_s - back * period_s, not_before_s) for back in range(count - 1, -1, -1)]


class ArrivalCounter:
    """Counts lost samples from arrival times alone.

    A single late arrival proves nothing: buffers and schedulers delay. But within some tens of
    samples at least one comes through undelayed. So the punctual sample of each window is compared
    with the one of the window before: a lag that has grown by a whole period is a lost sample, a
    smaller one is the device's clock, which is tracked (within 2 % of nominal). Losses show one to
    two windows late (0.13-0.26 s at 1 kHz); those in the first two windows are not seen.

    Limit: an adapter that delivers on a clock of its own (a USB latency timer) beats against the
    sensor's clock, and each slip of the beat looks like one lost sample.
    """

    def __init__(self, period_s: float) -> None:
        self._nominal_s = self.period_s = period_s
        self._size = round(min(128.0, max(16.0, WINDOW_S / period_s)))
        self._index = 0
        self._windows = 0
        self._found = 0
        self._reference = (math.nan, 0)
        self._last_s = -math.inf
        self._open_window(math.nan)

    def _open_window(self, time_s: float) -> None:
        self._opened_s = time_s
        self._counted = 0
        self._best = (math.nan, 0)
        self._best_lag_s = math.inf

    def skip(self, count: int) -> None:
        """Leave out samples that are known to be lost."""
        self._index += count

    def stamped(self, count: int, arrival_s: float) -> tuple[int, list[float]]:
        """`arrived`, and the times of the samples, which are spread back."""
        lost = self.arrived(count, arrival_s)
        times_s = spread_back(count, arrival_s, self.period_s, self._last_s)
        self._last_s = arrival_s
        return lost, times_s

    def arrived(self, count: int, time_s: float) -> int:
        """Note `count` samples taken off the wire at `time_s`.

        Returns: samples newly found lost; negative when an earlier finding proves wrong.
        """
        if math.isnan(self._opened_s):
            self._opened_s = time_s
        self._index += count
        self._counted += count
        lag_s = (time_s - self._opened_s) - self._counted * self.period_s
        if lag_s < self._best_lag_s:
            self._best_lag_s, self._best = lag_s, (time_s, self._index)
        full = self._counted >= self._size
        if not full or time_s - self._opened_s < 0.75 * self._size * self.period_s:
            return 0
        lost = self._compare()
        self._index += lost
        self._open_window(time_s)
        return lost

    def _compare(self) -> int:
        time_s, index = self._best
        reference_s, reference_index = self._reference
        self._windows += 1
        self._reference = self._best
        if self._windows == 1:
            return 0
        steps = index - reference_index
        jump_s = (time_s - reference_s) - steps * self.period_s
        learning = self._windows <= 1 + LEARN_WINDOWS
        if learning or abs(jump_s) < 0.75 * self.period_s:
            period_s = self.period_s + (1.0 if learning else LEARN_GAIN) * jump_s / steps
            low_s, high_s = (self._nominal_s * f for f in (1 - MAX_RATE_ERROR, 1 + MAX_RATE_ERROR))
            self.period_s = min(max(period_s, low_s), high_s)
            return 0
        lost = max(round(jump_s / self.period_s), -self._found)
        self._found += lost
        self._reference = (time_s, index + lost)
        return lost
