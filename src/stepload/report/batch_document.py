"""A batch for people: tables, sentences and the control chart."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from stepload.report import figures
from stepload.report.batch import MOODS, Batch, Specimen
from stepload.report.batch_statistics import ALPHA, MEANINGS, SIGMAS, Source
from stepload.report.identified import Line
from stepload.report.model import NOTHING, Document, Figure, Table, Verdict
from stepload.report.provenance import runs_table
from stepload.report.rows import in_one_unit, table
from stepload.report.run_record import SavedRun
from stepload.units import format_quantity as f
from stepload.units import percent


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
        yield f"trend of {f(trend.slope, 'N/m')} a specimen, rank test p = {trend.rank_p:.2g}"


def _tables(found: Batch) -> list[Table]:
    span = f"{f(found.from_n, 'N')} to {f(found.to_n, 'N')}"
    made = table(f"Chord stiffness, {span}", Specimen, found.specimens)
    plain = {"runs": {"1"}, "stands out by": {""}, "limits": {""}}
    kept = [at for at, name in enumerate(made.columns)
            if {row[at] for row in made.rows} != plain.get(name)]  # fmt: skip
    columns, rows = [made.columns[at] for at in kept], [[row[at] for at in kept]
                                                        for row in made.rows]  # fmt: skip
    tables = [
        Table(made.title, columns, rows),
        Table("Over all specimens, those that stand out too", ("figure", "value", "by"),
              list(_summary(found))),
    ]  # fmt: skip
    if found.mean is not None:
        tables.append(table("What all specimens share", Line, found.mean.lines, page_only=True))
    return tables + _gauge_tables(found)


def _summary(found: Batch) -> Iterator[tuple[str, str, str]]:
    mean, chart, trend, capable = found.mean, found.chart, found.trend, found.capability
    if mean is None:
        return
    n, value = len(found.specimens), mean.value
    yield "mean", f(value, "N/m", 4), f"{n} specimens"
    yield "standard deviation", f(mean.sigma, "N/m"), percent(mean.sigma / value, 2)
    shared = ", ".join(line.source for line in mean.lines[:2]) or "nothing shared"
    for name, half, by in (
        ("scatter of the mean, 95 %", mean.scatter, f"Student's t, {n - 1} degrees"),
        ("common to all, 95 %", mean.common, shared),
        ("both, 95 %", mean.half, ""),
    ):
        yield name, f"±{percent(half / value, 2)}", by
    if trend is not None:
        ends = in_one_unit(trend.interval, "N/m")[1]
        yield "trend a specimen", f(trend.slope, "N/m"), f"{ends}, rank p = {trend.rank_p:.2g}"
    if chart is not None:
        limits = in_one_unit((chart.low, chart.high), "N/m")[1]
        yield "control limits", limits, "2.66 mean moving ranges"
        yield "limit of moving range", f(chart.range_high, "N/m"), "3.267 mean moving ranges"
    if capable is not None:
        low, high = capable.ppk_interval
        yield "Cp, Cpk", _pair(capable.cp, capable.cpk), "short-term σ, ISO 22514-2"
        yield "Pp, Ppk", _pair(capable.pp, capable.ppk), f"Ppk 95 % [{low:.2f}, {high:.2f}]"


def _pair(index: float | None, smaller: float) -> str:
    return f"{NOTHING if index is None else f'{index:.2f}'}, {smaller:.2f}"


def _gauge_tables(found: Batch) -> list[Table]:
    if (gauge := found.gauge) is None:
        return []
    low, high = found.chord_min_n_per_m, found.chord_max_n_per_m
    width = None if low is None or high is None else high - low
    rows = [
        (name, f(sigma, "N/m"), percent(sigma / gauge.tv, 3),
         percent(SIGMAS * sigma / width, 3) if width else NOTHING)
        for name, sigma in (
            ("EV, repeatability", gauge.ev), ("AV, reproducibility", gauge.av),
            ("operator × specimen", gauge.interaction), ("GRR", gauge.grr),
            ("PV, between specimens", gauge.pv), ("TV, total", gauge.tv),
        )
        if sigma is not None
    ]  # fmt: skip
    pooled = "counts as repeatability" if gauge.pooled else "is kept apart"
    note = (
        f"{gauge.operators} operators, {gauge.trials} trials; ndc {gauge.ndc}. "
        f"The interaction {pooled}."
    )
    columns = ("gauge R&R (AIAG)", "standard deviation", "of study", "of tolerance")
    variance = table("Analysis of variance", Source, gauge.sources, page_only=True)
    return [Table("Repeatability and reproducibility", columns, rows, [note]), variance]


def _draw(found: Batch) -> str:
    chart = found.chart
    assert chart is not None
    values = np.array([each.value_n_per_m for each in found.specimens]) * 1e-6
    at, ranges = np.arange(1, values.size + 1), np.abs(np.diff(values))
    with figures.figure_of(4.6, rows=2) as (drawn, (upper, lower)):
        for axes, x, y, centre, limits in (
            (upper, at, values, chart.centre, (chart.low, chart.high)),
            (lower, at[1:], ranges, chart.mean_range, (chart.range_high,)),
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
                upper.annotate(
                    figures.plain(f"{each.name}: {', '.join(each.broken)}"), (each.number, y),
                    textcoords="offset points", xytext=(4, 5), color=figures.RED, fontsize=8,
                )  # fmt: skip
        upper.set_ylabel("chord [N/µm]")
        lower.set(xlabel="specimen, in the order of pressing", ylabel="moving range [N/µm]")
        lower.set_ylim(bottom=0.0)
        return figures.svg_of(drawn)
