"""The table δ_s(F) of a pose from K_s runs, of which the line (26) gives a single number.

It holds the loading only, from which a payload is identified, since a load path has hysteresis. The
contact's deformation and the damping (C_s) are subtracted as in the fit of K_s. Rows lie so far
apart that a quantum of position is small between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.deflection import DeflectionTable
from stepload.estimators.fit import FloatArray, IntArray
from stepload.estimators.pieces import piece_shifts
from stepload.estimators.pool import PooledStiffness
from stepload.estimators.smooth import few_degrees
from stepload.estimators.system import SeriesContact, SystemStiffnessFit, gather, quantum_sd

FEWEST, MOST = 4, 24
QUANTA = 4.0
"""Least change of deflection between two rows, in quanta or in smooth errors."""
LEAST_SHARE = 0.03
"""Forces below this share of the top are left out: there the touch dominates."""
_FINE = 120


@dataclass(frozen=True, slots=True)
class MeasuredTable:
    """Rows of δ_s(F) and their common errors; `table` is None where `problem` gives the reason."""

    table: DeflectionTable | None
    common: float
    problem: str = ""


class LoadingCurve(NamedTuple):
    """Deflection (M,) of the system in m over force (M,) of one run's loadings, any zero."""

    force_n: FloatArray
    deflection_m: FloatArray


def loading_curve(
    time_s: FloatArray,
    displacement_m: FloatArray,
    force_n: FloatArray,
    piece: IntArray,
    *,
    contact: SeriesContact,
    fit: SystemStiffnessFit,
) -> LoadingCurve:
    """Travel (N,) less contact and damping, averaged in cells of force.

    Args:
        time_s, displacement_m, force_n, piece: (N,) of all loadings of a run, as for the fit.
        contact: the contact in series.
        fit: K_s of the run; its damping takes out what moves late.
    """
    used = force_n > LEAST_SHARE * float(force_n.max())
    cells = gather(time_s, displacement_m, force_n, used, piece)
    late = fit.damping_n_s_per_m / fit.stiffness_n_per_m * cells.rate_m_s
    left = cells.displacement_m - contact.deformation_m(cells.force_n) + late
    return LoadingCurve(cells.force_n, left)


def measured_table(
    curves: Sequence[LoadingCurve],
    fits: Sequence[SystemStiffnessFit],
    pooled: PooledStiffness,
    *,
    resolution_m: float,
) -> MeasuredTable:
    """The table of several runs of one rig in one pose.

    Its zero is where the straight line through its lowest rows meets 0 N. The uncertainty of a row
    is that of the smooth error, with its few degrees of freedom, of so many runs as they count for;
    and the quantum, as far as a row does not average it. What is uncertain of the contact in series
    is common to all rows.

    Args:
        curves: of the runs.
        fits: of the runs.
        pooled: made of them.
        resolution_m: quantum of the travel.
    """
    common = max(fit.contact_sigma_n_per_m for fit in fits) / pooled.stiffness_n_per_m
    low_n = max(float(curve.force_n.min()) for curve in curves)
    high_n = min(float(curve.force_n.max()) for curve in curves)
    low_n = max(low_n, LEAST_SHARE * high_n)
    if not high_n > low_n:
        return MeasuredTable(None, common, "the runs have no force in common")
    force = np.concatenate([curve.force_n for curve in curves])
    travel = np.concatenate([curve.deflection_m for curve in curves])
    run = np.repeat(np.arange(len(curves)), [curve.force_n.size for curve in curves])
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
