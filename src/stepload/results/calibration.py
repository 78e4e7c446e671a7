"""Calibration record from system runs: K_s, its uncertainty, and where it is valid."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from typing import Any

import numpy as np
from pydantic import ValidationError

import stepload
from stepload.errors import BadInputError
from stepload.estimators.fit import FloatArray
from stepload.estimators.pool import PooledStiffness, pool
from stepload.estimators.smooth_length import SmoothLength, measure_length
from stepload.estimators.system import SystemStiffnessFit
from stepload.estimators.table import MeasuredTable, measured_table
from stepload.estimators.two_spheres import TwoSphereFit, two_sphere_difference
from stepload.plan.calibration import TEMPERATURE_BAND_K, CalibrationRecord
from stepload.plan.model import Structure
from stepload.results.analyse import identify_system, series_contact
from stepload.results.lateral_effect_runs import NOT_KNOWN, across_of_runs
from stepload.results.run_record import SavedRun, labelled
from stepload.rig.pose import differences

VALID_DAYS = 180
_KEYS = ("stiffness_n_per_m", "sigma_n_per_m", "msde_m", "smooth_error_m")
_LEVELS = 200
"""Number of common forces of the two runs in the difference method."""
_LEAST_SHARE = 0.05
"""Forces below this share of the top are left out there: the touch dominates."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """A calibration record and what it was made from.

    `length` is None where the runs do not determine the correlation length of their smooth error;
    `table_problem` says why the record has no table.
    """

    record: CalibrationRecord
    runs: tuple[SavedRun, ...]
    fits: tuple[SystemStiffnessFit, ...] = ()
    pooled: PooledStiffness | None = None
    spheres: TwoSphereFit | None = None
    length: SmoothLength | None = None
    table_problem: str = ""


def from_system_runs(runs: Sequence[SavedRun], *, valid_days: int = VALID_DAYS) -> Calibration:
    """Pool runs against a stiff flat contact (26).

    Raises:
        BadInputError: a run of another kind, or runs of different rigs or poses.
    """
    origin, runs = _origin(runs, valid_days), labelled(runs)
    for run in runs:
        if run.conditions.kind != "system":
            raise BadInputError(
                f"{run.path}: a payload run; K_s and the payload's law share its data",
                hint="press a stiff flat contact with a plan that has `identify: {kind: system}`",
            )
    sideways = across_of_runs(runs)
    runs = sideways.taken_out(runs)
    fits, length = _fits(runs)
    pooled = pool(fits)
    made = _table(runs, fits, pooled)
    record = _record(
        **origin,
        **_figures(pooled),
        smooth_length_n=length.length_n if length else runs[0].conditions.sources.smooth_length_n,
        **_rows(made),
        **sideways.keys(),
        damping_n_s_per_m=pooled.damping_lower_bound_n_s_per_m,
        force_from_n=pooled.force_range_n[0],
        force_to_n=pooled.force_range_n[1],
    )
    return Calibration(record, tuple(runs), fits, pooled, length=length, table_problem=made.problem)


def _fits(
    runs: Sequence[SavedRun],
) -> tuple[tuple[SystemStiffnessFit, ...], SmoothLength | None]:
    """K_s of each run, with the correlation length of the smooth error estimated from the runs.

    Where they do not determine it, that of their plans is used, or without one the worst possible.
    """
    fits = tuple(identify_system(run.data, run.conditions) for run in runs)
    length = measure_length(
        [(fit.misfit_force_n, fit.misfit_m) for fit in fits], runs=pool(fits).independent_runs
    )
    if length is None:
        return fits, None
    conditions = [
        replace(c, sources=replace(c.sources, smooth_length_n=length.length_n))
        for c in (run.conditions for run in runs)
    ]
    told = zip(runs, conditions, strict=True)
    return tuple(identify_system(run.data, each) for run, each in told), length


def _table(
    runs: Sequence[SavedRun], fits: Sequence[SystemStiffnessFit], pooled: PooledStiffness
) -> MeasuredTable:
    """The table δ_s(F) of the runs' loadings, from the fits of K_s."""
    for run in runs:
        if series_contact(run.conditions) is None:
            return MeasuredTable(None, 0.0, f"{run.path.name} does not tell its contact")
    resolution_m = max(run.conditions.sources.position_resolution_m for run in runs)
    return measured_table(fits, pooled, resolution_m=resolution_m)


def _rows(made: MeasuredTable) -> dict[str, Any]:
    """The keys of the record that describe a table; none without one."""
    if made.table is None:
        return {}
    return {
        "deflection_force_n": made.table.force_n,
        "deflection_m": made.table.deflection_m,
        "deflection_sigma_m": made.table.sigma_m,
        "deflection_common": made.common,
    }


def from_two_spheres(
    first: SavedRun, second: SavedRun, *, valid_days: int = VALID_DAYS
) -> Calibration:
    """K_s from two reference spheres of known radii and materials: the difference method.

    Raises:
        BadInputError: runs without a known contact, too small a common range of force, or spheres
            too similar.
    """
    origin = _origin((first, second), valid_days)
    first, second = labelled((first, second))
    contacts = []
    for run in (first, second):
        contact = series_contact(run.conditions)
        if contact is None or run.data.gauge:
            what = "measured across the contact" if run.data.gauge else "without a contact law"
            raise BadInputError(f"{run.path}: a run {what}: the difference method needs both")
        contacts.append(contact)
    branches = [_loading(run) for run in (first, second)]
    top_n = min(float(force.max()) for force, _ in branches)
    low_n = max(_LEAST_SHARE * top_n, *(float(force.min()) for force, _ in branches))
    grid = np.linspace(low_n, 0.99 * top_n, _LEVELS)
    one, other = (_at(force, travel, grid) for force, travel in branches)
    fit = two_sphere_difference(
        one, other, grid, first_contact=contacts[0], second_contact=contacts[1],
        length_n=first.conditions.sources.smooth_length_n,
    )  # fmt: skip
    record = _record(
        **origin,
        **_figures(fit),
        smooth_length_n=first.conditions.sources.smooth_length_n,
        damping_n_s_per_m=0.0,
        force_from_n=float(grid[0]),
        force_to_n=float(grid[-1]),
        across_told=f"two spheres tell K_s alone: {NOT_KNOWN}" if first.conditions.arm else "",
    )
    return Calibration(
        record, (first, second), spheres=fit,
        table_problem="two spheres tell K_s, and no table of the deflection",
    )  # fmt: skip


def _record(**values: Any) -> CalibrationRecord:
    """The record; BadInputError where one of its values is none that a plan would take."""
    try:
        return CalibrationRecord(stepload_calibration=1, **values)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name = ".".join(map(str, first["loc"]))
        raise BadInputError(
            f"the runs give no calibration record: {name}: {first['msg']}",
            hint="look at what the runs state, and at their fits",
        ) from None


def _figures(fit: PooledStiffness | TwoSphereFit) -> dict[str, Any]:
    """The keys of the record that say K_s and its errors."""
    degrees = fit.smooth_degrees
    return {
        **{key: getattr(fit, key) for key in _KEYS},
        "smooth_degrees": None if degrees is None else min(max(degrees, 1.0), 1e6),
    }


def _origin(runs: Sequence[SavedRun], valid_days: int) -> dict[str, Any]:
    """Origin of a calibration: where, when and from what it was made.

    Raises:
        BadInputError: they do not belong together.
    """
    if not runs:
        raise BadInputError("there is no run to calibrate from")
    if valid_days < 1:
        raise BadInputError(f"a validity of {valid_days} days; it must be at least 1 day")
    names: Mapping[str, Callable[[SavedRun], str]] = {
        "rig": lambda run: run.metadata.get("rig", ""),
        "pose": lambda run: run.conditions.pose,
        "direction": lambda run: run.metadata.get("force_axis", ""),
        "structure": _structure,
        "dry run": lambda run: str(run.simulated),
    }
    common = {}
    for what, of in names.items():
        found = sorted({of(run) for run in runs})
        if len(found) > 1:
            raise BadInputError(
                f"the runs differ in their {what}: {', '.join(map(repr, found))}",
                hint="one record is for one rig in one pose; calibrate each by itself",
            )
        common[what] = found[0]
    if cut := [f"{run.path}: {run.cut}" for run in runs if run.cut]:
        raise BadInputError(
            f"a run that did not come to its end makes no calibration: {'; '.join(cut)}",
            hint="leave it out, or mend the cause and press again",
        )
    ids = [run.metadata.get("run_id", run.path.name) for run in runs]
    if len(set(ids)) < len(ids):
        raise BadInputError("one run is given twice; it would count as two")
    temperatures = [t for run in runs if (t := run.conditions.temperature_c) is not None]
    if temperatures and max(temperatures) - min(temperatures) > TEMPERATURE_BAND_K:
        raise BadInputError(
            f"the runs were made at {min(temperatures):g} to {max(temperatures):g} °C, more than "
            f"{TEMPERATURE_BAND_K:g} K apart"
        )
    days = [run.day for run in runs]
    return {
        "rig": common["rig"],
        "pose": common["pose"],
        "direction": common["direction"],
        "temperature_c": float(np.mean(temperatures)) if temperatures else None,
        "measured_on": max(days),
        "valid_until": min(days) + timedelta(days=valid_days),
        "run": ", ".join(ids)[:1000],
        "software": f"stepload {stepload.__version__}",
        "simulated": runs[0].simulated,
        **common_pose(runs),
    }


def _structure(run: SavedRun) -> str:
    return str(Structure.ARM if run.conditions.arm else Structure.MACHINE)


def common_pose(runs: Sequence[SavedRun]) -> dict[str, Any]:
    """Pose of the arm in all runs, as far as it was recorded: that of the first run.

    Raises:
        BadInputError: the poses differ, or one run did not record its pose.
    """
    first, *others = (run.stood for run in runs)
    for run, other in zip(runs[1:], others, strict=True):
        if (first is None) != (other is None):
            raise BadInputError(f"{run.path}: not all runs tell how the arm stood")
        if first is not None and other is not None and (apart := differences(first, other)):
            raise BadInputError(
                f"{run.path}: the arm stood elsewhere than in {runs[0].path}: {'; '.join(apart)}",
                hint="one record is for one rig in one pose: lead the arm back to its start pose"
                " before each run (none does), or calibrate each by itself",
            )
    if first is None:
        return {}
    tcp = first.tcp_offset or ()
    return {
        "joints_rad": first.joints_rad or (),
        "tcp_position_m": tcp[:3],
        "tcp_rotation_rad": tcp[3:],
    }


def _loading(run: SavedRun) -> tuple[FloatArray, FloatArray]:
    """Force and travel of the first loading."""
    loading = run.data.first_loading()
    if not loading.any():
        raise BadInputError(f"{run.path}: the run ended before its first load step")
    return run.data.force_n[loading], run.data.travel_m[loading]


def _at(force_n: FloatArray, travel_m: FloatArray, grid_n: FloatArray) -> FloatArray:
    """Travel on a grid of forces, averaged over a grid step, so that a hold counts once."""
    step = float(grid_n[1] - grid_n[0])
    index = np.round((force_n - grid_n[0]) / step).astype(np.intp)
    inside = (index >= 0) & (index < grid_n.size)
    count = np.bincount(index[inside], minlength=grid_n.size)
    used = count > 0
    if np.count_nonzero(used) < 10:
        raise BadInputError("the two runs have fewer than 10 forces in common")
    force = np.bincount(index[inside], force_n[inside], grid_n.size)[used] / count[used]
    travel = np.bincount(index[inside], travel_m[inside], grid_n.size)[used] / count[used]
    return np.asarray(np.interp(grid_n, force, travel))
