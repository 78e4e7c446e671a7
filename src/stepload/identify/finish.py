"""From the numbers of an estimator to its `Fit`."""

from __future__ import annotations

import math

import numpy as np

from stepload.errors import DomainError
from stepload.identify.fit import Doubt, Fit, Flag, FloatArray
from stepload.identify.points import Points

PLAUSIBLE_EXPONENTS = 0.5, 5.0
"""Theory has n > 1 (5) and 1.5 to 2 for round and pointed bodies; the margin is for noise."""
_BLOCK = 16384


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
) -> Fit:
    """The `Fit` of F = exp(`log_k`) (δ - `zero_m`)^n with its rms force residual.

    An exponent that is no contact law or a K beyond floating point is flagged ILL_CONDITIONED,
    not raised: a table of all estimators must stay complete.
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
        force_rms_n=force_rms(points.deformation_m, points.force_n, log_k, n, zero_m),
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


def force_rms(
    deformation_m: FloatArray, force_n: FloatArray, log_k: float, n: float, zero_m: float
) -> float:
    """rms of F - K (δ - δ0)^n in N; the law gives 0 N where δ ≤ δ0."""
    if not (math.isfinite(log_k) and math.isfinite(n)):
        return math.nan
    total = 0.0
    buffer = np.empty(min(_BLOCK, force_n.size))
    with np.errstate(divide="ignore", over="ignore"):
        for start in range(0, force_n.size, _BLOCK):
            force = force_n[start : start + _BLOCK]
            part = buffer[: force.size]
            np.subtract(deformation_m[start : start + _BLOCK], zero_m, out=part)
            np.maximum(part, 0.0, out=part)
            np.log(part, out=part)
            part *= n
            part += log_k
            np.exp(part, out=part)
            part -= force
            total += float(part @ part)
    return math.sqrt(total / force_n.size)


def _exp(value: float) -> float:
    return math.exp(value) if value < 709.0 else math.inf if value >= 709.0 else math.nan
