"""A calibration as a document for people and as an object for programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from stepload.estimators.smooth import NORMAL_95
from stepload.plan.calibration import CalibrationRecord
from stepload.results import fields
from stepload.results.calibration import Calibration
from stepload.results.calibration_figures import SHEET, figures_of
from stepload.results.certificate import NOT_STATED, Facts, few, shared, short, stated
from stepload.results.data import system_data
from stepload.results.equations import equation_table
from stepload.results.model import (
    Certificate,
    Document,
    Figure,
    Table,
    Verdict,
    by_name,
    first_rows,
    interval,
    table,
)
from stepload.results.provenance import runs_table
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
    if record.across_told:
        reasons.append(record.across_told)
    reasons.append(
        f"for {record.rig}, pose {record.pose or 'not stated'!r}, direction {record.direction}, "
        f"valid until {record.valid_until}"
    )
    if record.simulated:
        reasons.append("made in a dry run: good for dry runs only")
    rows = [(run.name, fit) for run, fit in zip(found.runs, found.fits, strict=False)]
    known = fields.smooth_error(record.smooth_error_m or 0.0, record.smooth_degrees)
    reasons.append(f"calibration record: {file}")
    shown = [table("System stiffness (26)", by_name("run", fields.SYSTEM), rows)] if rows else []
    pictures = figures_of(found)
    document = Document(
        title="Calibration",
        subtitle=f"{record.rig} · {record.measured_on} · {record.run}",
        verdict=Verdict(
            "good",
            "calibrated",
            f"K_s = {f(record.stiffness_n_per_m, 'N/m')} ± {f(record.sigma_n_per_m, 'N/m')} "
            f"(standard uncertainty), smooth position error {known}",
        ),
        reasons=reasons,
        tables=shown,
        figures=[each for each in pictures if each.name != SHEET],
        texts=[(file.name, file.read_text(encoding="utf-8"))] if file.is_file() else (),
        simulated=record.simulated,
        certificate=_sheet(found, reasons, shown, pictures[0]),
    )
    return replace(document, tables=[*shown, runs_table(found.runs), equation_table(document)])


def _sheet(
    found: Calibration, reasons: Sequence[str], tables: Sequence[Table], figure: Figure
) -> Certificate:
    """The first sheet of a calibration."""
    record = found.record
    celsius = record.temperature_c
    where: Facts = [
        ("Rig", short(record.rig)),
        ("Pose", stated(record.pose)),
        ("Direction", record.direction),
        ("Temperature", NOT_STATED if celsius is None else f"{celsius:.4g} °C"),
        ("Measured on", f"{record.measured_on}"),
        ("Valid until", f"{record.valid_until}"),
    ]
    told = [run.metadata for run in found.runs]

    def common(key: str) -> str:
        return shared(each.get(key, "") for each in told)

    what: Facts = [
        ("Pressed on", common("payload")),
        ("Arm", common("arm")),
        ("Force sensor", common("force_sensor")),
        ("Forces", f"{f(record.force_from_n, 'N')} to {f(record.force_to_n, 'N')}"),
        ("Runs", f"{len(found.runs)}"),
        ("Operator", common("operator")),
    ]
    return Certificate(
        heading="Calibration of the system stiffness of a rig",
        facts=(where, what),
        tables=[_figures_table(record), *(first_rows(each) for each in tables)],
        figure=figure,
        remarks=few(reasons),
        signatures=(("Calibrated by", ""), ("Checked by", "")),
        foot=f"{record.software} · calibration of {short(record.rig)}",
    )


def _figures_table(record: CalibrationRecord) -> Table:
    half = NORMAL_95 * record.sigma_n_per_m
    low, high = record.stiffness_n_per_m - half, record.stiffness_n_per_m + half
    rows = [
        ("K_s (26)", f(record.stiffness_n_per_m, "N/m"), f(record.sigma_n_per_m, "N/m"),
         interval("N/m")((low, high))),
        ("MSDE, rms misfit of the line", f(record.msde_m, "m"), "", ""),
        ("C_s, lower bound", f"{record.damping_n_s_per_m:.3g} N s/m", "", ""),
    ]  # fmt: skip
    columns = ("result", "value", "standard uncertainty", "95 % interval")
    return Table("Result", columns, rows)


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
    }
