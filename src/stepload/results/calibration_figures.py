"""Figures of a calibration: its runs in one plot, the misfit of their lines, the table."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.estimators.smooth import NORMAL_95
from stepload.plan.calibration import CalibrationRecord
from stepload.results.calibration import Calibration
from stepload.results.comparison_figures import COLOURS, MOST_NAMES
from stepload.results.figures import (
    BLUE,
    GREY,
    INK,
    MOST_DOTS,
    figure_of,
    plain,
    svg_of,
)
from stepload.results.model import Figure
from stepload.units import format_quantity as f

SHEET = "travel"
"""The figure of the first sheet."""
Named = tuple[str, FloatArray, FloatArray]
"""Name of a run, force and travel or misfit (N,) each."""


def figures_of(found: Calibration) -> list[Figure]:
    """The figures of a calibration, drawn on demand; the first is the sheet's."""
    stiffness = found.record.stiffness_n_per_m
    made = [
        Figure(
            SHEET, "Force against travel",
            f"First loading of every run, and the line of K_s = {f(stiffness, 'N/m')} through the "
            "middle of the first one.",
            "force over travel of every run", partial(_travel, _loadings(found), stiffness),
        )
    ]  # fmt: skip
    if found.fits:
        misfits = [
            (run.name, fit.misfit_force_n, fit.misfit_m)
            for run, fit in zip(found.runs, found.fits, strict=True)
        ]
        made.append(
            Figure(
                "misfit", "What the lines leave",
                "Travel less the fitted line (26), over the forces of the fit, run by run. What "
                "all runs share repeats, and cancels where runs are compared.",
                "misfit of every run over force", partial(_misfits, misfits),
            )
        )  # fmt: skip
    if found.pooled is not None and len(found.fits) > 1:
        rows = [
            (run.name, fit.stiffness_n_per_m, NORMAL_95 * fit.sigma_n_per_m)
            for run, fit in zip(found.runs, found.fits, strict=True)
        ]
        pooled = found.pooled
        rows.append(("all", pooled.stiffness_n_per_m, NORMAL_95 * pooled.sigma_n_per_m))
        made.append(
            Figure(
                "stiffness", "K_s of every run",
                "With its 95 % interval; the last one is what the record says.",
                "system stiffness of every run with intervals", partial(_stiffnesses, rows),
            )
        )  # fmt: skip
    if found.record.deflection_force_n:
        made.append(
            Figure(
                "deflection", "Table of the deflection less the line",
                "Deflection of the table less F/K_s, with ± 1.96 of the standard uncertainty of "
                "each row; what all rows have in common is not in it.",
                "deflection of the system less its line over force",
                partial(_deflection, found.record),
            )
        )  # fmt: skip
    return made


def _loadings(found: Calibration) -> list[Named]:
    """Force and travel of the first loading of every run that has one."""
    return [
        (run.name, run.data.force_n[loading], run.data.travel_m[loading])
        for run in found.runs
        if (loading := run.data.first_loading()).any()
    ]


def _travel(runs: Sequence[Named], stiffness_n_per_m: float) -> str:
    with figure_of(3.2, width=5.4) as (figure, (axes,)):
        for index, (name, force, travel) in enumerate(runs):
            step = max(1, len(runs) * len(force) // MOST_DOTS)
            colour = COLOURS[index % len(COLOURS)]
            axes.plot(
                travel[::step] * 1e6, force[::step], ".", ms=2, color=colour, label=plain(name)
            )
        if runs:
            _, force, travel = runs[0]
            middle_n, middle_m = float(np.median(force)), float(np.median(travel))
            ends_n = np.array([0.0, float(force.max())])
            ends_m = middle_m + (ends_n - middle_n) / stiffness_n_per_m
            axes.plot(ends_m * 1e6, ends_n, "--", color=INK, lw=1.0, label="K_s")
        axes.set(xlabel="travel since touch [µm]", ylabel="force [N]")
        if 0 < len(runs) <= MOST_NAMES:
            axes.legend(loc="upper left", markerscale=4, fontsize=8)
        return svg_of(figure)


def _misfits(runs: Sequence[Named]) -> str:
    with figure_of(3.0) as (figure, (axes,)):
        for index, (name, force, misfit) in enumerate(runs):
            colour = COLOURS[index % len(COLOURS)]
            axes.plot(force, misfit * 1e6, ".-", ms=4, lw=0.8, color=colour, label=plain(name))
        axes.axhline(0.0, color=INK, lw=0.8)
        axes.set(xlabel="force [N]", ylabel="travel − line [µm]")
        if len(runs) <= MOST_NAMES:
            axes.legend(loc="best", fontsize=8)
        return svg_of(figure)


def _stiffnesses(rows: Sequence[tuple[str, float, float]]) -> str:
    with figure_of(1.2 + 0.4 * len(rows)) as (figure, (axes,)):
        for place, (_, value, half) in enumerate(rows):
            colour = INK if place == len(rows) - 1 else BLUE
            ends = [(value - half) * 1e-6, (value + half) * 1e-6]
            axes.plot(ends, [place, place], color=colour, lw=2.5, alpha=0.5)
            axes.plot([value * 1e-6], [place], "o", ms=6, color=colour)
        axes.set_yticks(range(len(rows)), [plain(name) for name, _, _ in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlabel("K_s [N/µm]")
        return svg_of(figure)


def _deflection(record: CalibrationRecord) -> str:
    force, deflection, sigma = (
        np.array(each)
        for each in (record.deflection_force_n, record.deflection_m, record.deflection_sigma_m)
    )
    bend = (deflection - force / record.stiffness_n_per_m) * 1e6
    half = NORMAL_95 * sigma * 1e6
    with figure_of(3.0) as (figure, (axes,)):
        axes.fill_between(force, bend - half, bend + half, color=BLUE, alpha=0.15, lw=0)
        axes.plot(force, bend, ".-", color=BLUE)
        axes.axhline(0.0, color=GREY, lw=0.8)
        axes.set(xlabel="force [N]", ylabel="deflection − F/K_s [µm]")
        return svg_of(figure)
