"""From the numbers of an estimator to its `Fit`."""

from __future__ import annotations

import math

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.fit import Doubt, Fit, Flag, FloatArray, Later
from stepload.estimators.points import Points

PLAUSIBLE_EXPONENTS = 0.5, 5.0
"""Theory has n > 1 (5) and 1.5 to 2 for round and pointed bodies; the margin is for noise."""


def finish(
    estimator: str,
    points: Points,
    log_k: float,
    n: float,
    *,
    secant_force_n: float,
    zero_m: float = 0.0,
    covariance: FloatArray | None = None,
    doubts: tuple[Doubt, ...] = (),
    force_rms: Later | None = None,
) -> Fit:
    """The `Fit` of F = exp(`log_k`) (δ - `zero_m`)^n with its rms force residual.

    `force_rms` is that residual where the estimator knows how to find it cheaper. An exponent that
    is no contact law or a K beyond floating point is flagged ILL_CONDITIONED, not raised: a table
    of all estimators must stay complete.
    """
    secant = log_secant(log_k, n, secant_force_n)
    return Fit(
        estimator=estimator,
        k=_exp(log_k),
        n=n,
        zero_m=zero_m,
        secant_n_per_m=_exp(secant),
        secant_force_n=secant_force_n,
        covariance=covariance,
        force_rms=(
            force_rms_n(points.deformation_m, points.force_n, log_k, n, zero_m)
            if force_rms is None
            else force_rms
        ),
        points=points.force_n.size,
        doubts=points.doubts + doubts + unlawful(log_k, n),
    )


def log_secant(log_k: float, n: float, force_n: float) -> float:
    """ln of the secant stiffness (28) from ln K; NaN for n = 0.

    Raises:
        DomainError: `force_n` is not finite and positive.
    """
    if not 0.0 < force_n < math.inf:
        raise DomainError(f"secant force is {force_n:g} N; it must be finite and greater than 0 N")
    return ((n - 1.0) * math.log(force_n) + log_k) / n if n else math.nan


def unlawful(log_k: float, n: float) -> tuple[Doubt, ...]:
    """A doubt where n and ln K are no contact law."""
    low, high = PLAUSIBLE_EXPONENTS
    if low <= n <= high and abs(log_k) < 700.0:
        return ()
    message = f"n = {n:.3g} is no contact law; an exponent lies between {low:g} and {high:g}"
    return (Doubt(Flag.ILL_CONDITIONED, message),)


def force_rms_n(
    deformation_m: FloatArray, force_n: FloatArray, log_k: float, n: float, zero_m: float
) -> float:
    """rms of F - K (δ - δ0)^n in N; the law gives 0 N where δ ≤ δ0."""
    if not (math.isfinite(log_k) and math.isfinite(n)):
        return math.nan
    with np.errstate(divide="ignore", over="ignore"):
        law = np.maximum(deformation_m - zero_m, 0.0)
        np.log(law, out=law)
        law *= n
        law += log_k
        np.exp(law, out=law)
        law -= force_n
    return math.sqrt(float(law @ law) / force_n.size)


def _exp(value: float) -> float:
    return math.exp(value) if value < 709.0 else math.inf if value >= 709.0 else math.nan
