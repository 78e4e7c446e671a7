"""A smooth curve through points that rise, which rises everywhere between them (PCHIP).

Slopes of F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300; the same numbers as
of `scipy.interpolate.PchipInterpolator`, whose import takes longer than a short run.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stepload.estimators.fit import FloatArray


def rising_curve(x: FloatArray, y: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """The curve through (M,) points, M at least 2, `x` and `y` both rising.

    Beyond the points its first and last piece go on.
    """
    width = np.diff(x)
    secant = np.diff(y) / width
    slope = _slopes(width, secant)
    bend = (slope[:-1] + slope[1:] - 2.0 * secant) / width
    cubic, square = bend / width, (secant - slope[:-1]) / width - bend

    def curve(at: FloatArray) -> FloatArray:
        piece = np.searchsorted(x[1:-1], at, side="right")
        s = at - x[piece]
        return np.asarray(
            y[piece] + slope[piece] * s + square[piece] * (s * s) + cubic[piece] * (s * s * s)
        )

    return curve


def _slopes(width: FloatArray, secant: FloatArray) -> FloatArray:
    """Slopes at the points: weighted harmonic means of the neighbouring secants."""
    if len(secant) == 1:
        return np.repeat(secant, 2)
    before, after = 2.0 * width[1:] + width[:-1], width[1:] + 2.0 * width[:-1]
    mean = (before / secant[:-1] + after / secant[1:]) / (before + after)
    first = _slope_at_end(width[0], width[1], secant[0], secant[1])
    last = _slope_at_end(width[-1], width[-2], secant[-1], secant[-2])
    return np.concatenate([[first], 1.0 / mean, [last]])


def _slope_at_end(width: float, next_width: float, secant: float, next_secant: float) -> float:
    """Of the parabola through the last three points, where it rises at the end; else none."""
    slope = ((2.0 * width + next_width) * secant - width * next_secant) / (width + next_width)
    return max(slope, 0.0)
