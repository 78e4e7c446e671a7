"""The full problem (18)–(19): both coordinates noisy, distances to the curve itself."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stepload.estimators.finish import finish
from stepload.estimators.finite import finite
from stepload.estimators.fit import Doubt, Fit, Flag, FloatArray
from stepload.estimators.points import positive
from stepload.estimators.weighted import ew_tls, require_sigmas

_MAX_STEPS = 50
_MAX_PROJECTIONS = 60
_TOLERANCE = 1e-9


class _Projected(NamedTuple):
    """Points projected to one curve: where they land, signed distances, J of (ln K, n)."""

    landing: FloatArray
    distance: FloatArray
    jacobian: FloatArray


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

    Args: those of `ew_tls`.

    Raises:
        DomainError: unusable data or a standard deviation that is not positive.
    """
    require_sigmas(sigma_m, sigma_n)
    points = positive(deformation_m, force_n, at_least=3)
    start = ew_tls(
        points.deformation_m,
        points.force_n,
        sigma_m=sigma_m,
        sigma_n=sigma_n,
        secant_force_n=secant_force_n,
    )
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
    inverse = np.linalg.inv(now.jacobian.T @ now.jacobian)
    covariance[:2, :2] = change @ inverse @ change.T
    return finish(
        "odr",
        points,
        float(theta[0] - theta[1] * shift[0] + shift[1]),
        float(theta[1]),
        secant_force_n=secant_force_n,
        covariance=covariance,
        doubts=doubts,
    )


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
    distance = (y - curve) / noise * stretch
    pull = -curve / (noise * stretch)
    return _Projected(landing, distance, np.column_stack([pull, pull * np.log(landing)]))
