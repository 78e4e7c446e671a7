"""Calibration record from system runs: K_s, its uncertainty, and where it is valid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from typing import Any

import numpy as np
from pydantic import ValidationError

import stepload
from stepload.errors import BadInputError
from stepload.identification.lateral_coupling import (
    CROSS_COMPLIANCE,
    MIN_FORCE,
    Across,
    AcrossFit,
    fit_across,
)
from stepload.identification.pooled_stiffness import (
    PooledStiffness,
    SmoothLength,
    measure_length,
    measured_table,
    pool,
)
from stepload.identification.system_stiffness import Cells, SystemStiffnessFit, gather
from stepload.plan.calibration import TEMPERATURE_BAND_K, CalibrationRecord
from stepload.report.analyse import identify_system, pieces, series_contact
from stepload.report.press_data import LOADING, UNLOADING
from stepload.report.run_record import SavedRun, labelled
from stepload.rig.pose import differences
from stepload.units import percent

VALID_DAYS = 180
_KEYS = ("stiffness_n_per_m", "sigma_n_per_m", "msde_m", "smooth_error_m")


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
    runs, across = across_of_runs(runs)
    fits, length = _fits(runs)
    pooled = pool(fits)
    rows, problem = _table(runs, fits, pooled)
    record = _record(
        **origin,
        **_figures(pooled),
        smooth_length_n=length.length_n if length else runs[0].conditions.sources.smooth_length_n,
        **rows,
        **across,
        damping_n_s_per_m=pooled.damping_lower_bound_n_s_per_m,
        force_from_n=pooled.force_range_n[0],
        force_to_n=pooled.force_range_n[1],
    )
    return Calibration(record, tuple(runs), fits, pooled, length=length, table_problem=problem)


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
) -> tuple[dict[str, Any], str]:
    """The table δ_s(F) of the runs' loadings as keys of the record; without one the reason."""
    for run in runs:
        if series_contact(run.conditions) is None:
            return {}, f"{run.path.name} does not tell its contact"
    resolution_m = max(run.conditions.sources.position_resolution_m for run in runs)
    made = measured_table(fits, pooled, resolution_m=resolution_m)
    if made.table is None:
        return {}, made.problem
    return {
        "deflection_force_n": made.table.force_n,
        "deflection_m": made.table.deflection_m,
        "deflection_sigma_m": made.table.sigma_m,
        "deflection_common": made.common,
    }, made.problem


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


def _figures(fit: PooledStiffness) -> dict[str, Any]:
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
    common = {}
    every_of: dict[str, list[str]] = {
        "rig": [run.metadata.get("rig", "") for run in runs],
        "pose": [run.conditions.pose for run in runs],
        "direction": [run.metadata.get("force_axis", "") for run in runs],
        "structure": ["arm" if run.conditions.arm else "machine" for run in runs],
        "dry run": [str(run.simulated) for run in runs],
    }
    for what, every in every_of.items():
        if len(found := sorted(set(every))) > 1:
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
        **{key: common[key] for key in ("rig", "pose", "direction")},
        "temperature_c": float(np.mean(temperatures)) if temperatures else None,
        "measured_on": max(days),
        "valid_until": min(days) + timedelta(days=valid_days),
        "run": ", ".join(ids)[:1000],
        "software": f"stepload {stepload.__version__}",
        "simulated": runs[0].simulated,
        **common_pose(runs),
    }


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


TYPICAL_SHARE = 0.3
"""Lateral share of a payload for which the uncertainty of the correction is reported."""
NOT_KNOWN = "under which friction K_s was measured is not known"


def across_of_runs(runs: Sequence[SavedRun]) -> tuple[tuple[SavedRun, ...], dict[str, Any]]:
    """The effect of lateral force in K_s runs of one arm in one pose, against a block.

    Returns:
        The runs corrected for it, so that all have the mean lateral share, and the keys of a
        calibration record.

    Raises:
        DomainError: a run has too little force.
        BadInputError: some runs recorded the lateral force and others did not.
    """
    runs = tuple(runs)
    if not all(run.conditions.arm for run in runs):
        return runs, {"across_told": ""}
    if silent := [str(run.path) for run in runs if run.data.across_n is None]:
        if len(silent) < len(runs):
            raise BadInputError(
                f"{', '.join(silent)}: no lateral force is told there, as it is in the "
                "others; with them under which friction K_s was measured would be lost",
                hint="leave these runs out, or press again with a six-axis force sensor",
            )
        return runs, {"across_told": f"the force sensor tells no lateral force: {NOT_KNOWN}"}
    fit = fit_across(
        [_cells(run) for run in runs],
        contacts=[series_contact(run.conditions) for run in runs],
        length_n=runs[0].conditions.sources.smooth_length_n,
    )
    across = fit.across
    return tuple(_without(run, across) for run in runs), {
        "across_m_per_n": across.per_newton_m or (),
        "across_sigma_m_per_n": () if across.per_newton_m is None else across.sigma_m_per_n,
        "across_correlation": across.correlation,
        "at_share": across.at_share or (),
        "share_reach": across.reach,
        "across_told": _told(fit),
    }


def _cells(run: SavedRun) -> Cells:
    data = run.data
    mask = data.branch((*LOADING, *UNLOADING))
    time_s, first = np.unique(data.time_s[mask], return_index=True)
    force_n = data.force_n[mask][first]
    assert data.across_n is not None
    return gather(
        time_s, data.travel_m[mask][first], force_n, force_n >= 0.5 * MIN_FORCE * force_n.max(),
        pieces(data)[mask][first], data.branch(LOADING)[mask][first], data.across_n[mask][first],
    )  # fmt: skip


def _without(run: SavedRun, across: Across) -> SavedRun:
    data = run.data
    assert data.across_n is not None
    travel_m = data.travel_m - across.taken_m(data.force_n, data.across_n)
    return replace(run, data=replace(data, travel_m=travel_m))


def _told(fit: AcrossFit) -> str:
    """Uncertainty of the correction, in words."""
    sizes = np.linalg.norm(fit.shares, axis=1)
    span = f"shares of {percent(sizes.min(), 2)} to {percent(sizes.max(), 2)} across"
    of_any = CROSS_COMPLIANCE * TYPICAL_SHARE
    if not len(fit.directions):
        return (
            f"one number: {span} are too much alike, for errors as large as those of these runs, "
            "to tell what the force across does; K_s holds for payloads of the same share, within "
            "5 % (press the block dry, and greased, harder and more often)"
        )
    along = [
        f"({d[0]:+.2f}, {d[1]:+.2f}) to {percent(fit.stiffness_n_per_m * sigma * TYPICAL_SHARE, 2)}"
        for d, sigma in zip(fit.directions, fit.sigma_m_per_n, strict=True)
    ]
    c = np.array(fit.across.per_newton_m) * fit.stiffness_n_per_m
    text = (
        f"lateral force: {span}; per newton across {c[0]:+.3f} and {c[1]:+.3f} of what one "
        f"along does; at a share of {percent(TYPICAL_SHARE, 2)} beside the calibrated one "
        f"known along "
        f"{' and '.join(along)} of the deflection (standard uncertainty)"
    )
    if len(fit.directions) == 1:
        text += f"; at right angles to it nothing is claimed ({percent(of_any, 2)})"
    beyond = 1.5 * fit.across.reach
    return (
        text + f"; beyond {percent(beyond, 2)} from it it costs width"
        if math.isfinite(beyond)
        else text
    )
