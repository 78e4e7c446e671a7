"""Compare results: within a run, between runs, and with a curve from somewhere else.

Errors that two runs share (K_s, force calibration, the kinematics of one pose) do not show in their
spread: repeatability says nothing about trueness. The spread is to be read beside the budget; what
a difference of runs may be judged by is in `stepload.estimators.difference`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.fit import Fit, FloatArray
from stepload.estimators.smooth import NORMAL_95

CHORD_SHARE = 0.1
"""A chord begins at this share of its highest force."""
_REACH = 0.02
"""A force counts as reached when this share of it is missing: levels are held that well."""


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
        secant_change: (S2 − S1)/mean, relative.
        n_change: n2 − n1.
        k_ratio: K2/K1; of little meaning where n differs, since the unit of K depends on n.
        normalised_error: |ln S2 − ln S1| over half the width of its 95 % interval: above 1 the two
            disagree; None where a budget is missing.
    """

    secant_change: float
    n_change: float
    k_ratio: float
    normalised_error: float | None


def compare_fits(first: Fit, second: Fit, *, half_width: float | None = None) -> FitPair:
    """Compare two fits by one estimator at one secant force.

    Args:
        first, second: the fits.
        half_width: half width of the 95 % interval of ln(S2/S1), shared errors taken out
            (`stepload.estimators.difference`).

    Raises:
        DomainError: different estimators or secant forces, or a half width that is not positive.
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
    s1, s2 = first.secant_n_per_m, second.secant_n_per_m
    error = None
    if half_width is not None:
        if not half_width > 0.0:
            raise DomainError(f"half width is {half_width:.3g}; it must be positive")
        error = abs(math.log(s2 / s1)) / half_width
    return FitPair(
        secant_change=2.0 * (s2 - s1) / (s1 + s2),
        n_change=second.n - first.n,
        k_ratio=second.k / first.k,
        normalised_error=error,
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


def at_other_modulus(
    force_n: FloatArray, *, from_modulus_pa: float, to_modulus_pa: float
) -> FloatArray:
    """Forces (N,) at the same deformations had the equivalent modulus been another (V-A).

    Two machines press one payload against different counter bodies, a steel platen and an aluminium
    plate. For one geometry K = g E_eq, with g and n of the geometry alone (3), (5), (7); hence F(δ)
    scales with E_eq (4), and the curve of one machine is carried to the other by
    F E_eq,to / E_eq,from. For the plastic sphere that is −2.4 % from steel to aluminium, for an
    aluminium sphere −32 %. It holds below F_c and where roughness is small against δ.

    Raises:
        DomainError: a modulus is not positive and finite.
    """
    for value in (from_modulus_pa, to_modulus_pa):
        if not 0.0 < value < math.inf:
            raise DomainError(f"equivalent modulus is {value:g} Pa; it must be positive and finite")
    return np.asarray(force_n * (to_modulus_pa / from_modulus_pa))


@dataclass(frozen=True, slots=True)
class CurveComparison:
    """A fit against a curve from elsewhere (another machine, finite elements).

    Everything is compared at forces that both have reached: `from_n` to `to_n`.

    Attributes:
        band: the fit at the deformations of the curve.
        curve_n: (N,) forces of the curve.
        inside_share: share of the curve's points inside the pointwise 95 % band.
        force_rms_n: rms difference in force.
        deformation_rms_m: rms difference in deformation at equal force.
        secant_change: (S_curve − S_fit)/S_fit, both at `to_n`; None where the curve has no point as
            low as that.
        to_n: the fit's secant force, or the highest that the curve has.
        chord_change: the same for the chord stiffness from `from_n` to `to_n`, which needs no zero;
            None where the curve has no point as low as `from_n`.
        from_n: 10 % of `to_n`.
        left_out: points of the curve at forces that the run has not reached.
    """

    band: Band
    curve_n: FloatArray
    inside_share: float
    force_rms_n: float
    deformation_rms_m: float
    secant_change: float | None
    to_n: float
    chord_change: float | None
    from_n: float
    left_out: int


def compare_curve(
    fit: Fit,
    covariance: FloatArray,
    curve_deformation_m: FloatArray,
    curve_force_n: FloatArray,
    *,
    reached_n: float = math.inf,
) -> CurveComparison:
    """Compare a fit with an imported force–deformation curve.

    Args:
        fit: the result, with its budget's `covariance`.
        curve_deformation_m, curve_force_n: (N,) the curve from its own zero; points with no
            positive force and deformation are left out. Where the counter bodies differ, the forces
            are those `at_other_modulus`.
        reached_n: highest force of the run; the fit is not compared beyond it.

    Raises:
        DomainError: shapes that differ, fewer than 3 usable points.
    """
    if curve_deformation_m.shape != curve_force_n.shape or curve_force_n.ndim != 1:
        raise DomainError(
            f"curve has {curve_deformation_m.shape} deformations and {curve_force_n.shape} forces"
        )
    usable = (curve_force_n > 0) & (curve_deformation_m > 0)
    keep = usable & (curve_force_n <= reached_n * (1.0 + _REACH))
    if np.count_nonzero(keep) < 3:
        raise DomainError(
            f"{np.count_nonzero(keep)} of {keep.size} points of the curve are usable, 3 are needed",
            hint="deformation and force must be positive, and the force one that the run has "
            "reached; check the columns and units of the file",
        )
    whole_m, whole_n = curve_deformation_m[usable], curve_force_n[usable]
    deformation, force = curve_deformation_m[keep], curve_force_n[keep]
    band = confidence_band(fit, covariance, deformation)
    top_n = min(fit.secant_force_n, float(whole_n.max()))
    low_n = CHORD_SHARE * top_n
    secant = chord = None
    if whole_n.min() <= top_n:
        top_m = _deformation_at(top_n, whole_m, whole_n)
        fit_top_m = _law_deformation(fit, top_n)
        secant = fit_top_m / top_m - 1.0
        if whole_n.min() <= low_n * (1.0 + _REACH):
            curve_m = top_m - _deformation_at(low_n, whole_m, whole_n)
            chord = (fit_top_m - _law_deformation(fit, low_n)) / curve_m - 1.0
    return CurveComparison(
        band=band,
        curve_n=force,
        inside_share=float(np.mean((force >= band.lower_n) & (force <= band.upper_n))),
        force_rms_n=float(np.sqrt(np.mean((band.force_n - force) ** 2))),
        deformation_rms_m=float(
            np.sqrt(np.mean(((force / fit.k) ** (1.0 / fit.n) - deformation) ** 2))
        ),
        secant_change=secant,
        to_n=top_n,
        chord_change=chord,
        from_n=low_n,
        left_out=int(np.count_nonzero(usable) - np.count_nonzero(keep)),
    )


def _law_deformation(fit: Fit, force_n: float) -> float:
    return math.exp(math.log(force_n / fit.k) / fit.n)


def _deformation_at(at_n: float, deformation_m: FloatArray, force_n: FloatArray) -> float:
    """Deformation of a curve at a force: the mean of the points within a tenth of it, each carried
    there by the power that they follow, so that noise averages out; between neighbours where there
    are fewer than four."""
    log_force, log_deformation = np.log(force_n), np.log(deformation_m)
    near = np.abs(force_n - at_n) <= 0.1 * at_n
    if np.count_nonzero(near) >= 4 and np.ptp(log_force[near]) > 0.0:
        x = log_force[near] - log_force[near].mean()
        power = float(x @ log_deformation[near] / (x @ x))
        return float(np.mean(deformation_m[near] * (at_n / force_n[near]) ** power))
    order = np.argsort(force_n, kind="stable")
    return math.exp(float(np.interp(math.log(at_n), log_force[order], log_deformation[order])))
