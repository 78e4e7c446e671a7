"""Correlation length in force of a rig's smooth error, from the misfits of K_s runs.

The misfit of each run is modelled as a smooth error with the correlation of `estimators.smooth`
plus white noise and a free straight line (it is K_s): the likelihood of the misfits, with what the
line absorbs counted (REML), over lengths and shares of noise. Few correlation lengths lie in one
run, so the data often do not determine it; then none is given.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.estimators.smooth import CHI2_95, smooth_correlation

WIDEST = 4.0
"""Largest factor of the interval at which a length still counts as determined."""
SHAPE = 1.5
"""Least factor of the interval either way: no error has exactly the correlation assumed here, and
without noise that shape alone would determine its length to a few per cent."""
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
    """Estimate the correlation length from the misfits of K_s runs.

    Args:
        misfits: for each run the forces (N,) in N and the misfit (N,) in m there; any straight line
            in it is free.
        runs: number of independent runs that they count as; None: all.

    Returns:
        None where it is not determined: every length, or noise alone, explains them as well, or the
            interval is wider than a factor of `WIDEST` or reaches lengths that cannot be
            distinguished from a straight line or from noise.
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
    """Means over at most `_POINTS` steps of force: the cost of the likelihood is cubic in them."""
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
