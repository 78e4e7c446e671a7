"""Straight-line fits of ln F = ln K + n ln δ (20) with the zero of δ taken as given.

All of them come from the same five weighted moments. These are taken about the mean, where
squaring costs nothing: the result equals the singular value decomposition of the whole data matrix
to 1e-12, while an uncentred Gram matrix would square a condition of 3e6 to 8e7.

The data are read once: the moments also show whether every point had a logarithm, and the force
residual is computed from the logarithms on demand.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stepload.errors import DomainError
from stepload.estimators.finish import finish
from stepload.estimators.finite import finite
from stepload.estimators.fit import Doubt, Fit, Flag, FloatArray, Later
from stepload.estimators.points import FEW_POINTS, Points, paired, positive

CLOSE_SINGULAR_VALUES = 0.3
"""Above this ratio of the two smallest singular values a direction is not determined."""
_BLOCK = 1 << 16
_CENTRE_POINTS = 9


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


class LogData(NamedTuple):
    """Usable points, their logarithms (L,) and the moments of these."""

    points: Points
    log_deformation: FloatArray
    log_force: FloatArray
    moments: LogMoments


def log_ls(deformation_m: ArrayLike, force_n: ArrayLike, *, secant_force_n: float = 300.0) -> Fit:
    """Least squares of ln F on ln δ: all error is taken to be in ln F.

    Args:
        deformation_m: (L,) deformations in m, zero known.
        force_n: (L,) forces in N.
        secant_force_n: where the secant (28) is taken, in N.

    Raises:
        DomainError: unusable data, see `stepload.estimators.points`.
    """
    data = log_data(deformation_m, force_n, row_scaled=False)
    moments = data.moments
    n = moments.sxy / moments.sxx
    log_k = moments.mean_y - n * moments.mean_x
    variance = moments.srr / (data.points.force_n.size - 2)
    covariance = np.zeros((3, 3))
    covariance[1, 1] = variance / moments.sxx
    covariance[0, 1] = covariance[1, 0] = -moments.mean_x * covariance[1, 1]
    covariance[0, 0] = variance / moments.weight + moments.mean_x**2 * covariance[1, 1]
    return _finish("log_ls", data, log_k, n, secant_force_n, covariance=covariance)


def log_tls(deformation_m: ArrayLike, force_n: ArrayLike, *, secant_force_n: float = 300.0) -> Fit:
    """Three-column total least squares of [1, ln δ, ln F], every row of equal weight.

    Minimises Σ (ln F - l - n ln δ)²/(1 + l² + n²). Depends on the units, as `rs_btls` does.

    Raises:
        DomainError: unusable data, see `stepload.estimators.points`.
    """
    data = log_data(deformation_m, force_n, row_scaled=False)
    return _three_column("log_tls", data, secant_force_n)


def rs_btls(deformation_m: ArrayLike, force_n: ArrayLike, *, secant_force_n: float = 300.0) -> Fit:
    """Row-scaled batch total least squares (25): the paper's estimator.

    Minimises Σ δ² (ln F - l - n ln δ)²/(1 + l² + n²): the smallest right singular vector of the
    rows δ·[1, ln δ, ln F], the ones column counted as noisy. As printed it depends on the units:
    it is the paper's number in SI only. Use `mixed_ls_tls` where that matters.

    Args: those of `log_ls`; the forces about uniform over their range (`uniform_in_force`).

    Raises:
        DomainError: unusable data, see `stepload.estimators.points`.

    Example:
        >>> import numpy as np
        >>> deformation_m = np.linspace(5e-6, 60e-6, 50)
        >>> fit = rs_btls(deformation_m, 6.57e8 * deformation_m**1.5)
        >>> round(fit.n, 6)
        1.5
    """
    data = log_data(deformation_m, force_n, row_scaled=True)
    return _three_column("rs_btls", data, secant_force_n)


def mixed_ls_tls(
    deformation_m: ArrayLike, force_n: ArrayLike, *, secant_force_n: float = 300.0
) -> Fit:
    """Row-scaled mixed least squares–total least squares: the ones column is exact.

    Minimises Σ δ² (ln F - l - n ln δ)²/(1 + n²), which no choice of units changes.

    Raises:
        DomainError: unusable data, see `stepload.estimators.points`.
    """
    data = log_data(deformation_m, force_n, row_scaled=True)
    _, values, rows = np.linalg.svd(finite(data.moments.triangle()[1:, 1:]))
    n = _ratio(-float(rows[1, 0]), float(rows[1, 1]))
    log_k = data.moments.mean_y - n * data.moments.mean_x
    doubts = ill_conditioned(float(values[1]), float(values[0]))
    return _finish("mixed_ls_tls", data, log_k, n, secant_force_n, doubts=doubts)


def log_data(deformation_m: ArrayLike, force_n: ArrayLike, *, row_scaled: bool) -> LogData:
    """The usable points with their logarithms and moments, weighted with δ² or 1.

    A point without logarithms makes a sum that is not finite: only then are points searched and
    left out, and the sums taken again.

    Raises:
        DomainError: unusable data, see `stepload.estimators.points`; all deformations are equal.
    """
    points = Points(*paired(deformation_m, force_n), ())
    if points.force_n.size >= FEW_POINTS:
        with np.errstate(all="ignore"):
            sums = _summed(points, row_scaled)
            usable = math.isfinite(float(sums.total.sum()))
        if usable:
            return LogData(points, sums.log_x, sums.log_y, _centred(points, sums))
    points = positive(deformation_m, force_n, at_least=3)
    sums = _summed(points, row_scaled)
    return LogData(points, sums.log_x, sums.log_y, _centred(points, sums))


class _Sums(NamedTuple):
    """x and y (L,), and the sums of products (3, 3) of √w·[1, x − centre_x, y − centre_y]."""

    log_x: FloatArray
    log_y: FloatArray
    total: FloatArray
    centre_x: float
    centre_y: float


def _summed(points: Points, row_scaled: bool) -> _Sums:
    """Logarithms and their sums, about those of two middling values."""
    centre_x, centre_y = _middling_log(points.deformation_m), _middling_log(points.force_n)
    size = points.force_n.size
    total = np.zeros((3, 3))
    logarithms = np.empty(size), np.empty(size)
    buffers = np.empty((2, min(_BLOCK, size)))
    for start in range(0, size, _BLOCK):
        deformation = points.deformation_m[start : start + _BLOCK]
        x, y = buffers[:, : deformation.size]
        log_x, log_y = (part[start : start + _BLOCK] for part in logarithms)
        np.log(deformation, out=log_x)
        np.log(points.force_n[start : start + _BLOCK], out=log_y)
        np.subtract(log_x, centre_x, out=x)
        np.subtract(log_y, centre_y, out=y)
        if row_scaled:
            x *= deformation
            y *= deformation
        total += _gram([deformation if row_scaled else np.ones(x.size), x, y])
    return _Sums(*logarithms, total, centre_x, centre_y)


def _gram(rows: Sequence[FloatArray] | FloatArray) -> FloatArray:
    """The (m, m) dot products of m rows of L numbers.

    For m of 3 or 4 one by one takes a third of the time of `rows @ rows.T`.
    """
    size = len(rows)
    product = np.empty((size, size))
    for i, row in enumerate(rows):
        for j in range(i, size):
            product[i, j] = product[j, i] = row @ rows[j]
    return product


def _middling_log(values: FloatArray) -> float:
    """ln of the median of a few; 0 where it has none."""
    middle = sorted(values[:: -(-values.size // _CENTRE_POINTS)].tolist())
    value: float = middle[len(middle) // 2]
    return math.log(value) if 0.0 < value < math.inf else 0.0


def _centred(points: Points, sums: _Sums) -> LogMoments:
    total = sums.total
    weight = float(total[0, 0])
    off_x, off_y = float(total[0, 1]) / weight, float(total[0, 2]) / weight
    mean_x, mean_y = sums.centre_x + off_x, sums.centre_y + off_y
    sxx = float(total[1, 1]) - weight * off_x**2
    if not sxx > 1e-24 * weight * max(1.0, mean_x**2):
        raise DomainError(
            f"all {points.force_n.size} deformations are equal ({points.deformation_m[0]:g} m): "
            "an exponent needs a range of loads"
        )
    sxy = float(total[1, 2]) - weight * off_x * off_y
    syy = float(total[2, 2]) - weight * off_y**2
    return LogMoments(weight, mean_x, mean_y, sxx, sxy, max(syy - sxy**2 / sxx, 0.0))


def smallest_direction(triangle: FloatArray) -> tuple[float, float, tuple[Doubt, ...]]:
    """(l, n) of the smallest right singular vector of (3, 3) R, and the doubt about it."""
    _, values, rows = np.linalg.svd(finite(triangle))
    one, x, y = (float(part) for part in rows[2])
    return _ratio(-one, y), _ratio(-x, y), ill_conditioned(float(values[2]), float(values[1]))


def ill_conditioned(smallest: float, next_smallest: float) -> tuple[Doubt, ...]:
    """A doubt where two singular values are too close to distinguish their directions."""
    if smallest <= CLOSE_SINGULAR_VALUES * next_smallest:
        return ()
    message = (
        f"the two smallest singular values are {smallest:.3g} and {next_smallest:.3g}: "
        "noise is as large as the signal"
    )
    return (Doubt(Flag.ILL_CONDITIONED, message),)


def _three_column(estimator: str, data: LogData, secant_force_n: float) -> Fit:
    log_k, n, doubts = smallest_direction(data.moments.triangle())
    return _finish(estimator, data, log_k, n, secant_force_n, doubts=doubts)


def _finish(
    estimator: str,
    data: LogData,
    log_k: float,
    n: float,
    secant_force_n: float,
    *,
    covariance: FloatArray | None = None,
    doubts: tuple[Doubt, ...] = (),
) -> Fit:
    return finish(
        estimator,
        data.points,
        log_k,
        n,
        secant_force_n=secant_force_n,
        covariance=covariance,
        doubts=doubts,
        force_rms=Later(partial(_force_rms_n, data.log_deformation, data.log_force, log_k, n)),
    )


def _force_rms_n(
    log_deformation: FloatArray, log_force: FloatArray, log_k: float, n: float
) -> float:
    """rms of F - K δ^n in N."""
    if not (math.isfinite(log_k) and math.isfinite(n)):
        return math.nan
    with np.errstate(over="ignore"):
        residual = np.exp(log_force) - np.exp(n * log_deformation + log_k)
    return math.sqrt(float(residual @ residual) / residual.size)


def _ratio(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator else math.nan
