"""K_s, its table δ_s(F) and the correlation length of its smooth error, from several runs.

Runs with independent smooth errors (a new touch, another day) add up their degrees of freedom; runs
that repeat the same error do not: n runs whose misfits have the mean correlation r count as
n/(1 + (n − 1) r) runs.

The table is made of the cells of force that K_s was fitted to, contact and damping (C_s) taken out:
those of the loading, since a load path has hysteresis. Rows lie so far apart that a quantum of
position is small between them.

The length is the likeliest one (REML) of a smooth error with white noise and a free straight line
(it is K_s). Few correlation lengths lie in one run: often the data do not determine it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from stepload.errors import DomainError
from stepload.identification.deflection import DeflectionTable
from stepload.identification.fit import FloatArray
from stepload.identification.smooth import CHI2_95, few_degrees, smooth_correlation
from stepload.identification.system_stiffness import SystemStiffnessFit, piece_shifts, quantum_sd

_GRID = 60


@dataclass(frozen=True, slots=True)
class PooledStiffness:
    """K_s of several runs of one rig in one pose.

    Attributes:
        stiffness_n_per_m: mean, weighted with the information in each run's range of force.
        sigma_n_per_m: its standard uncertainty, such that ± 1.96 σ covers 95 %.
        msde_m, smooth_error_m: rms over the runs of their misfit and smooth error.
        smooth_degrees: degrees of freedom of the smooth error; None where no run estimated it.
        damping_lower_bound_n_s_per_m: the lowest of the runs' bounds.
        force_range_n: lowest and highest force common to all runs.
        independent_runs: number of independent runs that they count as.
        misfit_correlation: mean correlation of the misfits of two runs; 0 for one run.
        scatter: rms deviation of the runs over their own uncertainties; 0 for one run.
    """

    stiffness_n_per_m: float
    sigma_n_per_m: float
    msde_m: float
    smooth_error_m: float
    smooth_degrees: float | None
    damping_lower_bound_n_s_per_m: float
    force_range_n: tuple[float, float]
    runs: int
    independent_runs: float
    misfit_correlation: float
    scatter: float


def pool(fits: Sequence[SystemStiffnessFit]) -> PooledStiffness:
    """Pool K_s runs of one rig, pose and direction.

    The uncertainty of the series contact is common to all runs and does not shrink. Runs that
    scatter more than their uncertainties allow widen the result by that factor.

    Raises:
        DomainError: no run, or runs without a common range of force.
    """
    if not fits:
        raise DomainError("there is no run to pool")
    low_n = max(fit.force_range_n[0] for fit in fits)
    high_n = min(fit.force_range_n[1] for fit in fits)
    if not high_n > low_n:
        raise DomainError(
            f"the runs have no force in common: the highest of one is {high_n:.4g} N, the lowest "
            f"of another {low_n:.4g} N",
            hint="pool runs with the same load steps",
        )
    count = len(fits)
    correlation = _correlation([_misfit(fit, low_n, high_n) for fit in fits])
    shared = 1.0 + (count - 1) * max(correlation, 0.0)
    estimated = [fit.smooth_degrees for fit in fits if fit.smooth_degrees is not None]
    degrees = sum(estimated) / shared if estimated else None

    stiffness = np.array([fit.stiffness_n_per_m for fit in fits])
    size_m = _rms([_smooth_size(fit) for fit in fits]) * few_degrees(degrees)
    own = np.array([math.hypot(f.error_gain_n_per_m2 * size_m, f.bend_sigma_n_per_m) for f in fits])
    weight = 1.0 / own**2
    mean = float(weight @ stiffness / weight.sum())
    scatter = math.sqrt(float(weight @ (stiffness - mean) ** 2) / (count - 1)) if count > 1 else 0.0
    sigma = math.sqrt(shared / float(weight.sum())) * max(1.0, scatter)
    contact = max(fit.contact_sigma_n_per_m for fit in fits)
    return PooledStiffness(
        stiffness_n_per_m=mean,
        sigma_n_per_m=math.hypot(sigma, contact),
        msde_m=_rms([fit.msde_m for fit in fits]),
        smooth_error_m=_rms([fit.smooth_error_m for fit in fits]),
        smooth_degrees=degrees,
        damping_lower_bound_n_s_per_m=min(fit.damping_lower_bound_n_s_per_m for fit in fits),
        force_range_n=(low_n, high_n),
        runs=count,
        independent_runs=count / shared,
        misfit_correlation=correlation,
        scatter=scatter,
    )


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _smooth_size(fit: SystemStiffnessFit) -> float:
    """Size in m of the smooth error on which the uncertainty of a run is based."""
    known = fit.contact_sigma_n_per_m**2 + fit.bend_sigma_n_per_m**2
    smooth = math.sqrt(max(fit.sigma_n_per_m**2 - known, 0.0))
    return smooth / (fit.error_gain_n_per_m2 * few_degrees(fit.smooth_degrees))


def _misfit(fit: SystemStiffnessFit, low_n: float, high_n: float) -> FloatArray:
    """Misfit of a run (60,) over the common forces, mean and slope taken out."""
    grid = np.linspace(low_n, high_n, _GRID)
    force, where = np.unique(fit.misfit_force_n, return_inverse=True)
    mean = np.bincount(where, fit.misfit_m) / np.bincount(where)
    values = np.interp(grid, force, mean)
    return np.asarray(values - np.polyval(np.polyfit(grid, values, 1), grid))


def _correlation(misfits: Sequence[FloatArray]) -> float:
    """Mean correlation of two misfits; 0 where there are none or they vanish."""
    found = [
        float(one @ other) / scale
        for one, other in combinations(misfits, 2)
        if (scale := math.sqrt(float(one @ one) * float(other @ other))) > 0.0
    ]
    return float(np.mean(found)) if found else 0.0


FEWEST, MOST = 4, 24
QUANTA = 4.0
"""Least change of deflection between two rows, in quanta or in smooth errors."""
_FINE = 120


@dataclass(frozen=True, slots=True)
class MeasuredTable:
    """Rows of δ_s(F) and their common errors; `table` is None where `problem` gives the reason."""

    table: DeflectionTable | None
    common: float
    problem: str = ""


def measured_table(
    fits: Sequence[SystemStiffnessFit], pooled: PooledStiffness, *, resolution_m: float
) -> MeasuredTable:
    """The table of several runs of one rig in one pose.

    Its zero is where the straight line through its lowest rows meets 0 N. The uncertainty of a row
    is that of the smooth error, with its few degrees of freedom, of so many runs as they count for;
    and the quantum, as far as a row does not average it. What is uncertain of the contact in series
    is common to all rows.

    Args:
        resolution_m: quantum of the travel.
    """
    common = max(fit.contact_sigma_n_per_m for fit in fits) / pooled.stiffness_n_per_m
    low_n = max(float(fit.loading_force_n.min()) for fit in fits)
    high_n = min(float(fit.loading_force_n.max()) for fit in fits)
    if not high_n > low_n:
        return MeasuredTable(None, common, "the runs have no force in common")
    force = np.concatenate([fit.loading_force_n for fit in fits])
    travel = np.concatenate([fit.loading_m for fit in fits])
    run = np.repeat(np.arange(len(fits)), [fit.loading_force_n.size for fit in fits])
    inside = (force >= low_n) & (force <= high_n)
    force, travel, run = force[inside], travel[inside], run[inside]
    fine = np.floor((force - low_n) / (high_n - low_n) * _FINE).astype(np.intp)
    shift_m, known = piece_shifts(travel, fine, run)
    force, travel = force[known], travel[known] - shift_m[known]

    size_m = pooled.smooth_error_m * few_degrees(pooled.smooth_degrees)
    size_m /= float(np.sqrt(max(pooled.independent_runs, 1.0)))
    span_m = (high_n - low_n) / pooled.stiffness_n_per_m
    apart_m = QUANTA * max(resolution_m, pooled.smooth_error_m, span_m / (QUANTA * MOST))
    count = int(np.clip(span_m / apart_m, FEWEST, MOST))
    row_n, row_m = _rows(force, travel, low_n, high_n, count)
    if row_n.size < FEWEST:
        return MeasuredTable(None, common, f"{row_n.size} steps of force; {FEWEST} are needed")
    slope = (row_m[1] - row_m[0]) / (row_n[1] - row_n[0])
    row_m = row_m - row_m[0] + slope * row_n[0]
    left_m = quantum_sd(span_m / count, resolution_m)
    sigma = np.full(row_n.size, float(np.hypot(size_m, left_m)))
    try:
        table = DeflectionTable(tuple(row_n.tolist()), tuple(row_m.tolist()), tuple(sigma.tolist()))
    except DomainError as error:
        return MeasuredTable(None, common, error.message)
    return MeasuredTable(table, common)


def _rows(
    force_n: FloatArray, travel_m: FloatArray, low_n: float, high_n: float, count: int
) -> tuple[FloatArray, FloatArray]:
    """Mean force and travel in `count` equal steps of force; empty steps are left out."""
    step = np.minimum(((force_n - low_n) / (high_n - low_n) * count).astype(np.intp), count - 1)
    held = np.bincount(step, minlength=count)
    used = held > 0
    mean_n = np.bincount(step, force_n, count)[used] / held[used]
    return mean_n, np.bincount(step, travel_m, count)[used] / held[used]


WIDEST = 4.0
"""Largest factor of the interval at which a length still counts as determined."""
SHAPE = 1.5
"""Least factor of the interval either way: no error has exactly the correlation assumed here, and
without noise that shape alone would determine its length to a few per cent."""
_LENGTHS = 17
_POINTS = 40
_NOISE = (3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Variance of the white noise over that of the smooth error."""


@dataclass(frozen=True, slots=True)
class SmoothLength:
    """The likeliest correlation length in N and its 95 % interval."""

    length_n: float
    low_n: float
    high_n: float


def measure_length(
    misfits: Sequence[tuple[FloatArray, FloatArray]], *, runs: float | None = None
) -> SmoothLength | None:
    """Estimate the correlation length from the misfits of K_s runs.

    Args:
        misfits: for each run the forces (N,) in N and the misfit (N,) in m there; any straight line
            in it is free.
        runs: number of independent runs that they count as; None: all.

    Returns:
        None where it is not determined: every length, or noise alone, explains them as well, or the
            interval is wider than a factor of `WIDEST` or reaches lengths that cannot be
            distinguished from a straight line or from noise.
    """
    usable = [_thinned(force, left) for force, left in misfits if force.size > 2 * len(_NOISE)]
    if not usable:
        return None
    span = max(float(np.ptp(force)) for force, _ in usable)
    lengths = np.geomspace(span / 40.0, 2.0 * span, _LENGTHS)
    surface = np.array(
        [
            [sum(_deviance(force, left, length, noise) for force, left in usable)
             for noise in _NOISE]
            for length in lengths
        ]
    )  # fmt: skip
    noise_only = sum(_deviance(force, left, span, None) for force, left in usable)
    share = 1.0 if runs is None else min(1.0, runs / len(usable))
    deviance = surface.min(axis=1) * share
    best = int(np.argmin(deviance))
    inside = np.flatnonzero(deviance <= deviance[best] + CHI2_95)
    low, high = int(inside[0]), int(inside[-1])
    told = noise_only * share > deviance[best] + CHI2_95
    at_end = low == 0 or high == _LENGTHS - 1
    if not told or at_end or lengths[high] > WIDEST * lengths[low]:
        return None
    length = float(lengths[best])
    return SmoothLength(
        length, min(float(lengths[low]), length / SHAPE), max(float(lengths[high]), length * SHAPE)
    )


def _thinned(force_n: FloatArray, left_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means over at most `_POINTS` steps of force: the cost of the likelihood is cubic in them."""
    width = float(np.ptp(force_n)) / _POINTS
    _, index = np.unique(np.floor(force_n / width) if width else force_n, return_inverse=True)
    count = np.bincount(index)
    return np.bincount(index, force_n) / count, np.bincount(index, left_m) / count


def _deviance(
    force_n: FloatArray, left_m: FloatArray, length_n: float, noise: float | None
) -> float:
    """−2 ln of the restricted likelihood of a misfit, its size profiled out."""
    line = np.stack([np.ones_like(force_n), force_n / force_n.max()], axis=1)
    unit = np.eye(force_n.size)
    shape = unit if noise is None else smooth_correlation(force_n, length_n) + (noise + 1e-8) * unit
    root = np.linalg.cholesky(shape)
    columns, left = np.linalg.solve(root, line), np.linalg.solve(root, left_m)
    q, r = np.linalg.qr(columns)
    rest = left - q @ (q.T @ left)
    degrees = force_n.size - line.shape[1]
    size = max(float(rest @ rest) / degrees, 1e-30)
    log_shape = 2.0 * float(np.log(np.diag(root)).sum())
    log_line = 2.0 * float(np.log(np.abs(np.diag(r))).sum())
    return float(degrees) * math.log(size) + log_shape + log_line
