"""The table δ_s(F) of a pose from K_s runs, of which the line (26) gives a single number.

It is made of the cells of force that K_s was fitted to, contact and damping (C_s) taken out: those
of the loading, since a load path has hysteresis. Rows lie so far
apart that a quantum of position is small between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.deflection import DeflectionTable
from stepload.estimators.fit import FloatArray
from stepload.estimators.pool import PooledStiffness
from stepload.estimators.smooth import few_degrees
from stepload.estimators.system import SystemStiffnessFit, piece_shifts, quantum_sd

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
        fits: of the runs, each with its contact.
        pooled: made of them.
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
