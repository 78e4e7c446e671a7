"""How far in force the smooth error of a rig stays alike, from what K_s runs leave over.

The misfit of each run is taken for a smooth error with the correlation of `identify.smooth` and
white noise beside it, a straight line free (it is K_s): the likelihood of the misfits, with what
the line absorbs counted (REML), over lengths and shares of noise. Few correlation lengths lie in
one run, so the answer is often that the data cannot tell; then it is not made up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.estimators.smooth import smooth_correlation

CHI2_95 = 3.841459
WIDEST = 4.0
"""A length that is known to a wider factor than this counts as not determined."""
SHAPE = 1.5
"""The least factor of an interval either way: no error has just the correlation assumed here, and
without noise that shape alone would tell its length to a few per cent."""
_GRID = 17
_POINTS = 40
_NOISE = (3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Variance of the white noise over that of the smooth error."""


@dataclass(frozen=True, slots=True)
class SmoothLength:
    """The likeliest correlation length in N and its 95 % interval."""

    length_n: float
    low_n: float
    high_n: float


def measure_length(
    misfits: Sequence[tuple[FloatArray, FloatArray]], *, runs: float | None = None
) -> SmoothLength | None:
    """The correlation length that the misfits of K_s runs speak for.

    Args:
        misfits: of each run the forces (N,) in N and what is left (N,) in m there; any straight
            line in it is free.
        runs: for how many independent runs they count; None: all.

    Returns:
        None where they cannot tell: every length, or noise alone, explains them as well, or the
        interval is wider than a factor of `WIDEST` or reaches lengths that could not be told apart
        from a straight line or from noise.
    """
    usable = [_thinned(force, left) for force, left in misfits if force.size > 2 * len(_NOISE)]
    if not usable:
        return None
    span = max(float(np.ptp(force)) for force, _ in usable)
    lengths = np.geomspace(span / 40.0, 2.0 * span, _GRID)
    surface = np.array(
        [
            [sum(_deviance(force, left, length, noise) for force, left in usable)
             for noise in _NOISE]
            for length in lengths
        ]
    )  # fmt: skip
    noise_only = sum(_deviance(force, left, span, None) for force, left in usable)
    share = 1.0 if runs is None else min(1.0, runs / len(usable))
    deviance = surface.min(axis=1) * share
    best = int(np.argmin(deviance))
    inside = np.flatnonzero(deviance <= deviance[best] + CHI2_95)
    low, high = int(inside[0]), int(inside[-1])
    told = noise_only * share > deviance[best] + CHI2_95
    at_end = low == 0 or high == _GRID - 1
    if not told or at_end or lengths[high] > WIDEST * lengths[low]:
        return None
    length = float(lengths[best])
    return SmoothLength(
        length, min(float(lengths[low]), length / SHAPE), max(float(lengths[high]), length * SHAPE)
    )


def _thinned(force_n: FloatArray, left_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means over at most `_POINTS` steps of force: the likelihood costs their cube."""
    width = float(np.ptp(force_n)) / _POINTS
    _, index = np.unique(np.floor(force_n / width) if width else force_n, return_inverse=True)
    count = np.bincount(index)
    return np.bincount(index, force_n) / count, np.bincount(index, left_m) / count


def _deviance(
    force_n: FloatArray, left_m: FloatArray, length_n: float, noise: float | None
) -> float:
    """−2 ln of the restricted likelihood of a misfit, its size profiled out."""
    line = np.stack([np.ones_like(force_n), force_n / force_n.max()], axis=1)
    unit = np.eye(force_n.size)
    shape = unit if noise is None else smooth_correlation(force_n, length_n) + (noise + 1e-8) * unit
    root = np.linalg.cholesky(shape)
    columns, left = np.linalg.solve(root, line), np.linalg.solve(root, left_m)
    q, r = np.linalg.qr(columns)
    rest = left - q @ (q.T @ left)
    degrees = force_n.size - line.shape[1]
    size = max(float(rest @ rest) / degrees, 1e-30)
    log_shape = 2.0 * float(np.log(np.diag(root)).sum())
    log_line = 2.0 * float(np.log(np.abs(np.diag(r))).sum())
    return float(degrees) * math.log(size) + log_shape + log_line
