"""Straight-line fits of ln F = ln K + n ln δ (20) with the zero of δ taken as given.

All of them come from the same five weighted moments about the mean, where squaring costs nothing:
the result equals the singular value decomposition of the whole data matrix to 1e-12, while an
uncentred Gram matrix would square a condition of 3e6 to 8e7.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stepload.errors import DomainError
from stepload.identification.fit import Doubt, Fit, Flag, FloatArray, Points, finish, finite, usable

CLOSE_SINGULAR_VALUES = 0.3
"""Above this ratio of the two smallest singular values a direction is not determined."""


class LogData(NamedTuple):
    """Usable points, their logarithms x = ln δ and y = ln F (L,), and the weighted moments of these
    about their means; `srr` is that of y about the line."""

    points: Points
    x: FloatArray
    y: FloatArray
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


def log_data(deformation_m: ArrayLike, force_n: ArrayLike, *, row_scaled: bool) -> LogData:
    """The usable points with their logarithms and moments, weighted with δ² or 1.

    Raises:
        DomainError: unusable data, see `stepload.identification.fit`; all deformations are equal.
    """
    points = usable(deformation_m, force_n, at_least=3, known_zero=True)
    x, y = np.log(points.deformation_m), np.log(points.force_n)
    w = points.deformation_m**2 if row_scaled else np.ones_like(x)
    weight = float(w.sum())
    mean_x, mean_y = float(w @ x) / weight, float(w @ y) / weight
    off_x, off_y = x - mean_x, y - mean_y
    sxx = float(w @ off_x**2)
    if not sxx > 1e-24 * weight * max(1.0, mean_x**2):
        raise DomainError(
            f"all {x.size} deformations are equal ({points.deformation_m[0]:g} m): "
            "an exponent needs a range of loads"
        )
    sxy = float(w @ (off_x * off_y))
    srr = float(w @ (off_y - sxy / sxx * off_x) ** 2)
    return LogData(points, x, y, weight, mean_x, mean_y, sxx, sxy, srr)


def log_ls(deformation_m: ArrayLike, force_n: ArrayLike, *, secant_force_n: float = 300.0) -> Fit:
    """Least squares of ln F on ln δ: all error is taken to be in ln F.

    Args:
        deformation_m: (L,) deformations in m, zero known.
        force_n: (L,) forces in N.
        secant_force_n: where the secant (28) is taken, in N.

    Raises:
        DomainError: unusable data, see `stepload.identification.fit`.
    """
    data = log_data(deformation_m, force_n, row_scaled=False)
    n = data.sxy / data.sxx
    variance = data.srr / (data.x.size - 2)
    covariance = np.zeros((3, 3))
    covariance[1, 1] = variance / data.sxx
    covariance[0, 1] = covariance[1, 0] = -data.mean_x * covariance[1, 1]
    covariance[0, 0] = variance / data.weight + data.mean_x**2 * covariance[1, 1]
    return finish(
        "log_ls", data.points, data.mean_y - n * data.mean_x, n, secant_force_n=secant_force_n,
        covariance=covariance,
    )  # fmt: skip


def log_tls(deformation_m: ArrayLike, force_n: ArrayLike, *, secant_force_n: float = 300.0) -> Fit:
    """Three-column total least squares of [1, ln δ, ln F], every row of equal weight.

    Minimises Σ (ln F - l - n ln δ)²/(1 + l² + n²). Depends on the units, as `rs_btls` does.
    """
    data = log_data(deformation_m, force_n, row_scaled=False)
    log_k, n, doubts = smallest_direction(data.triangle())
    return finish("log_tls", data.points, log_k, n, secant_force_n=secant_force_n, doubts=doubts)


def rs_btls(deformation_m: ArrayLike, force_n: ArrayLike, *, secant_force_n: float = 300.0) -> Fit:
    """Row-scaled batch total least squares (25): the paper's estimator.

    Minimises Σ δ² (ln F - l - n ln δ)²/(1 + l² + n²): the smallest right singular vector of the
    rows δ·[1, ln δ, ln F], the ones column counted as noisy. As printed it depends on the units:
    it is the paper's number in SI only. Use `mixed_ls_tls` where that matters.

    Args: those of `log_ls`; the forces about uniform over their range (`uniform_in_force`).

    Example:
        >>> import numpy as np
        >>> deformation_m = np.linspace(5e-6, 60e-6, 50)
        >>> fit = rs_btls(deformation_m, 6.57e8 * deformation_m**1.5)
        >>> round(fit.n, 6)
        1.5
    """
    data = log_data(deformation_m, force_n, row_scaled=True)
    log_k, n, doubts = smallest_direction(data.triangle())
    return finish("rs_btls", data.points, log_k, n, secant_force_n=secant_force_n, doubts=doubts)


def mixed_ls_tls(
    deformation_m: ArrayLike, force_n: ArrayLike, *, secant_force_n: float = 300.0
) -> Fit:
    """Row-scaled mixed least squares–total least squares: the ones column is exact.

    Minimises Σ δ² (ln F - l - n ln δ)²/(1 + n²), which no choice of units changes.
    """
    data = log_data(deformation_m, force_n, row_scaled=True)
    _, values, rows = np.linalg.svd(finite(data.triangle()[1:, 1:]))
    n = _ratio(-float(rows[1, 0]), float(rows[1, 1]))
    return finish(
        "mixed_ls_tls", data.points, data.mean_y - n * data.mean_x, n,
        secant_force_n=secant_force_n, doubts=ill_conditioned(float(values[1]), float(values[0])),
    )  # fmt: skip


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


def _ratio(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator else math.nan
