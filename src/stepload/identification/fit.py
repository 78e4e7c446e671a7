"""The one result type of every estimator, the points that one takes, and how a `Fit` is made."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepload.errors import DomainError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]

FEW_POINTS = 10
"""Fewer than this many usable points are flagged."""
NOT_POSITIVE_SHARE = 0.01
"""A larger share of points without positive deformation or force is flagged."""
PLAUSIBLE_EXPONENTS = 0.5, 5.0
"""Theory has n > 1 (5) and 1.5 to 2 for round and pointed bodies; the margin is for noise."""


class Flag(StrEnum):
    """What is doubtful about a fit; values are stable, programs branch on them."""

    TOO_FEW_POINTS = "too_few_points"
    NOT_POSITIVE = "deformation_not_positive"
    HOLD_WINDUP = "hold_windup"
    EXPONENT_UNDETERMINED = "exponent_undetermined"
    NOT_CONVERGED = "not_converged"
    ILL_CONDITIONED = "ill_conditioned"


@dataclass(frozen=True, slots=True)
class Doubt:
    """One flag with its numbers in words."""

    flag: Flag
    message: str


@dataclass(frozen=True, slots=True)
class Fit:
    """F = K (δ − δ0)^n as one estimator sees it.

    Attributes:
        estimator: its name ("rs_btls", "rs_rtls", "joint" …).
        k: K in N/m^n.
        zero_m: δ0 in m; 0 for two-parameter fits, which take the zero as given.
        secant_n_per_m: F/δ at `secant_force_n` (28).
        secant_force_n: force the secant is taken at.
        covariance: (3, 3) of (ln K, n, δ0) from the residuals alone, None where the estimator has
            none. They do not show what the fit has absorbed: see `stepload.identification`.
        force_rms_n: rms force residual of the data about the law.
    """

    estimator: str
    k: float
    n: float
    zero_m: float
    secant_n_per_m: float
    secant_force_n: float
    covariance: FloatArray | None
    force_rms_n: float
    points: int
    doubts: tuple[Doubt, ...] = field(default=())


@dataclass(frozen=True, slots=True)
class Missing:
    """There is no result; `why` says what the data lack, in a plain sentence."""

    why: str


class Points(NamedTuple):
    """Usable points: two 1-D arrays of one length, in m and N, and the doubts about them."""

    deformation_m: FloatArray
    force_n: FloatArray
    doubts: tuple[Doubt, ...]


def usable(
    deformation_m: ArrayLike, force_n: ArrayLike, *, at_least: int, known_zero: bool
) -> Points:
    """Points with force > 0 and, where the zero of the deformation is known, deformation > 0.

    Raises:
        DomainError: shapes differ, a number is not finite, or fewer than `at_least` are left.
    """
    deformation, force = checked(deformation_m, force_n)
    keep, what = force > 0.0, "force"
    if known_zero:
        keep, what = keep & (deformation > 0.0), "deformation or force"
    total, count = deformation.size, int(keep.sum())
    if count < at_least:
        raise DomainError(
            f"{count} of {total} points are usable ({what} above 0); "
            f"this fit needs at least {at_least}",
            hint="check the sign of the channels and the zero of the deformation",
        )
    doubts = []
    if count < FEW_POINTS:
        message = f"{count} usable points; a fit of fewer than {FEW_POINTS} is fragile"
        doubts.append(Doubt(Flag.TOO_FEW_POINTS, message))
    if (total - count) > NOT_POSITIVE_SHARE * total:
        share = 100.0 * (total - count) / total
        message = f"{share:.1f} % of {total} points left out: {what} not above 0"
        doubts.append(Doubt(Flag.NOT_POSITIVE, message))
    return Points(deformation[keep], force[keep], tuple(doubts))


def checked(deformation_m: ArrayLike, force_n: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Both as float arrays.

    Raises:
        DomainError: they are not 1-D of one length, or a number is not finite.
    """
    deformation = np.ascontiguousarray(deformation_m, dtype=np.float64)
    force = np.ascontiguousarray(force_n, dtype=np.float64)
    if deformation.ndim != 1 or deformation.shape != force.shape:
        raise DomainError(
            f"deformation has shape {deformation.shape}, force {force.shape}; "
            "both must be 1-D of one length"
        )
    for values, what in ((deformation, "deformations"), (force, "forces")):
        if not math.isfinite(float(values.sum())):
            bad = np.flatnonzero(~np.isfinite(values))
            raise DomainError(
                f"{bad.size} of {values.size} {what} are not finite, the first at index {bad[:1]}",
                hint="drop samples that are missing or invalid before fitting",
            )
    return deformation, force


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

    An exponent that is no contact law or a K beyond floating point is flagged ILL_CONDITIONED, not
    raised: a table of all estimators must stay complete.
    """
    return Fit(
        estimator=estimator,
        k=_exp(log_k),
        n=n,
        zero_m=zero_m,
        secant_n_per_m=_exp(log_secant(log_k, n, secant_force_n)),
        secant_force_n=secant_force_n,
        covariance=covariance,
        force_rms_n=force_rms_n(points.deformation_m, points.force_n, log_k, n, zero_m),
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
        law = np.exp(log_k + n * np.log(np.maximum(deformation_m - zero_m, 0.0)))
        return math.sqrt(float(np.mean((law - force_n) ** 2)))


def law_compliance(fit: Fit, force_n: FloatArray) -> FloatArray:
    """dδ/dF of the fitted law (N,) in m/N at forces > 0."""
    return np.asarray((force_n / fit.k) ** (1.0 / fit.n) / (fit.n * force_n))


def finite(matrix: FloatArray) -> FloatArray:
    """The matrix itself: LAPACK does not return from some infinities, or prints.

    Raises:
        DomainError: a number in it is not finite.
    """
    if not np.isfinite(matrix).all():
        raise DomainError(
            "the points lead to no law: their numbers are too large or too small to be fitted",
            hint="check the units of the columns",
        )
    return matrix


def _exp(value: float) -> float:
    return math.exp(value) if value < 709.0 else math.inf if value >= 709.0 else math.nan
