"""A batch for people: tables, sentences and the control chart."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from stepload.report import figures
from stepload.report.batch import MOODS, Batch, Specimen
from stepload.report.batch_statistics import ALPHA, GaugeLine
from stepload.report.model import Document, Figure, Table, Verdict
from stepload.report.provenance import runs_table
from stepload.report.rows import cells, table
from stepload.report.run_record import SavedRun
from stepload.units import format_quantity as f

MEANINGS = {
    "outside": "outside the limits",
    "unclear": "the interval crosses a limit",
    "WE1": "WE1, beyond 3 σ",
    "WE2": "WE2, two of three beyond 2 σ on one side",
    "WE3": "WE3, four of five beyond 1 σ on one side",
    "WE4": "WE4, eight in a row on one side",
    "ESD": "ESD, outlier by the generalised ESD test at 5 %",
}


def batch_document(found: Batch, runs: Sequence[SavedRun]) -> Document:
    """A batch for people; `runs` are its runs."""
    drawn = Figure(
        "chart", "Control chart",
        "Chord stiffness of each specimen in the order of pressing. Dashed: limits of the chart."
        " Dotted: limits of the plan. Red: what stands out.",
        "chord stiffness of every specimen with its limits",
        partial(_draw, found),
    )  # fmt: skip
    return Document(
        title=found.name,
        subtitle=found.payload,
        verdict=Verdict(MOODS[found.verdict], found.verdict, found.headline),
        reasons=[*_reasons(found), *found.notes],
        tables=[*_tables(found), runs_table(runs)],
        figures=[drawn] if found.chart else [],
        simulated=found.simulated,
    )


def _reasons(found: Batch) -> Iterator[str]:
    """Which specimens are outside, which stand out and by what; a trend."""
    for word, meaning in MEANINGS.items():
        if names := [e.name for e in found.specimens if word in (e.limits, *e.broken)]:
            yield f"{meaning}: {', '.join(names)}"
    if (trend := found.trend) and trend.rank_p < ALPHA:
        yield f"trend of {f(trend.slope_n_per_m, 'N/m')} a specimen, p = {trend.rank_p:.2g}"


def _tables(found: Batch) -> Iterator[Table]:
    title = f"Chord stiffness, {f(found.from_n, 'N')} to {f(found.to_n, 'N')}"
    yield table(title, Specimen, found.specimens)
    parts = (found.mean, found.trend, found.chart, found.capability)
    rows = [line for part in parts if part is not None for line in cells(type(part), part)]
    yield Table(f"{title}, all specimens", ("figure", "value"), rows)
    if (gauge := found.gauge) is not None:
        pooled = "INT counts as EV" if gauge.pooled else "INT is kept apart"
        note = f"{gauge.operators} operators, {gauge.trials} trials; {pooled}; ndc {gauge.ndc}."
        yield table("Gauge R&R of the chord stiffness", GaugeLine, gauge.lines, [note])


def _draw(found: Batch) -> str:
    chart = found.chart
    assert chart is not None
    at = [each.number for each in found.specimens]
    values = [each.value_n_per_m * 1e-6 for each in found.specimens]
    with figures.figure_of(3.2) as (drawn, (axes,)):
        axes.plot(at, values, "o-", color=figures.BLUE, ms=4)
        axes.axhline(chart.centre_n_per_m * 1e-6, color=figures.GREY, lw=0.9)
        for limit in chart.limits_n_per_m:
            axes.axhline(limit * 1e-6, color=figures.INK, lw=0.9, ls="--")
        for stated in filter(None, (found.chord_min_n_per_m, found.chord_max_n_per_m)):
            axes.axhline(stated * 1e-6, color=figures.GREEN, ls=":")
        for each, y in zip(found.specimens, values, strict=True):
            if each.broken:
                axes.plot([each.number], [y], "o", color=figures.RED, ms=6)
                axes.annotate(
                    figures.plain(f"{each.name}: {', '.join(each.broken)}"), (each.number, y),
                    textcoords="offset points", xytext=(4, 5), color=figures.RED, fontsize=8,
                )  # fmt: skip
        axes.set(xlabel="specimen, in the order of pressing", ylabel="chord stiffness [N/µm]")
        axes.locator_params(axis="x", integer=True)
        return figures.svg_of(drawn)
