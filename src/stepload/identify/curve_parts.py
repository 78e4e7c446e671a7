"""What an imported curve tells of itself: noise, quantum, free air, touch, first loading."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError

FloatArray = NDArray[np.float64]

SAME_PEAK, LEFT_PEAK, HELD_PEAK = 0.95, 0.9, 0.99
"""Shares of the largest force: the first peak reaches the one and ends below the next; what is held
above the last still belongs to the loading."""
LEAST_SLOPE = 0.15
"""A contact with an exponent up to 2.5 at 1 % of its peak force is at least that stiff, as a share
of its mean stiffness; what is softer is free air."""
REPEATS = 0.5
"""A channel with fewer different values than this share of its samples is quantised."""
FINEST_M = 1e-9
"""Resolution of a channel that is not quantised."""
_DIFFERENCES = 4
_GAIN = math.sqrt(math.comb(2 * _DIFFERENCES, _DIFFERENCES))
"""Standard deviation of the fourth differences of white noise of size 1."""
_KEPT, _KEPT_SD = 0.98, 0.933
"""Share of the differences that is kept, and its standard deviation where noise is normal."""


def white_noise(values: FloatArray) -> float:
    """Standard deviation of the noise between samples; 0 for too few.

    Fourth differences are blind to the curvature of a law, even where samples are few; spikes and
    the corners of ramps are left out.
    """
    if len(values) <= 2 * _DIFFERENCES:
        return 0.0
    differences = np.sort(np.abs(np.diff(values, _DIFFERENCES)))
    kept = differences[: math.ceil(_KEPT * differences.size)]
    return float(np.sqrt(np.mean(kept**2))) / (_GAIN * _KEPT_SD)


def quantum(position_m: FloatArray) -> float:
    """The resolution (m) of a channel as its data show it; 1 nm where it is not quantised."""
    values = np.unique(position_m)
    if len(values) > max(REPEATS * len(position_m), 3):
        return FINEST_M
    steps = np.diff(values)
    steps = steps[steps > 1e-3 * float(np.median(steps))] if steps.size else steps
    return max(float(steps.min()), FINEST_M) if steps.size else FINEST_M


def first_loading(force_n: FloatArray) -> slice:
    """From the start to the end of the first peak: later cycles and unloading are another contact.

    Raises:
        BadInputError: no force is positive.
    """
    top_n = float(force_n.max())
    if not top_n > 0.0:
        raise BadInputError(
            f"the largest force is {top_n:.3g} N", hint="pressing must be positive: turn the sign"
        )
    start = int(np.argmax(force_n >= SAME_PEAK * top_n))
    below = np.flatnonzero(force_n[start:] < LEFT_PEAK * top_n)
    if not below.size:
        return slice(0, len(force_n))
    peak = force_n[start : start + int(below[0])]
    held = np.flatnonzero(peak >= HELD_PEAK * peak.max())
    return slice(0, start + int(held[-1]) + 1)


def first_touch(force_n: FloatArray, touch_n: float) -> int:
    """Index of the first sample of a contact that lasts; a spike in free air is none."""
    half = int(np.argmax(force_n >= 0.5 * force_n.max()))
    free = np.flatnonzero(force_n[:half] < touch_n)
    return int(free[-1]) + 1 if free.size else 0


def free_air_force(travel_m: FloatArray, force_n: FloatArray, band_n: float) -> float | None:
    """Mean force while the arm moves in free air; None where the data begin in contact or at rest.

    Args:
        travel_m, force_n: (N,) a loading, force not tared.
        band_n: how far the force may go in free air.
    """
    begin_n = float(np.median(force_n[: max(len(force_n) // 100, 5)]))
    end = first_touch(force_n - begin_n, band_n)
    if end < 8:
        return None
    x, y = travel_m[:end] - travel_m[:end].mean(), force_n[:end]
    spread = float(x @ x)
    mean_slope = float(np.ptp(force_n)) / max(float(np.ptp(travel_m)), FINEST_M)
    if spread <= 0.0:
        return None
    slope = float(x @ y) / spread
    if slope + 3.0 * float(np.std(y)) / math.sqrt(spread) > LEAST_SLOPE * mean_slope:
        return None
    return float(np.mean(y[: end // 2 + 1]))
