"""The paper's fits of several runs side by side: their spread, and test 1 against test 2.

Errors that two runs share (K_s, force calibration, the kinematics of one pose) do not show here.
What a difference of runs is judged by is in `stepload.evidence.difference`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.fit import Fit, FloatArray
from stepload.estimators.smooth import NORMAL_95


@dataclass(frozen=True, slots=True)
class Spread:
    """Spread of one quantity over several runs of several values each (one-way analysis).

    Attributes:
        mean: mean of the run means.
        within_sd: standard deviation within a run; None where no run has two values.
        between_sd: standard deviation between runs beyond what the within-run spread explains; None
            for a single run.
        p_value: probability that equal runs differ this much by chance; None where it is not known.
        values: number of values per run.
    """

    mean: float
    within_sd: float | None
    between_sd: float | None
    p_value: float | None
    values: tuple[int, ...]


def spread(runs: Sequence[FloatArray]) -> Spread:
    """Part the spread of a quantity into that within and that between runs.

    Args:
        runs: one array of values per run (cycles, or repeated touches of one run).

    Raises:
        DomainError: no run, a run without values, or values that are not finite.
    """
    if not runs or any(run.size == 0 or not np.all(np.isfinite(run)) for run in runs):
        raise DomainError("every run needs at least one finite value to be compared")
    sizes = np.array([run.size for run in runs])
    means = np.array([run.mean() for run in runs])
    total, count = int(sizes.sum()), len(runs)
    square_within = float(sum(np.sum((run - run.mean()) ** 2) for run in runs))
    free_within = total - count
    within = square_within / free_within if free_within else None
    between = p_value = None
    if count > 1:
        grand = float(sizes @ means) / total
        mean_square = float(sizes @ (means - grand) ** 2) / (count - 1)
        size = (total - float(sizes @ sizes) / total) / (count - 1)
        between = math.sqrt(max(mean_square - (within or 0.0), 0.0) / size)
        if within:
            from scipy.special import fdtrc

            p_value = float(fdtrc(count - 1, free_within, mean_square / within))
    return Spread(
        mean=float(means.mean()),
        within_sd=None if within is None else math.sqrt(within),
        between_sd=between,
        p_value=p_value,
        values=tuple(int(s) for s in sizes),
    )


@dataclass(frozen=True, slots=True)
class FitPair:
    """Test 1 against test 2, as in Table I.

    Attributes:
        secant_change: S2/S1 − 1.
        n_change: n2 − n1.
        k_ratio: K2/K1; of little meaning where n differs, since the unit of K depends on n.
    """

    secant_change: float
    n_change: float
    k_ratio: float


def compare_fits(first: Fit, second: Fit) -> FitPair:
    """Compare two fits by one estimator at one secant force.

    Raises:
        DomainError: different estimators or secant forces.
    """
    if first.estimator != second.estimator:
        raise DomainError(
            f"a {first.estimator!r} fit cannot be compared with a {second.estimator!r} fit",
            hint="estimators treat the zero differently; compare like with like",
        )
    if first.secant_force_n != second.secant_force_n:
        raise DomainError(
            f"secants at {first.secant_force_n:g} N and {second.secant_force_n:g} N differ by "
            "definition; evaluate both at one force"
        )
    return FitPair(
        secant_change=second.secant_n_per_m / first.secant_n_per_m - 1.0,
        n_change=second.n - first.n,
        k_ratio=second.k / first.k,
    )


@dataclass(frozen=True, slots=True)
class Band:
    """Force over deformation with its pointwise 95 % band, all (N,); deformation from the zero."""

    deformation_m: FloatArray
    force_n: FloatArray
    lower_n: FloatArray
    upper_n: FloatArray


def confidence_band(fit: Fit, covariance: FloatArray, deformation_m: FloatArray) -> Band:
    """The fitted curve F = K δ^n with its pointwise band.

    ln F = ln K + n ln δ is linear in the parameters, so the band needs no approximation beyond that
    of `covariance`. The zero is left out: the curve is that of the contact, not of the run.

    Args:
        fit: the result.
        covariance: (3, 3) of (ln K, n, δ0), from its budget.
        deformation_m: (N,) positive deformations from the zero.

    Raises:
        DomainError: a deformation that is not positive.
    """
    if not np.all(deformation_m > 0):
        raise DomainError("a confidence band is drawn at positive deformations only")
    x = np.log(deformation_m)
    middle = math.log(fit.k) + fit.n * x
    variance = covariance[0, 0] + 2.0 * x * covariance[0, 1] + x**2 * covariance[1, 1]
    half = NORMAL_95 * np.sqrt(np.maximum(variance, 0.0))
    return Band(deformation_m, np.exp(middle), np.exp(middle - half), np.exp(middle + half))
