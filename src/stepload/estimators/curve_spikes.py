"""Glitches of a channel: one or two samples that jump away and come back. A step is none."""

from __future__ import annotations

import numpy as np

from stepload.estimators.curve_parts import quantum
from stepload.estimators.fit import BoolArray, FloatArray, IntArray

LEAST_SAMPLES = 32
"""Shortest table in which glitches are looked for: below it one looks like the top of a press."""
WIDEST = 2
"""Largest number of samples in a glitch."""
SUDDEN = 5.0
"""Least ratio of a glitch to the steps between the samples next to it. The top of a press and the
dip of a snap-in, which have a gradual flank, stay below."""
MOST = 0.01
"""Above this share of outliers the channel is taken as it is, and none counts as a glitch."""
_BESIDE, _ABOUT = 3, 12
_NOISE, _QUANTA, _LEAST = 10.0, 4.0, 1e-3


def spikes(values: FloatArray) -> BoolArray:
    """Samples (N,) that deviate while their neighbours on both sides agree with each other.

    After Hampel, a sample is compared with medians of its neighbourhood: it deviates by more than
    ten median steps, four quanta and 0.1 % of the range. None is reported in tables of fewer than
    32 samples, in the first and last three samples, or where more than 1 % would be.

    Args:
        values: (N,) a channel in the order of time.
    """
    found = np.zeros(values.size, dtype=np.bool_)
    if values.size < LEAST_SAMPLES:
        return found
    low, high = np.percentile(values, [5.0, 95.0])
    least = max(_LEAST * float(high - low), _QUANTA * quantum(values))
    steps = np.abs(np.diff(values))
    for width in range(1, WIDEST + 1):
        for at in _outside(values, steps, width, least):
            about = steps[max(at - _ABOUT, 0) : at + width - 1 + _ABOUT]
            off = min(steps[at - 1], steps[at + width - 1])
            if off > _NOISE * np.median(about):
                found[at : at + width] = True
    return found if found.sum() <= MOST * values.size + 1.0 else np.zeros_like(found)


def _outside(values: FloatArray, steps: FloatArray, width: int, least: float) -> IntArray:
    """Places where `width` samples lie outside both neighbours, which hardly move."""
    at = np.arange(_BESIDE, values.size - width - _BESIDE + 1)
    before, after = values[at - 1], values[at + width]
    inside = np.lib.stride_tricks.sliding_window_view(values, width)[at]
    above = inside.min(axis=1) - np.maximum(before, after)
    below = np.minimum(before, after) - inside.max(axis=1)
    busy = np.abs(after - before)
    for further in range(1, _BESIDE):
        left, right = steps[at - 1 - further], steps[at + width - 1 + further]
        busy = np.maximum(busy, np.maximum(left, right))
    off = np.maximum(above, below) > np.maximum(SUDDEN * busy, least)
    return np.asarray(at[off], dtype=np.intp)
