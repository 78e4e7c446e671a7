"""Straight-line fits of ln F = ln K + n ln δ (20) with the zero of δ taken as given.

All of them come from the same five weighted moments. These are taken about the mean, where
squaring costs nothing: the result equals the singular value decomposition of the whole data matrix
to 1e-12, while an uncentred Gram matrix would square a condition of 3e6 to 8e7.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stepload.errors import DomainError
from stepload.identify.finish import finish
from stepload.identify.fit import Doubt, Fit, Flag, FloatArray
from stepload.identify.gram import gram
from stepload.identify.points import Points, positive

CLOSE_SINGULAR_VALUES = 0.3
"""Above this ratio of the two smallest singular values a direction is not determined."""
_BLOCK = 16384
_START_POINTS = 1000


class LogMoments(NamedTuple):
    """Weighted moments of x = ln δ and y = ln F about their means; `srr` of y about the line."""

    weight: float
    mean_x: float
    mean_y: float
    sxx: float
    sxy: float
    srr: float

    def triangle(self) -> FloatArray:
        """(3, 3) upper triangle R of the QR decomposition of the rows √w·[1, x, y]."""
        root_w, root_x = math.sqrt(self.weight), math.sqrt(self.sxx)
        return np.array(
            [
                [root_w, root_w * self.mean_x, root_w * self.mean_y],
                [0.0, root_x, self.sxy / root_x],
                [0.0, 0.0, math.sqrt(self.srr)],
            ]
        )


def log_ls(deformation_m: ArrayLike, force_n: ArrayLike, *, secant_force_n: float = 300.0) -> Fit:
    """Least squares of ln F on ln δ: all error is taken to be in ln F.

    Args:
        deformation_m: (L,) deformations in m, zero known.
        force_n: (L,) forces in N.
        secant_force_n: where the secant (28) is taken, in N.

    Raises:
        DomainError: unusable data, see `stepload.identify.points`.
    """
    points = positive(deformation_m, force_n, at_least=3)
    moments = log_moments(points, row_scaled=False)
    n = moments.sxy / moments.sxx
    log_k = moments.mean_y - n * moments.mean_x
    variance = moments.srr / (points.force_n.size - 2)
    covariance = np.zeros((3, 3))
    covariance[1, 1] = variance / moments.sxx
    covariance[0, 1] = covariance[1, 0] = -moments.mean_x * covariance[1, 1]
    covariance[0, 0] = variance / moments.weight + moments.mean_x**2 * covariance[1, 1]
    return finish("log_ls", points, log_k, n, secant_force_n=secant_force_n, covariance=covariance)


def log_tls(deformation_m: ArrayLike, force_n: ArrayLike, *, secant_force_n: float = 300.0) -> Fit:
    """Three-column total least squares of [1, ln δ, ln F], every row of equal weight.

    Minimises Σ (ln F - l - n ln δ)²/(1 + l² + n²). Depends on the units, as `rs_btls` does.

    Raises:
        DomainError: unusable data, see `stepload.identify.points`.
    """
    points = positive(deformation_m, force_n, at_least=3)
    return _three_column("log_tls", points, log_moments(points, row_scaled=False), secant_force_n)


def rs_btls(deformation_m: ArrayLike, force_n: ArrayLike, *, secant_force_n: float = 300.0) -> Fit:
    """Row-scaled batch total least squares (25): the paper's estimator.

    Minimises Σ δ² (ln F - l - n ln δ)²/(1 + l² + n²): the smallest right singular vector of the
    rows δ·[1, ln δ, ln F], the ones column counted as noisy. As printed it depends on the units:
    it is the paper's number in SI only. Use `mixed_ls_tls` where that matters.

    Args:
        deformation_m: (L,) deformations in m, zero known.
        force_n: (L,) forces in N, about uniform over their range (`uniform_in_force`).
        secant_force_n: where the secant (28) is taken, in N.

    Raises:
        DomainError: unusable data, see `stepload.identify.points`.

    Example:
        >>> import numpy as np
        >>> deformation_m = np.linspace(5e-6, 60e-6, 50)
        >>> fit = rs_btls(deformation_m, 6.57e8 * deformation_m**1.5)
        >>> round(fit.n, 6)
        1.5
    """
    points = positive(deformation_m, force_n, at_least=3)
    return _three_column("rs_btls", points, log_moments(points, row_scaled=True), secant_force_n)


def mixed_ls_tls(
    deformation_m: ArrayLike, force_n: ArrayLike, *, secant_force_n: float = 300.0
) -> Fit:
    """Row-scaled mixed least squares–total least squares: the ones column is exact.

    Minimises Σ δ² (ln F - l - n ln δ)²/(1 + n²), which no choice of units changes.

    Raises:
        DomainError: unusable data, see `stepload.identify.points`.
    """
    points = positive(deformation_m, force_n, at_least=3)
    moments = log_moments(points, row_scaled=True)
    _, values, rows = np.linalg.svd(moments.triangle()[1:, 1:])
    n = _ratio(-float(rows[1, 0]), float(rows[1, 1]))
    log_k = moments.mean_y - n * moments.mean_x
    return finish(
        "mixed_ls_tls",
        points,
        log_k,
        n,
        secant_force_n=secant_force_n,
        doubts=ill_conditioned(float(values[1]), float(values[0])),
    )


def log_moments(points: Points, *, row_scaled: bool) -> LogMoments:
    """Moments of ln δ and ln F, weighted with δ² or 1, in one pass about the mean of a few.

    Raises:
        DomainError: all deformations are equal.
    """
    stride = max(1, points.force_n.size // _START_POINTS)
    few = Points(points.deformation_m[::stride], points.force_n[::stride], ())
    rough = _moments_about(few, 0.0, 0.0, row_scaled)
    return _moments_about(points, rough.mean_x, rough.mean_y, row_scaled)


def _moments_about(
    points: Points, centre_x: float, centre_y: float, row_scaled: bool
) -> LogMoments:
    size = points.force_n.size
    total = np.zeros((3, 3))
    buffers = np.ones((3, min(_BLOCK, size)))
    for start in range(0, size, _BLOCK):
        deformation = points.deformation_m[start : start + _BLOCK]
        ones, x, y = buffers[:, : deformation.size]
        np.log(deformation, out=x)
        np.log(points.force_n[start : start + _BLOCK], out=y)
        x -= centre_x
        y -= centre_y
        if row_scaled:
            x *= deformation
            y *= deformation
        total += gram([deformation if row_scaled else ones, x, y])
    weight = float(total[0, 0])
    off_x, off_y = float(total[0, 1]) / weight, float(total[0, 2]) / weight
    mean_x, mean_y = centre_x + off_x, centre_y + off_y
    sxx = float(total[1, 1]) - weight * off_x**2
    if not sxx > 1e-24 * weight * max(1.0, mean_x**2):
        raise DomainError(
            f"all {size} deformations are equal ({points.deformation_m[0]:g} m): "
            "an exponent needs a range of loads"
        )
    sxy = float(total[1, 2]) - weight * off_x * off_y
    syy = float(total[2, 2]) - weight * off_y**2
    return LogMoments(weight, mean_x, mean_y, sxx, sxy, max(syy - sxy**2 / sxx, 0.0))


def smallest_direction(triangle: FloatArray) -> tuple[float, float, tuple[Doubt, ...]]:
    """(l, n) of the smallest right singular vector of (3, 3) R, and the doubt about it."""
    _, values, rows = np.linalg.svd(triangle)
    one, x, y = (float(part) for part in rows[2])
    return _ratio(-one, y), _ratio(-x, y), ill_conditioned(float(values[2]), float(values[1]))


def ill_conditioned(smallest: float, next_smallest: float) -> tuple[Doubt, ...]:
    """A doubt where two singular values are too close to tell their directions apart."""
    if smallest <= CLOSE_SINGULAR_VALUES * next_smallest:
        return ()
    message = (
        f"the two smallest singular values are {smallest:.3g} and {next_smallest:.3g}: "
        "noise is as large as the signal"
    )
    return (Doubt(Flag.ILL_CONDITIONED, message),)


def _three_column(
    estimator: str, points: Points, moments: LogMoments, secant_force_n: float
) -> Fit:
    log_k, n, doubts = smallest_direction(moments.triangle())
    return finish(estimator, points, log_k, n, secant_force_n=secant_force_n, doubts=doubts)


def _ratio(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator else math.nan
