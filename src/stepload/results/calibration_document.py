"""A calibration for people and for programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stepload.results import fields
from stepload.results.calibration import Calibration
from stepload.results.data import system_data
from stepload.results.model import Document, Verdict, by_name, table
from stepload.units import format_quantity as f


def calibration_document(found: Calibration, file: Path) -> Document:
    """A calibration whose record was written to `file`, for people."""
    record, reasons = found.record, []
    if found.pooled is not None and found.pooled.runs > 1:
        pooled = found.pooled
        reasons.append(
            f"{pooled.runs} runs count as {pooled.independent_runs:.1f}: their misfits correlate "
            f"by {pooled.misfit_correlation:+.2f}; they scatter {pooled.scatter:.2f} times as "
            "much as their uncertainties say"
        )
    if found.pooled is not None:
        reasons.append(_length_told(found))
    reasons.append(_table_told(found))
    if found.spheres is not None:
        reasons.append(
            f"the contacts deform {found.spheres.contact_scale:.3f} ± "
            f"{found.spheres.contact_scale_sigma:.3f} times as much as theory says"
        )
    reasons.append(
        f"for {record.rig}, pose {record.pose or 'not stated'!r}, direction {record.direction}, "
        f"valid until {record.valid_until}"
    )
    if record.simulated:
        reasons.append("made in a dry run: good for dry runs only")
    rows = [(run.name, fit) for run, fit in zip(found.runs, found.fits, strict=False)]
    known = fields.smooth_error(record.smooth_error_m or 0.0, record.smooth_degrees)
    return Document(
        title="Calibration",
        verdict=Verdict(
            "good",
            "calibrated",
            f"K_s = {f(record.stiffness_n_per_m, 'N/m')} ± {f(record.sigma_n_per_m, 'N/m')} "
            f"(standard uncertainty), smooth position error {known}",
        ),
        reasons=[*reasons, f"calibration record: {file}"],
        tables=[table("System stiffness (26)", by_name("run", fields.SYSTEM), rows)]
        if rows
        else [],
        simulated=record.simulated,
    )


def _length_told(found: Calibration) -> str:
    if (length := found.length) is not None:
        return (
            f"the smooth error stays alike over {f(length.length_n, 'N')}, between "
            f"{f(length.low_n, 'N')} and {f(length.high_n, 'N')} by the misfits of the runs"
        )
    stated = found.record.smooth_length_n
    taken = (
        f"{f(stated, 'N')} as the plan states"
        if stated is not None
        else "every length from a twelfth to two thirds of the peak force, the worst counts"
    )
    return f"how far in force the smooth error stays alike is not determined by the runs: {taken}"


def _table_told(found: Calibration) -> str:
    record = found.record
    if not record.deflection_force_n:
        return (
            f"no table of the deflection: {found.table_problem}; K_s alone counts as known to 5 % "
            "at the best"
        )
    rows = record.deflection_force_n
    return (
        f"table of the deflection in {len(rows)} rows from {f(rows[0], 'N')} to "
        f"{f(rows[-1], 'N')}, each ± {f(max(record.deflection_sigma_m), 'm')} (standard "
        f"uncertainty), {record.deflection_common:.1%} common to all"
    )


def calibration_data(found: Calibration) -> dict[str, Any]:
    """A calibration for programs."""
    return {
        "simulated": found.record.simulated,
        "calibration": found.record,
        "runs": [
            {"path": run.path, "run_id": run.metadata.get("run_id"), **system_data(fit)}
            for run, fit in zip(found.runs, found.fits, strict=False)
        ],
        "pooled": found.pooled,
        "two_spheres": found.spheres,
    }
