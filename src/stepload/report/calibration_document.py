"""A calibration as a document for people and as an object for programs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from stepload.identification.smooth import NORMAL_95
from stepload.plan.calibration import CalibrationRecord
from stepload.record.plain import plain
from stepload.report import figures
from stepload.report.calibration import Calibration
from stepload.report.certificate import NOT_STATED, few, shared_facts, short, stated
from stepload.report.model import (
    Certificate,
    Document,
    Figure,
    Table,
    Verdict,
    first_rows,
)
from stepload.report.provenance import runs_table
from stepload.report.rows import Row, data, figure, in_one_unit, schema_of, table
from stepload.report.run_figures import misfit_figure
from stepload.report.run_results import SystemRun, SystemStiffness, smooth_error, system_data
from stepload.units import format_quantity as f
from stepload.units import percent


def calibration_document(found: Calibration, file: Path) -> Document:
    """A calibration whose record was written to `file`, for people."""
    record, reasons = found.record, _reasons(found)
    rows = [
        {"run": run.name, **system_data(fit)}
        for run, fit in zip(found.runs, found.fits, strict=False)
    ]
    known = smooth_error(record.smooth_error_m or 0.0, record.smooth_degrees)
    reasons.append(f"calibration record: {file}")
    shown = [table("System stiffness (26)", SystemRun, rows)] if rows else []
    return Document(
        title="Calibration",
        subtitle=f"{record.rig} · {record.measured_on} · {record.run}",
        verdict=Verdict(
            "good",
            "calibrated",
            f"K_s = {f(record.stiffness_n_per_m, 'N/m')} ± {f(record.sigma_n_per_m, 'N/m')} "
            f"(standard uncertainty), smooth position error {known}",
        ),
        reasons=reasons,
        tables=[*shown, runs_table(found.runs)],
        figures=_figures(found),
        texts=[(file.name, file.read_text(encoding="utf-8"))] if file.is_file() else (),
        simulated=record.simulated,
        certificate=_sheet(found, reasons, shown),
    )


def _reasons(found: Calibration) -> list[str]:
    """What the runs say of their K_s, and where the record is valid."""
    record, told = found.record, list[str]()
    if (pooled := found.pooled) is not None:
        if pooled.runs > 1:
            told.append(
                f"{pooled.runs} runs count as {pooled.independent_runs:.1f}: their misfits "
                f"correlate by {pooled.misfit_correlation:+.2f}; they scatter {pooled.scatter:.2f} "
                "times as much as their uncertainties say"
            )
        told.append(_length_told(found))
    told.append(_table_told(found))
    if record.across_told:
        told.append(record.across_told)
    told.append(
        f"for {record.rig}, pose {record.pose or 'not stated'!r}, direction {record.direction}, "
        f"valid until {record.valid_until}"
    )
    if record.simulated:
        told.append("made in a dry run: good for dry runs only")
    return told


def _sheet(found: Calibration, reasons: Sequence[str], tables: Sequence[Table]) -> Certificate:
    """The first sheet of a calibration."""
    record = found.record
    celsius = record.temperature_c
    stiffness = record.stiffness_n_per_m
    return Certificate(
        heading="Calibration of the system stiffness of a rig",
        facts=(
            [
                ("Rig", short(record.rig)),
                ("Pose", stated(record.pose)),
                ("Direction", record.direction),
                ("Temperature", NOT_STATED if celsius is None else f"{celsius:.4g} °C"),
                ("Measured on", f"{record.measured_on}"),
                ("Valid until", f"{record.valid_until}"),
            ],
            [
                *shared_facts(found.runs, "payload", "arm", "force_sensor", "operator"),
                ("Forces", f"{f(record.force_from_n, 'N')} to {f(record.force_to_n, 'N')}"),
                ("Runs", f"{len(found.runs)}"),
            ],
        ),
        tables=[_figures_table(record), *(first_rows(each) for each in tables)],
        figure=Figure(
            "travel", "Force against travel",
            f"First loading of every run, and the line of K_s = {f(stiffness, 'N/m')} through the "
            "middle of the first one.",
            "force over travel of every run", partial(_travel, found),
        ),
        remarks=few(reasons),
        signatures=(("Calibrated by", ""), ("Checked by", "")),
        foot=f"{record.software} · calibration of {short(record.rig)}",
    )  # fmt: skip


def _figures_table(record: CalibrationRecord) -> Table:
    half = NORMAL_95 * record.sigma_n_per_m
    stiffness = record.stiffness_n_per_m
    shown, ends = in_one_unit((stiffness - half, stiffness + half), "N/m", stiffness)
    rows = [
        ("K_s (26)", shown, f(record.sigma_n_per_m, "N/m"), ends),
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
        f"uncertainty), {percent(record.deflection_common, 2)} common to all"
    )


def _travel(found: Calibration) -> str:
    """First loading of every run, and the line of K_s."""
    curves = list[figures.Line]()
    for index, run in enumerate(found.runs):
        loading = run.data.first_loading()
        if loading.any():
            travel_m, force_n = run.data.travel_m[loading], run.data.force_n[loading]
            step = max(1, len(found.runs) * len(force_n) // figures.MOST_DOTS)
            name = figures.plain(run.name)
            style = {"ms": 2.0, "color": figures.colour(index), "alpha": 0.6, "label": name}
            curves.append((travel_m[::step] * 1e6, force_n[::step], ".", style))
            if len(curves) == 1:
                ends_n = np.array([0.0, float(force_n.max())])
                slope = found.record.stiffness_n_per_m
                middle_m, middle_n = float(np.median(travel_m)), float(np.median(force_n))
                ends_m = middle_m + (ends_n - middle_n) / slope
    if curves:
        curves.append((ends_m * 1e6, ends_n, "--", {"color": figures.INK, "label": "K_s"}))
    few_runs = len(found.runs) <= figures.MOST_NAMES
    return figures.lines(
        curves, "travel since touch [µm]", "force [N]", height=3.4, legend=few_runs
    )


def _figures(found: Calibration) -> list[Figure]:
    """The other figures of a calibration, drawn on demand."""
    made, record = list[Figure](), found.record
    fits = list(zip(found.runs, found.fits, strict=False))
    if fits:
        misfits = [(run.name, fit.misfit_force_n, fit.misfit_m) for run, fit in fits]
        made.append(misfit_figure(misfits))
    if found.pooled is not None and len(fits) > 1:
        every = [(run.name, fit.stiffness_n_per_m, fit.sigma_n_per_m) for run, fit in fits]
        every.append(("all", found.pooled.stiffness_n_per_m, found.pooled.sigma_n_per_m))
        rows = [(name, k, k - NORMAL_95 * u, k + NORMAL_95 * u) for name, k, u in every]
        made.append(
            Figure(
                "stiffness", "K_s of every run",
                "With its 95 % interval; the last one is what the record says.",
                "system stiffness of every run with intervals",
                partial(figures.intervals, rows, "K_s [N/µm]"),
            )
        )  # fmt: skip
    if record.deflection_force_n:
        made.append(
            Figure(
                "deflection", "Table of the deflection less the line",
                "Deflection of the table less F/K_s, with ± 1.96 of the standard uncertainty of "
                "each row; what all rows have in common is not in it.",
                "deflection of the system less its line over force", partial(_deflection, record),
            )
        )  # fmt: skip
    return made


def _deflection(record: CalibrationRecord) -> str:
    force_n = np.array(record.deflection_force_n)
    bend = (np.array(record.deflection_m) - force_n / record.stiffness_n_per_m) * 1e6
    half = NORMAL_95 * np.array(record.deflection_sigma_m) * 1e6
    curves = [
        (force_n, bend, ".-", {"color": figures.BLUE}),
        (force_n, bend - half, ":", {"color": figures.BLUE}),
        (force_n, bend + half, ":", {"color": figures.BLUE}),
    ]
    return figures.lines(curves, "force [N]", "deflection − F/K_s [µm]", zero=True)


class CalibratedRun(SystemStiffness):
    """K_s of one run."""

    path: Path = figure("Its record.")
    run_id: str | None = figure("Twelve hexadecimal digits.")


class Pooled(Row):
    """K_s of all runs together."""

    stiffness_n_per_m: float = figure("K_s.")
    sigma_n_per_m: float = figure("Its standard uncertainty.")
    msde_m: float = figure("Rms misfit of the runs.")
    smooth_error_m: float = figure("Rms smooth error of the runs.")
    smooth_degrees: float | None = figure("Its degrees of freedom.")
    damping_lower_bound_n_s_per_m: float | None = figure("Lower bound of the damping C_s.")
    force_range_n: tuple[float, float] = figure("Forces common to all runs.")
    runs: int = figure("Number of runs.")
    independent_runs: float = figure("Number of independent runs that they count as.")
    misfit_correlation: float = figure("Mean correlation of the misfits of two runs.")
    scatter: float = figure("Of the runs, over their own uncertainties.")


class CalibrationRow(Row):
    """JSON of `stepload calibrate` (which adds `record`), version 1. SI units; NaN is null."""

    simulated: bool = figure("Whether simulated devices made the data.")
    calibration: dict[str, Any] = figure("The calibration record, SI units in its keys.")
    runs: tuple[CalibratedRun, ...] = figure("K_s of every run.")
    pooled: Pooled | None = figure("K_s of all runs together.")


def calibration_schema() -> dict[str, Any]:
    """The JSON Schema of a calibration."""
    return schema_of(CalibrationRow, "calibration")


def calibration_data(found: Calibration) -> dict[str, Any]:
    """A calibration for programs."""
    return data(CalibrationRow, {
        "simulated": found.record.simulated,
        "calibration": plain(found.record),
        "runs": [
            {"path": run.path, "run_id": run.metadata.get("run_id"), **system_data(fit)}
            for run, fit in zip(found.runs, found.fits, strict=False)
        ],
        "pooled": found.pooled,
    })  # fmt: skip
