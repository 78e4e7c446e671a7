"""Both coordinates noisy: weighted total least squares in logarithms (24), and distances to the
curve itself (18)–(19)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stepload.errors import DomainError
from stepload.identification.fit import Doubt, Fit, Flag, FloatArray, finish, finite, usable
from stepload.identification.ls import log_data

_MAX_STEPS = 50
_MAX_PROJECTIONS = 60
_TOLERANCE = 1e-9


def ew_tls(
    deformation_m: ArrayLike,
    force_n: ArrayLike,
    *,
    sigma_m: float,
    sigma_n: float,
    secant_force_n: float = 300.0,
) -> Fit:
    """min Σ (y - l - n x)²/(vy + n² vx), x = ln δ, y = ln F, vx = (σδ/δ)², vy = (σF/F)² (24).

    The logarithm of a noisy point near zero is biased; the weights take such points nearly out.
    Does not depend on the units.

    Args:
        deformation_m, force_n: (L,) with a known zero.
        sigma_m, sigma_n: standard deviations of both.
        secant_force_n: where the secant (28) is taken.

    Raises:
        DomainError: unusable data or a standard deviation that is not positive.
    """
    from scipy.optimize import brentq

    _require(sigma_m, sigma_n)
    data = log_data(deformation_m, force_n, row_scaled=True)
    points, x, y = data.points, data.x, data.y
    vx, vy = (sigma_m / points.deformation_m) ** 2, (sigma_n / points.force_n) ** 2

    def profile(n: float) -> tuple[float, float, FloatArray]:
        """The best l, the slope of the profiled cost in n, and JᵀJ of (l, n)."""
        weights = 1.0 / (vy + n * n * vx)
        total = float(weights.sum())
        rest = y - n * x
        log_k = float(weights @ rest) / total
        weighted = weights * (rest - log_k)
        slope = -2.0 * float(weighted @ x) - 2.0 * n * float(vx @ (weighted * weighted))
        # x of the true point: its share of the residual subtracted (an errors-in-both model).
        true_x = x + n * vx * weighted
        cross = float(weights @ true_x)
        return log_k, slope, np.array([[total, cross], [cross, float(weights @ true_x**2)]])

    # Two positive exponents between which the cost has its minimum next to the start.
    n = start = data.sxy / data.sxx
    downhill = 1.0 / 1.1 if start > 0.0 and profile(start)[1] > 0.0 else 1.1
    while 0.01 < n < 100.0 and (profile(n * downhill)[1] > 0.0) != (downhill > 1.0):
        n *= downhill
    covariance: FloatArray | None = None
    doubts: tuple[Doubt, ...] = ()
    if 0.01 < n < 100.0:
        low, high = sorted((n, n * downhill))
        n = float(brentq(lambda at: profile(at)[1], low, high, xtol=1e-13))
        covariance = np.zeros((3, 3))
        covariance[:2, :2] = np.linalg.inv(profile(n)[2])
    else:
        n, doubts = start, (Doubt(Flag.NOT_CONVERGED, f"no minimum of (24) about n = {start:.3g}"),)
    return finish(
        "ew_tls", points, profile(n)[0], n, secant_force_n=secant_force_n, covariance=covariance,
        doubts=doubts,
    )  # fmt: skip


def _require(sigma_m: float, sigma_n: float) -> None:
    for value, what, unit in ((sigma_m, "deformation", "m"), (sigma_n, "force", "N")):
        if not 0.0 < value < math.inf:
            raise DomainError(
                f"sigma of the {what} is {value:g} {unit}; it must be finite and above 0 {unit}",
                hint="a resolution q counts as a standard deviation of q/sqrt(12)",
            )


def odr(
    deformation_m: ArrayLike,
    force_n: ArrayLike,
    *,
    sigma_m: float,
    sigma_n: float,
    secant_force_n: float = 300.0,
) -> Fit:
    """min Σ (δ - δ̂)²/σδ² + (F - F̂)²/σF² subject to F̂ = K δ̂^n (18)–(19).

    The most accurate estimator where the zero of δ is known. Gauss–Newton on the distances to the
    curve; the landing points δ̂ are found by Newton's method for all points at once.

    Args: those of `ew_tls`, which gives the start.

    Raises:
        DomainError: unusable data or a standard deviation that is not positive.
    """
    _require(sigma_m, sigma_n)
    points = usable(deformation_m, force_n, at_least=3, known_zero=True)
    start = ew_tls(points.deformation_m, points.force_n, sigma_m=sigma_m, sigma_n=sigma_n,
                   secant_force_n=secant_force_n)  # fmt: skip
    # In units of σδ and of the highest force all numbers are moderate.
    x, top = points.deformation_m / sigma_m, float(points.force_n.max())
    y, noise = points.force_n / top, sigma_n / top
    shift = math.log(sigma_m), math.log(top)
    theta = np.array([math.log(start.k) + start.n * shift[0] - shift[1], start.n])
    now = _project(theta, x, y, noise, x)
    cost = float(now.distance @ now.distance)
    doubts: tuple[Doubt, ...] = ()
    for _ in range(_MAX_STEPS):
        step = np.linalg.lstsq(finite(now.jacobian), -finite(now.distance), rcond=None)[0]
        size = float(np.abs(step).max())
        for halvings in range(30):
            trial = theta + step * 0.5**halvings
            there = _project(trial, x, y, noise, now.landing)
            trial_cost = float(there.distance @ there.distance)
            if size < 1e-6 or trial_cost <= cost:
                break
        theta, now, cost = trial, there, trial_cost
        if size < _TOLERANCE:
            break
    else:
        doubts = (Doubt(Flag.NOT_CONVERGED, f"no convergence in {_MAX_STEPS} steps"),)
    covariance = np.zeros((3, 3))
    change = np.array([[1.0, -shift[0]], [0.0, 1.0]])
    covariance[:2, :2] = change @ np.linalg.inv(now.jacobian.T @ now.jacobian) @ change.T
    log_k, n = float(theta[0] - theta[1] * shift[0] + shift[1]), float(theta[1])
    return finish("odr", points, log_k, n, secant_force_n=secant_force_n, covariance=covariance,
                  doubts=doubts)  # fmt: skip


class _Projected(NamedTuple):
    """Points projected to one curve: where they land, signed distances, J of (ln K, n)."""

    landing: FloatArray
    distance: FloatArray
    jacobian: FloatArray


def _project(
    theta: FloatArray, x: FloatArray, y: FloatArray, noise: float, start: FloatArray
) -> _Projected:
    """Nearest points of y = exp(l) x^n, with x in units of its σ and `noise` that of y."""
    log_k, n = float(theta[0]), float(theta[1])
    landing = start.copy()
    for _ in range(_MAX_PROJECTIONS):
        curve = np.exp(log_k + n * np.log(landing))
        slope = n * curve / landing
        off = (y - curve) / noise**2
        gradient = (landing - x) - off * slope
        bend = off * slope * (n - 1.0) / landing
        steep = 1.0 + slope**2 / noise**2
        curvature = np.where(steep > 2.0 * bend, steep - bend, steep)
        step = np.maximum(-gradient / curvature, -0.5 * landing)
        landing += step
        if float(np.abs(step / landing).max()) < 1e-12:
            break
    curve = np.exp(log_k + n * np.log(landing))
    slope = n * curve / landing
    stretch = np.sqrt(1.0 + (slope / noise) ** 2)
    pull = -curve / (noise * stretch)
    distance = (y - curve) / noise * stretch
    return _Projected(landing, distance, np.column_stack([pull, pull * np.log(landing)]))
