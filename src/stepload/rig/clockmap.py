"""A device's clock on the host's monotonic clock, from pairs (device time, receive time).

host = device + offset + skew · (device − reference) + latency, latency ≥ 0. Offset and skew are
those of the line below all pairs with the smallest mean distance to them, an edge of their lower
convex hull: samples that came through without waiting fix the clock, late ones do not disturb it.
The smallest latency cannot be distinguished from the offset, so mapped times are late by that
constant. Wraps of a device's counter are undone by its driver.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.errors import DomainError

FloatArray = NDArray[np.float64]

MAX_SKEW = 1e-3
"""No quartz is off by more than 1000 ppm; a steeper line is latency, not skew."""
SKEW_SPAN_S = 10.0
"""Below this span jitter would be mistaken for skew: only the offset is fitted."""
_BUCKETS = 512
_SECONDS = 256


@dataclass(frozen=True, slots=True)
class ClockFit:
    """The map from device time to host time, and its residuals.

    `residual_median_us` and `residual_p99_us` are of receive time minus mapped time: the latency
    beyond the smallest one.
    """

    reference_s: float
    offset_s: float
    skew: float
    residual_median_us: float
    residual_p99_us: float
    points: int

    def to_host(self, device_s: FloatArray) -> FloatArray:
        """Host time in s of device times in s, same shape."""
        return device_s + (self.offset_s + self.skew * (device_s - self.reference_s))


def _lower_hull(x: Sequence[float], y: Sequence[float]) -> list[int]:
    """Indices of the lower convex hull; x strictly rising."""
    hull: list[int] = []
    for i in range(len(x)):
        while len(hull) >= 2:
            a, b = hull[-2], hull[-1]
            if (y[b] - y[a]) * (x[i] - x[a]) < (y[i] - y[a]) * (x[b] - x[a]):
                break
            hull.pop()
        hull.append(i)
    return hull


def _preflight(x: Sequence[float], y: Sequence[float], middle: float) -> tuple[float, float]:
    """(value at x = 0, slope) of the lower line; x strictly rising."""
    if x[-1] - x[0] < SKEW_SPAN_S:
        return min(y), 0.0
    hull = _lower_hull(x, y)
    right = next(i for i in range(1, len(hull)) if x[hull[i]] >= middle or i == len(hull) - 1)
    a, b = hull[right - 1], hull[right]
    slope = min(max((y[b] - y[a]) / (x[b] - x[a]), -MAX_SKEW), MAX_SKEW)
    return min(y[i] - slope * x[i] for i in hull), slope


def fit_clock(device_s: FloatArray, host_s: FloatArray) -> ClockFit:
    """Fit a whole recording at once.

    Args:
        device_s: device times, shape (N,), strictly rising.
        host_s: receive times, shape (N,).

    Raises:
        DomainError: fewer than two pairs, not finite, or a device clock that does not rise.
    """
    if len(device_s) < 2 or len(device_s) != len(host_s):
        raise DomainError(f"a clock fit needs at least 2 pairs of times, got {len(device_s)}")
    if not (np.isfinite(device_s).all() and np.isfinite(host_s).all()):
        raise DomainError("a clock fit needs finite times")
    x = device_s - device_s[0]
    if not (np.diff(x) > 0.0).all():
        at = int(np.argmin(np.diff(x)))
        raise DomainError(
            f"the device clock does not rise: {float(device_s[at])!r} s is followed by "
            f"{float(device_s[at + 1])!r} s (sample {at + 1})"
        )
    base = host_s[0] - device_s[0]
    y = (host_s - device_s) - base
    starts = np.unique(np.linspace(0, len(x), min(_BUCKETS, len(x)), endpoint=False, dtype=int))
    stops = np.append(starts[1:], len(x))
    lowest = [
        int(a + np.argmin(y[a:b])) for a, b in zip(starts.tolist(), stops.tolist(), strict=True)
    ]
    at_zero, skew = _preflight(x[lowest].tolist(), y[lowest].tolist(), float(x.mean()))
    at_zero = float(np.min(y - skew * x))
    residual_us = (y - at_zero - skew * x) * 1e6
    median, p99 = np.percentile(residual_us, (50.0, 99.0))
    return ClockFit(
        float(device_s[0]), float(base + at_zero), skew, float(median), float(p99), len(x)
    )


class ClockMap:
    """The same fit, updated while samples come in, over the last minutes.

    Keeps the least delayed pair of each second; the skew follows slow (thermal) changes.
    """

    def __init__(self) -> None:
        self._lowest: deque[tuple[float, float]] = deque(maxlen=_SECONDS)
        self._bucket = -1
        self._reference_s = 0.0
        self._base_s = 0.0
        self._offset_s = 0.0
        self.skew = 0.0
        """Relative rate error of the device clock: positive when it is slow."""

    def add(self, device_s: float, host_s: float) -> float:
        """Take one pair; returns receive time minus mapped time in s *before* it counts.

        Normally a small latency. Far below zero: the device clock jumped ahead; rising and rising:
        it stands still or lags. The driver decides what is too much.
        """
        if self._bucket < 0:
            self._reference_s, self._base_s = device_s, host_s - device_s
        x = device_s - self._reference_s
        y = host_s - device_s - self._base_s
        residual_s = y - self._offset_s - self.skew * x
        bucket = max(int(x), 0)
        if bucket > self._bucket:
            self._bucket = bucket
            if self._lowest:
                self._refit()
            self._lowest.append((x, y))
        elif y - self.skew * x < self._lowest[-1][1] - self.skew * self._lowest[-1][0]:
            self._lowest[-1] = (x, y)
        self._offset_s = min(self._offset_s, y - self.skew * x)
        return residual_s

    def _refit(self) -> None:
        pairs = sorted(dict(self._lowest).items())
        x, y = [pair[0] for pair in pairs], [pair[1] for pair in pairs]
        self._offset_s, self.skew = _preflight(x, y, (x[0] + x[-1]) / 2)

    def to_host(self, device_s: float) -> float:
        """Host time in s of a device time; never later than the pairs taken so far allow."""
        x = device_s - self._reference_s
        return device_s + self._base_s + self._offset_s + self.skew * x
