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
    )


def calibration_data(found: Calibration) -> dict[str, Any]:
    """A calibration for programs."""
    return {
        "calibration": found.record,
        "runs": [
            {"path": run.path, "run_id": run.metadata.get("run_id"), **system_data(fit)}
            for run, fit in zip(found.runs, found.fits, strict=False)
        ],
        "pooled": found.pooled,
        "two_spheres": found.spheres,
    }
