"""A batch for people: tables, sentences and the control chart."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from stepload.report import figures
from stepload.report.batch import MOODS, Batch, Specimen
from stepload.report.batch_statistics import ALPHA, MEANINGS, GaugeLine, Source
from stepload.report.identified import Line
from stepload.report.model import Document, Figure, Table, Verdict
from stepload.report.provenance import runs_table
from stepload.report.rows import cells, table
from stepload.report.run_record import SavedRun
from stepload.units import format_quantity as f


def batch_document(found: Batch, runs: Sequence[SavedRun]) -> Document:
    """A batch for people; `runs` are its runs."""
    drawn = Figure(
        "chart", "Control chart",
        "Chord stiffness of each specimen in the order of pressing, and the moving range. Dashed:"
        " limits of the chart. Dotted: limits of the plan. Red: what stands out.",
        "chord stiffness and moving range of every specimen with their limits",
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
    """Which specimens are outside, which stand out and by what; jumps, a trend."""
    groups = {
        "outside the limits": [e.name for e in found.specimens if e.limits == "outside"],
        "the interval crosses a limit": [e.name for e in found.specimens if e.limits == "unclear"],
    }
    for rule, meaning in MEANINGS.items():
        groups[f"{rule}, {meaning}"] = [e.name for e in found.specimens if rule in e.broken]
    if found.chart:
        pairs = [[found.specimens[at - i].name for i in (2, 1)] for at in found.chart.jumps]
        groups["moving range above its limit"] = [" to ".join(pair) for pair in pairs]
    yield from (f"{word}: {', '.join(names)}" for word, names in groups.items() if names)
    if (trend := found.trend) and trend.rank_p < ALPHA:
        yield f"trend of {f(trend.slope_n_per_m, 'N/m')} a specimen, p = {trend.rank_p:.2g}"


def _tables(found: Batch) -> list[Table]:
    made = table(
        f"Chord stiffness, {f(found.from_n, 'N')} to {f(found.to_n, 'N')}",
        Specimen, found.specimens,
    )  # fmt: skip
    plain = {"runs": {"1"}, "stands out by": {""}, "limits": {""}}
    kept = [at for at, name in enumerate(made.columns)
            if {row[at] for row in made.rows} != plain.get(name)]  # fmt: skip
    rows = [[row[at] for at in kept] for row in made.rows]
    parts = (found.mean, found.trend, found.chart, found.capability)
    figures_ = [line for part in parts if part is not None for line in cells(type(part), part)]
    tables = [
        Table(made.title, [made.columns[at] for at in kept], rows),
        Table("All specimens", ("figure", "value"), figures_),
    ]
    if found.mean is not None:
        tables.append(table("What all specimens share", Line, found.mean.lines, page_only=True))
    if (gauge := found.gauge) is not None:
        pooled = "INT counts as EV" if gauge.pooled else "INT is kept apart"
        note = f"{gauge.operators} operators, {gauge.trials} trials; {pooled}; ndc {gauge.ndc}."
        tables += [
            table("Gauge R&R", GaugeLine, gauge.lines, [note]),
            table("Analysis of variance", Source, gauge.sources, page_only=True),
        ]
    return tables


def _draw(found: Batch) -> str:
    chart = found.chart
    assert chart is not None
    values = np.array([each.value_n_per_m for each in found.specimens]) * 1e-6
    at, ranges = np.arange(1, values.size + 1), np.abs(np.diff(values))
    with figures.figure_of(4.6, rows=2) as (drawn, (upper, lower)):
        for axes, x, y, centre, limits in (
            (upper, at, values, chart.centre_n_per_m, chart.limits_n_per_m),
            (lower, at[1:], ranges, chart.mean_range_n_per_m, (chart.range_high_n_per_m,)),
        ):
            axes.plot(x, y, "o-", color=figures.BLUE, ms=4)
            axes.axhline(centre * 1e-6, color=figures.GREY, lw=0.9)
            for limit in limits:
                axes.axhline(limit * 1e-6, color=figures.INK, lw=0.9, ls="--")
        for stated in (found.chord_min_n_per_m, found.chord_max_n_per_m):
            if stated is not None:
                upper.axhline(stated * 1e-6, color=figures.GREEN, ls=":")
        for jump in chart.jumps:
            lower.plot([jump], [ranges[jump - 2]], "o", color=figures.RED, ms=6)
        for each, y in zip(found.specimens, values, strict=True):
            if each.broken:
                upper.plot([each.number], [y], "o", color=figures.RED, ms=6)
                away = 5 if y * 1e6 > chart.centre_n_per_m else -12
                upper.annotate(
                    figures.plain(f"{each.name}: {', '.join(each.broken)}"), (each.number, y),
                    textcoords="offset points", xytext=(4, away), color=figures.RED, fontsize=8,
                )  # fmt: skip
        upper.set_ylabel("chord [N/µm]")
        lower.set(xlabel="specimen, in the order of pressing", ylabel="moving range [N/µm]")
        lower.set_ylim(bottom=0.0)
        lower.locator_params(axis="x", integer=True)
        return figures.svg_of(drawn)
