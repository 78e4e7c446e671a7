"""Element-wise weighted total least squares in logarithms (24): every point with its own noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stepload.errors import DomainError
from stepload.estimators.finish import finish
from stepload.estimators.fit import Doubt, Fit, Flag, FloatArray
from stepload.estimators.ls import log_data


class _Profile(NamedTuple):
    """At one n: the best l, the slope of the profiled cost in n, and JᵀJ of (l, n)."""

    log_k: float
    slope: float
    normal: FloatArray


def ew_tls(
    deformation_m: ArrayLike,
    force_n: ArrayLike,
    *,
    sigma_m: float,
    sigma_n: float,
    secant_force_n: float = 300.0,
) -> Fit:
    """min Σ (y - l - n x)²/(vy + n² vx), x = ln δ, y = ln F, vx = (σδ/δ)², vy = (σF/F)² (24).

    Args:
        deformation_m: (L,) deformations in m, zero known.
        force_n: (L,) forces in N.
        sigma_m: standard deviation of the deformation in m.
        sigma_n: standard deviation of the force in N.
        secant_force_n: where the secant (28) is taken, in N.

    Raises:
        DomainError: unusable data or a standard deviation that is not positive.

    Notes:
        The logarithm of a noisy point near zero is biased; the weights take such points nearly out.
        Does not depend on the units.
    """
    from scipy.optimize import brentq

    require_sigmas(sigma_m, sigma_n)
    points, x, y, moments = log_data(deformation_m, force_n, row_scaled=True)
    vx, vy = (sigma_m / points.deformation_m) ** 2, (sigma_n / points.force_n) ** 2
    start = moments.sxy / moments.sxx
    bracket = _bracket(start, lambda at: _profile(at, x, y, vx, vy).slope)
    if bracket is None:
        doubt = Doubt(Flag.NOT_CONVERGED, f"no minimum of (24) about n = {start:.3g}")
        log_k = _profile(start, x, y, vx, vy).log_k
        return finish(
            "ew_tls", points, log_k, start, secant_force_n=secant_force_n, doubts=(doubt,)
        )
    n = float(brentq(lambda at: _profile(at, x, y, vx, vy).slope, *bracket, xtol=1e-13))
    profile = _profile(n, x, y, vx, vy)
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = np.linalg.inv(profile.normal)
    return finish(
        "ew_tls",
        points,
        profile.log_k,
        n,
        secant_force_n=secant_force_n,
        covariance=covariance,
    )


def require_sigmas(sigma_m: float, sigma_n: float) -> None:
    """Refuse standard deviations of the data that are not finite and positive.

    Raises:
        DomainError: one is not.
    """
    for value, what, unit in ((sigma_m, "deformation", "m"), (sigma_n, "force", "N")):
        if not 0.0 < value < math.inf:
            raise DomainError(
                f"sigma of the {what} is {value:g} {unit}; it must be finite and above 0 {unit}",
                hint="a resolution q counts as a standard deviation of q/sqrt(12)",
            )


def _bracket(start: float, slope: Callable[[float], float]) -> tuple[float, float] | None:
    """Two positive exponents between which the cost has its minimum next to `start`."""
    if not start > 0.0:
        return None
    downhill = 1.0 / 1.1 if slope(start) > 0.0 else 1.1
    here = start
    while 0.01 < here < 100.0:
        there = here * downhill
        if (slope(there) > 0.0) == (downhill > 1.0):
            return min(here, there), max(here, there)
        here = there
    return None


def _profile(n: float, x: FloatArray, y: FloatArray, vx: FloatArray, vy: FloatArray) -> _Profile:
    weights = 1.0 / (vy + n * n * vx)
    total = float(weights.sum())
    rest = y - n * x
    log_k = float(weights @ rest) / total
    rest -= log_k
    weighted = weights * rest
    slope = -2.0 * float(weighted @ x) - 2.0 * n * float(vx @ (weighted * weighted))
    # x of the true point: its share of the residual subtracted (an errors-in-both model).
    true_x = x + n * vx * weighted
    cross = float(weights @ true_x)
    normal = np.array([[total, cross], [cross, float((weights * true_x) @ true_x)]])
    return _Profile(log_k, slope, normal)
