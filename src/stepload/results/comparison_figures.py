"""Figures of a comparison, their captions, and how they are drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

from stepload.estimators.compare import Band
from stepload.estimators.fit import FloatArray
from stepload.results.comparison import ComparedRun, Comparison, virgin_band
from stepload.results.figures import (
    BLUE,
    GREEN,
    GREY,
    INK,
    MOST_DOTS,
    ORANGE,
    RED,
    figure_of,
    plain,
    svg_of,
)
from stepload.results.model import Figure
from stepload.units import format_quantity as f

LAWS = "laws"
MOST_NAMES = 14
"""Largest number of runs with an entry in the legend; more cannot be distinguished by colour."""
COLOURS = (BLUE, ORANGE, GREEN, RED, INK, GREY)


def figures_of(found: Comparison) -> list[Figure]:
    """The figures of a comparison, drawn on demand."""
    known = {each.run.name: virgin_band(each) for each in found.runs}
    laws = {name: band for name, band in known.items() if band is not None}
    made = []
    imported = None
    if found.curve:
        first = found.curve[0].result
        imported = first.band.deformation_m, first.curve_n
    # Deformation from the believed zero, and force, of the points that every fit used.
    points = {
        each.run.name: (each.found.deformation_m - each.found.fit.zero_m, each.found.force_n)
        for each in found.runs
    }
    if laws:
        made.append(
            Figure(
                LAWS, "Force against deformation",
                "Believed laws from their own zeros, 95 % bands, what was measured"
                + ("; the curve is corrected for its modulus." if imported else "."),
                "force over deformation with confidence bands",
                partial(_bands, laws, points, imported),
            )
        )  # fmt: skip
    made.append(
        Figure(
            "secants", f"Secant stiffness at {f(found.secant_force_n, 'N')}",
            "Believed fit with its 95 % interval; small marks are the cycles by themselves. The "
            "interval holds what all runs have in common, the marks do not.",
            "secant stiffness of every run with intervals",
            partial(_secants, found.runs),
        )
    )  # fmt: skip
    return made


def _bands(
    runs: Mapping[str, Band],
    points: Mapping[str, tuple[FloatArray, FloatArray]],
    imported: tuple[FloatArray, FloatArray] | None = None,
) -> str:
    """Believed laws with their 95 % bands over the measured points, and an imported curve
    (deformation, force) as larger points."""
    with figure_of(3.8) as (figure, (axes,)):
        for index, (name, run) in enumerate(runs.items()):
            colour = COLOURS[index % len(COLOURS)]
            x, y = points[name]
            step = max(1, len(runs) * len(y) // MOST_DOTS)
            axes.plot(x[::step] * 1e6, y[::step], ".", ms=2.0, color=colour, alpha=0.5)
            micrometres = run.deformation_m * 1e6
            axes.fill_between(micrometres, run.lower_n, run.upper_n, color=colour, alpha=0.15, lw=0)
            axes.plot(micrometres, run.force_n, color=colour, label=plain(name))
        if imported is not None:
            axes.plot(imported[0] * 1e6, imported[1], ".", ms=5, color=INK, label="imported curve")
        axes.set(xlabel="payload deformation from its zero [µm]", ylabel="force [N]")
        tops = [float(run.force_n[-1]) for run in runs.values()]
        if imported is not None:
            tops.append(float(imported[1].max()))
        axes.set_ylim(0.0, 1.15 * max(tops))
        if len(runs) <= MOST_NAMES:
            axes.legend(loc="upper left", fontsize=9 if len(runs) < 8 else 7)
        return svg_of(figure)


def _secants(runs: Sequence[ComparedRun]) -> str:
    """Believed secant stiffness of every run with its 95 % interval; its cycles as small marks."""
    with figure_of(1.2 + 0.45 * len(runs)) as (figure, (axes,)):
        for row, each in enumerate(runs):
            found = each.found
            if (interval := found.interval_secant_n_per_m) is not None:
                ends = [end * 1e-6 for end in interval]
                axes.plot(ends, [row, row], color=BLUE, lw=2.5, alpha=0.5)
            cycles = [fits[found.believe] for fits in each.cycles.values() if found.believe in fits]
            marks = [fit.secant_n_per_m * 1e-6 for fit in cycles]
            axes.plot(marks, [row] * len(marks), "|", ms=9, color=ORANGE)
            axes.plot([found.fit.secant_n_per_m * 1e-6], [row], "o", ms=6, color=BLUE)
        axes.set_yticks(range(len(runs)), [plain(each.run.name) for each in runs])
        axes.set_ylim(len(runs) - 0.5, -0.5)
        axes.set_xlabel("secant stiffness [N/µm]")
        return svg_of(figure)
