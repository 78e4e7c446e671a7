"""Glitches of a channel: one or two samples that jump away and come back. A step is none."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stepload.estimators.curve_parts import quantum
from stepload.estimators.fit import FloatArray

LEAST_SAMPLES = 32
"""In a shorter table a glitch cannot be told from the top of a press."""
WIDEST = 2
"""Samples that a glitch has at most."""
SUDDEN = 5.0
"""A glitch is so many times as far off as the channel goes from sample to sample beside it: the
top of a press and the dip of a snap-in, which one of their flanks leads to, are none."""
MOST = 0.01
"""A larger share of glitches is no glitch but the channel."""
_BESIDE, _ABOUT = 3, 12
_NOISE, _QUANTA, _LEAST = 10.0, 4.0, 1e-3


def spikes(values: FloatArray) -> NDArray[np.bool_]:
    """Samples (N,) that lie off while both sides of them agree with each other.

    After Hampel, a sample is judged by the medians about it: it is further off than ten median
    steps of its neighbourhood, four quanta and 0.1 % of the range. None is found in tables of
    fewer than 32 samples, in the first and last three, and where more than 1 % would be.

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


def _outside(values: FloatArray, steps: FloatArray, width: int, least: float) -> NDArray[np.intp]:
    """Where `width` samples lie outside of both their neighbours, which hardly move."""
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
