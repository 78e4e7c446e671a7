"""How much an estimate moves when a data point does: the first half of error propagation.

A sensitivity is (3, N): the derivatives of (ln K, n, δ0) with respect to the deformation of each
point. An error of force at a point acts like an error of deformation of opposite sign, as large as
the law is compliant there, so one matrix serves for every source of error.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.finite import finite
from stepload.estimators.fit import Fit, FloatArray

Estimator = Callable[[FloatArray, FloatArray], Fit]
"""(deformation (N,) in m, force (N,) in N) → Fit."""

_GROUPS = 60


def law_compliance(fit: Fit, force_n: FloatArray) -> FloatArray:
    """dδ/dF of the fitted law (N,) in m/N at forces > 0."""
    return np.asarray((force_n / fit.k) ** (1.0 / fit.n) / (fit.n * force_n))


def joint_sensitivity(fit: Fit, force_n: FloatArray) -> FloatArray:
    """Sensitivity (3, N) of least squares on δ = δ0 + (F/K)^(1/n).

    Raises:
        DomainError: forces not positive, or data that cannot tell the parameters apart.
    """
    if force_n.size < 4 or not np.all(force_n > 0):
        raise DomainError("at least 4 points with positive force are needed for a sensitivity")
    log_k = np.log(fit.k)
    shape = np.exp((np.log(force_n) - log_k) / fit.n)
    jacobian = np.stack(
        [
            -shape / fit.n,
            -shape * (np.log(force_n) - log_k) / fit.n**2,
            np.ones_like(force_n),
        ],
        axis=1,
    )
    scale = np.linalg.norm(jacobian, axis=0)
    if np.linalg.cond(finite(jacobian / scale)) > 1e10:
        raise DomainError(
            "the data cannot tell K, n and the zero apart",
            hint="press over a wider range of force",
        )
    return np.asarray(np.linalg.pinv(jacobian / scale) / scale[:, None])


def zero_given_sensitivity(
    fit: Fit,
    deformation_m: FloatArray,
    force_n: FloatArray,
    sigmas: tuple[float, float] | None = None,
) -> FloatArray:
    """Sensitivity (3, N) of least squares about F = K δ^n, to first order in the residuals.

    With `sigmas` of deformation and force the residuals are distances to the curve (18), otherwise
    deformations.

    Raises:
        DomainError: data that cannot tell K and n apart.
    """
    compliance = law_compliance(fit, force_n)
    log_deformation = (np.log(force_n) - np.log(fit.k)) / fit.n
    jacobian = -force_n * compliance * np.stack([np.ones_like(force_n), log_deformation])
    weight = np.ones_like(force_n)
    if sigmas is not None:
        sigma_m, sigma_n = sigmas
        weight = 1.0 / (sigma_m**2 + (sigma_n * compliance) ** 2)
    normal = (jacobian * weight) @ jacobian.T
    scale = np.sqrt(np.diag(normal))
    if not np.linalg.cond(finite(normal / np.outer(scale, scale))) < 1e14:
        raise DomainError(
            "the data cannot tell K and n apart", hint="press over a wider range of force"
        )
    result = np.zeros((3, force_n.size))
    result[:2] = np.linalg.solve(normal, jacobian * weight)
    return result


def numeric_sensitivity(
    estimate: Estimator, deformation_m: FloatArray, force_n: FloatArray, *, step_m: float
) -> FloatArray:
    """Sensitivity (3, N) of any estimator by central differences.

    Neighbours in force are moved together, in at most 60 groups of one size, each of which shares
    its effect among its points: 120 calls of `estimate`, whatever N.

    Args:
        estimate: the estimator, everything but the data bound.
        deformation_m, force_n: (N,) data.
        step_m: shift of a group; small against the deformations, large against rounding.
    """
    order = np.argsort(force_n, kind="stable")
    result = np.zeros((3, force_n.size))
    for group in np.array_split(order, min(_GROUPS, force_n.size)):
        moved = deformation_m.copy()
        moved[group] += step_m
        above = estimate(moved, force_n)
        moved[group] -= 2.0 * step_m
        below = estimate(moved, force_n)
        change = np.array(
            [np.log(above.k / below.k), above.n - below.n, above.zero_m - below.zero_m]
        )
        result[:, group] = (change / (2.0 * step_m * group.size))[:, None]
    return result
