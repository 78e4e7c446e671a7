"""Properties read from an imported curve itself: noise, quantum, free air, touch."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from stepload.estimators.fit import FloatArray

LEAST_SLOPE = 0.15
"""A contact with an exponent up to 2.5 at 1 % of its peak force is at least that stiff, as a share
of its mean stiffness; what is softer is free air."""
REPEATS = 0.5
"""A channel with fewer distinct values than this share of its samples is quantised."""
FINEST = 1e-9
"""A quantum below this share of the channel's range is ignored."""
EXACT = 1e-5
"""A channel whose noise and quantum are below this share of its range was computed or smoothed: its
data do not show how accurately it was measured."""
TILT_SHARE, _TILT_STEPS = 0.1, 8
"""The slope of the force in free air is used only if it was seen over this share of the travel."""
_DIFFERENCES, _SMOOTH = 4, 0.3
_WINDOWS, _WINDOW = 64, 2048
"""Noise of long data is taken from so many windows of so many samples."""
_KEPT, _KEPT_SD = 0.98, 0.933
"""Share of the differences that is kept, and its standard deviation where noise is normal."""


def white_noise(values: FloatArray, order: int = _DIFFERENCES) -> float:
    """Standard deviation of the noise between samples; 0 for too few.

    Fourth differences are blind to the curvature of a law, even where samples are few; spikes and
    the corners of ramps are left out.
    """
    if len(values) <= 2 * order:
        return 0.0
    if len(values) > _WINDOWS * _WINDOW:
        starts = np.linspace(0, len(values) - _WINDOW, _WINDOWS).astype(np.intp)
        windows = values[starts[:, None] + np.arange(_WINDOW)]
        differences = np.sort(np.abs(np.diff(windows, order, axis=1)), axis=None)
    else:
        differences = np.sort(np.abs(np.diff(values, order)))
    kept = differences[: math.ceil(_KEPT * differences.size)]
    gain = math.sqrt(math.comb(2 * order, order))
    return float(np.sqrt(np.mean(kept**2))) / (gain * _KEPT_SD)


def quantum(values: FloatArray) -> float:
    """The resolution of a channel as its data show it, in its unit; 0 where it is not quantised."""
    different = np.unique(values)
    if len(different) > max(REPEATS * len(values), 3):
        return 0.0
    steps = np.diff(different)
    steps = steps[steps > 1e-3 * float(np.median(steps))] if steps.size else steps
    least = FINEST * float(np.ptp(values))
    return float(steps.min()) if steps.size and float(steps.min()) > least else 0.0


def is_exact(values: FloatArray) -> bool:
    """Whether a channel is neither noisy nor quantised, so that its data do not show its accuracy.

    White noise has the same size in differences of every order; a smooth signal becomes smaller.
    """
    least, noise = EXACT * float(np.ptp(values)), white_noise(values)
    if quantum(values) > least:
        return False
    return noise <= least or white_noise(values, 2 * _DIFFERENCES) < _SMOOTH * noise


def first_touch(force_n: FloatArray, touch_n: float) -> int:
    """Index of the first sample of a lasting contact; a spike in free air does not count."""
    half = int(np.argmax(force_n >= 0.5 * force_n.max()))
    free = np.flatnonzero(force_n[:half] < touch_n)
    return int(free[-1]) + 1 if free.size else 0


class FreeAir(NamedTuple):
    """The force in free air: its mean, and its slope over the travel about `at_m`."""

    mean_n: float
    slope_n_per_m: float
    at_m: float

    def at(self, travel_m: FloatArray) -> FloatArray:
        """Force extrapolated from free air to a travel."""
        return np.asarray(self.mean_n + self.slope_n_per_m * (travel_m - self.at_m))


def free_air(travel_m: FloatArray, force_n: FloatArray, band_n: float) -> FreeAir | None:
    """The force while the arm moves in free air; None where the data begin in contact or at rest.

    Its slope is used only where it exceeds the band over the whole travel: it is drift, or optical
    interference of a cantilever.

    Args:
        travel_m, force_n: (N,) a loading, force not tared.
        band_n: how far the force may go in free air.
    """
    begin_n = float(np.median(force_n[: max(len(force_n) // 100, 5)]))
    end = first_touch(force_n - begin_n, band_n)
    if end < 8:
        return None
    span_m = float(np.ptp(travel_m))
    found = _line(travel_m[: end // 2 + 1], force_n[: end // 2 + 1], span_m, band_n)
    for _ in range(_TILT_STEPS):
        # A slope leaves the band before the touch: what follows the line is free air as well.
        further = first_touch(force_n - found.at(travel_m), band_n)
        if not found.slope_n_per_m or further <= end:
            break
        end = further
        found = _line(travel_m[: end // 2 + 1], force_n[: end // 2 + 1], span_m, band_n)
    x, y = travel_m[:end] - travel_m[:end].mean(), force_n[:end]
    spread = float(x @ x)
    mean_slope = float(np.ptp(force_n)) / max(span_m, math.ulp(0.0))
    if spread <= 0.0:
        return None
    slope = float(x @ y) / spread
    if slope + 3.0 * float(np.std(y - slope * x)) / math.sqrt(spread) > LEAST_SLOPE * mean_slope:
        return None
    if float(np.ptp(travel_m[:end])) < TILT_SHARE * span_m:
        return FreeAir(float(force_n[: end // 2 + 1].mean()), 0.0, found.at_m)
    return found


def _line(x: FloatArray, y: FloatArray, span_m: float, band_n: float) -> FreeAir:
    at_m, mean_n = float(x.mean()), float(y.mean())
    off = x - at_m
    spread = float(off @ off)
    slope = float(off @ y) / spread if spread > 0.0 else 0.0
    error = float(np.std(y)) / math.sqrt(spread) if spread > 0.0 else math.inf
    seen = abs(slope) * span_m > band_n and abs(slope) > 5.0 * error
    return FreeAir(mean_n, slope if seen else 0.0, at_m)
