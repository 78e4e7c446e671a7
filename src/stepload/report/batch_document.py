"""A batch as a document for people and as an object for programs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator

import stepload
from stepload.report import figures
from stepload.report.batch import Batch, Group
from stepload.report.batch_statistics import MEANINGS, SIGMAS
from stepload.report.certificate import shared_facts
from stepload.report.identified import Line, Pair
from stepload.report.model import Certificate, Document, Figure, Table, Verdict
from stepload.report.provenance import runs_table
from stepload.report.rows import Cell, Row, data, figure, form, in_one_unit, schema_of, table
from stepload.units import format_quantity as f
from stepload.units import percent

FEWEST = 8
"""Specimens from which a control chart may say that nothing stands out."""


class SpecimenRow(Row):
    """One specimen, the mean of its runs."""

    number: int = figure("In the order of pressing, from 1.", "no")
    name: str = figure("Which piece.", "specimen")
    runs: int = figure("Runs of it that count.", "runs")
    value_n_per_m: Annotated[
        float, Cell(lambda row: in_one_unit(row.interval_n_per_m, "N/m", row.value_n_per_m)[0])
    ] = figure("Its chord stiffness.", "chord")
    interval_n_per_m: Annotated[
        Pair, Cell(lambda row: in_one_unit(row.interval_n_per_m, "N/m", row.value_n_per_m)[1])
    ] = figure("95 %, with what all specimens share.", "95 %")
    touch_m: float | None = figure("Travel of the arm at its first touch.", "touch")
    broken: Annotated[tuple[str, ...], ", ".join] = figure(
        "Rules that it breaks: WE1 to WE4, MR (control chart), ESD (outlier).", "stands out by"
    )
    limits: str = figure('inside, outside or unclear; "" where none are stated.', "limits")


class MeanRow(Row):
    """The mean over specimens."""

    value: float = figure("Mean of the chord stiffness in N/m.")
    sigma: float = figure("Standard deviation between specimens in N/m.")
    scatter: float = figure("95 % half width of the mean by that scatter, Student's t, in N/m.")
    common_half: float = figure("95 % half width of what all specimens share, in N/m.")
    half: float = figure("95 % half width of both together, in N/m.")
    common: tuple[Line, ...] = figure("What all specimens share, by source.")


class TrendRow(Row):
    """Straight line over the order of pressing."""

    slope: float = figure("Change of the chord stiffness from one specimen to the next, in N/m.")
    interval: Pair = figure("Its 95 % interval.")
    p: float = figure("Probability of such a slope without a trend.")
    rank_p: float = figure("The same by Kendall's rank correlation.")


class ChartRow(Row):
    """Individuals and moving-range chart; all in N/m."""

    centre: float = figure("Centre line.")
    low: float = figure("Lower limit: the centre less 3 mean moving ranges over 1.128.")
    high: float = figure("Upper limit.")
    mean_range: float = figure("Mean moving range.")
    range_high: float = figure("Upper limit of the moving range: 3.267 times its mean.")
    sigma: float = figure("Short-term standard deviation: the mean moving range over 1.128.")


class SourceRow(Row):
    """One line of the analysis of variance, chord stiffness in N/m."""

    name: str = figure("Source.", "source")
    degrees: int = figure("Of freedom.", "degrees of freedom")
    squares: Annotated[float, form(".4g")] = figure("Sum of squares.", "sum of squares")
    mean_square: Annotated[float | None, form(".4g")] = figure("Mean square.", "mean square")
    f: Annotated[float | None, form(".3f")] = figure("F.", "F")
    p: Annotated[float | None, form(".3f")] = figure("Its probability by chance.", "p")


class GaugeRow(Row):
    """Gauge R&R by analysis of variance, AIAG MSA, 4th edition; standard deviations in N/m."""

    parts: int = figure("Specimens.")
    operators: int = figure("Operators.")
    trials: int = figure("Presses of each specimen by each operator.")
    pooled: bool = figure("Whether the interaction counts as repeatability: its p is above 0.25.")
    ev: float = figure("Repeatability.")
    av: float | None = figure("Reproducibility; null with one operator.")
    interaction: float | None = figure("Operator × specimen.")
    grr: float = figure("Repeatability and reproducibility.")
    pv: float = figure("Between specimens.")
    tv: float = figure("Total.")
    ndc: int = figure("Number of distinct categories.")
    sources: tuple[SourceRow, ...] = figure("Analysis of variance, before pooling.")


class CapabilityRow(Row):
    """Capability and performance, ISO 22514-2; null where a limit is not stated."""

    cp: float | None = figure("Capability index, short-term σ.")
    cpk: float = figure("Smaller capability index.")
    pp: float | None = figure("Performance index, standard deviation of all.")
    ppk: float = figure("Smaller performance index.")
    ppk_interval: Pair = figure("95 % interval of Ppk.")


class AcceptanceRow(Row):
    """Limits of a sound specimen."""

    chord_min_n_per_m: float | None = figure("Smallest chord stiffness.")
    chord_max_n_per_m: float | None = figure("Largest chord stiffness.")


class GroupRow(Row):
    """The specimens of one payload."""

    payload: str = figure("Name of the payload.")
    from_n: float = figure("Lower force of all chords.", at="pressed.0.chord.from_n")
    to_n: float = figure("Upper force.", at="pressed.0.chord.to_n")
    specimens: tuple[SpecimenRow, ...] = figure("In the order of pressing.")
    mean: MeanRow | None = figure("Null for one specimen.")
    trend: TrendRow | None = figure("Null for fewer than four specimens.")
    chart: ChartRow | None = figure("Null for one specimen.")
    gauge: GaugeRow | None = figure("Null where no specimen was pressed again.")
    no_gauge: str = figure("Why there is none though a specimen was pressed again.")
    capability: CapabilityRow | None = figure("Null without limits.")
    acceptance: AcceptanceRow | None = figure("Limits of the plan.")


class BatchRow(Row):
    """JSON of `stepload batch`, version 1. SI units; NaN and infinities are null."""

    simulated: bool = figure("Whether simulated devices made the data of a run.")
    name: str = figure("Of the batch.")
    verdict: str = figure("in control, out of control, outside limits, few specimens or nothing.")
    headline: str = figure("The same in a sentence.")
    groups: tuple[GroupRow, ...] = figure("By payload.")
    left_out: Annotated[tuple[str, ...], BeforeValidator(tuple)] = figure("Runs without a chord.")
    unfinished: tuple[str, ...] = figure("Rows of the list that are still to be pressed.")
    notes: tuple[str, ...] = figure("What a reader must know.")


def batch_schema() -> dict[str, Any]:
    """The JSON Schema of a batch."""
    return schema_of(BatchRow, "batch")


def batch_data(found: Batch, unfinished: tuple[str, ...] = ()) -> dict[str, Any]:
    """A batch for programs."""
    judged = verdict(found)
    return data(BatchRow, {
        "simulated": _simulated(found), "name": found.name, "verdict": judged.word,
        "headline": judged.text, "groups": found.groups, "left_out": found.left_out,
        "unfinished": unfinished, "notes": found.notes,
    })  # fmt: skip


def _simulated(found: Batch) -> bool:
    return any(run.simulated for run in found.runs)


def verdict(found: Batch) -> Verdict:
    """Whether a specimen is outside the limits or stands out; of several payloads the worst."""
    judged = [_verdict(group) for group in found.groups]
    order = ("bad", "doubt", "good")
    nothing = Verdict("doubt", "nothing", "No run has a chord stiffness")
    return min(judged, key=lambda each: order.index(each.mood), default=nothing)


def _verdict(group: Group) -> Verdict:
    n, mean = len(group.specimens), group.mean
    if mean is None:
        only = group.specimens[0]
        return Verdict("doubt", "few specimens", f"{only.name}: {f(only.value_n_per_m, 'N/m')}")
    value, ends = in_one_unit((mean.value - mean.half, mean.value + mean.half), "N/m", mean.value)
    chord = group.pressed[0].chord
    text = f"Mean chord stiffness {value}, 95 % {ends}, of {n} specimens, from "
    text += f"{f(chord.from_n, 'N')} to {f(chord.to_n, 'N')}"
    if any(each.limits == "outside" for each in group.specimens):
        return Verdict("bad", "outside limits", text)
    if any(each.broken for each in group.specimens) or (group.trend and group.trend.found):
        return Verdict("bad", "out of control", text)
    if n < FEWEST:
        return Verdict("doubt", "few specimens", text)
    return Verdict("good", "in control", text)


def batch_document(found: Batch, unfinished: tuple[str, ...] = ()) -> Document:
    """A batch for people."""
    reasons = [*_reasons(found), *found.notes]
    if found.left_out:
        reasons.append(f"no chord stiffness, left out: {', '.join(found.left_out)}")
    if unfinished:
        reasons.append(f"still to be pressed: {', '.join(unfinished)}")
    tables, drawn = [], []
    for group in found.groups:
        tables += _tables(group)
        drawn += _figures(group)
    runs = found.runs
    facts = ([("Batch", found.name), *shared_facts(runs, "payload", "plan", "day")],
             shared_facts(runs, "rig", "arm", "force_sensor", "calibration", "operator"))  # fmt: skip
    return Document(
        title=found.name,
        subtitle=", ".join(group.payload for group in found.groups),
        verdict=verdict(found),
        reasons=reasons,
        tables=[*tables, runs_table(runs)],
        figures=drawn[1:],
        simulated=_simulated(found),
        certificate=Certificate(
            heading="Batch of specimens", facts=facts, tables=[t for t in tables if "mean" in t.title],
            figure=drawn[0] if drawn else None, remarks=reasons,
            signatures=(("Pressed by", ""), ("Checked by", "")),
            foot=f"stepload {stepload.__version__} · batch {found.name} of {len(runs)} runs",
        ),
    )  # fmt: skip


def _reasons(found: Batch) -> Iterator[str]:
    """Which specimens are outside, which stand out and by what; a trend; what all share."""
    for group in found.groups:
        out = [each.name for each in group.specimens if each.limits == "outside"]
        unclear = [each.name for each in group.specimens if each.limits == "unclear"]
        if out:
            yield f"outside the limits: {', '.join(out)}"
        if unclear:
            yield f"the interval crosses a limit: {', '.join(unclear)}"
        for rule, meaning in MEANINGS.items():
            if names := [each.name for each in group.specimens if rule in each.broken]:
                yield f"{rule}, {meaning}: {', '.join(names)}"
        if group.trend and group.trend.found:
            p = f"{group.trend.rank_p:.2g}"
            yield f"trend of {f(group.trend.slope, 'N/m')} a specimen (rank test p = {p})"
        if group.no_gauge:
            yield group.no_gauge
        if group.gauge and group.chart and not group.gauge.grr < group.gauge.tv:
            yield "the gauge R&R tells no specimen from another"


def _tables(group: Group) -> list[Table]:
    chord = group.pressed[0].chord
    span = f"{group.payload}, {f(chord.from_n, 'N')} to {f(chord.to_n, 'N')}"
    specimens = table(f"Specimens of {span}", SpecimenRow, group.specimens)
    kept = [at for at, name in enumerate(specimens.columns)
            if name not in ("limits", "runs", "stands out by")
            or len({row[at] for row in specimens.rows} | {"1" if name == "runs" else ""}) > 1]  # fmt: skip
    columns = [specimens.columns[at] for at in kept]
    rows = [[row[at] for at in kept] for row in specimens.rows]
    made = [Table(specimens.title, columns, rows)]
    figures_ = list(_summary(group))
    made.append(Table(f"The mean of {span}", ("figure", "value", "by"), figures_))
    if group.mean is not None:
        made.append(table("Shared by all specimens", Line, group.mean.common, page_only=True))
    if (gauge := group.gauge) is not None:
        made += _gauge_tables(group)
    return made


def _summary(group: Group) -> Iterator[tuple[str, str, str]]:
    mean, chart, trend, capable = group.mean, group.chart, group.trend, group.capability
    n = len(group.specimens)
    if mean is None:
        return

    def half(value: float) -> str:
        return f"±{percent(value / mean.value, 2)}"

    yield "mean", f(mean.value, "N/m", 4), f"{n} specimens"
    yield "standard deviation", f(mean.sigma, "N/m"), percent(mean.sigma / mean.value, 2)
    yield "95 % of the mean, scatter", half(mean.scatter), f"Student's t, {n - 1} degrees"
    sources = ", ".join(line.source for line in mean.common[:2])
    yield "95 % of the mean, common", half(mean.common_half), sources or "nothing is shared"
    yield "both together", half(mean.half), "more specimens narrow the scatter only"
    if trend is not None:
        ends = in_one_unit(trend.interval, "N/m")[1]
        yield "trend a specimen", f(trend.slope, "N/m"), f"95 % {ends}, rank p = {trend.rank_p:.2g}"
    if chart is not None:
        limits = in_one_unit((chart.low, chart.high), "N/m")[1]
        yield "control limits", limits, "mean ± 2.66 mean moving range"
        yield "largest moving range", f(chart.range_high, "N/m"), "3.267 mean moving range"
    if capable is not None:
        low, high = capable.ppk_interval
        yield "Cp, Cpk", f"{_index(capable.cp)}, {capable.cpk:.2f}", "short-term σ, ISO 22514-2"
        yield (
            "Pp, Ppk",
            f"{_index(capable.pp)}, {capable.ppk:.2f}",
            f"Ppk 95 % [{low:.2f}, {high:.2f}]",
        )


def _index(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.2f}"


def _gauge_tables(group: Group) -> list[Table]:
    gauge = group.gauge
    assert gauge is not None
    lines = [
        ("EV, repeatability", gauge.ev), ("AV, reproducibility", gauge.av),
        ("operator × specimen", gauge.interaction), ("GRR", gauge.grr),
        ("PV, between specimens", gauge.pv), ("TV, total", gauge.tv),
    ]  # fmt: skip
    width = group.tolerance
    rows = [
        (name, f(sigma, "N/m"), percent(gauge.share(sigma), 3),
         percent(SIGMAS * sigma / width, 3) if width > 0.0 else "–")
        for name, sigma in lines if not math.isnan(sigma)
    ]  # fmt: skip
    pooled = "pooled with the repeatability" if gauge.pooled else "kept apart"
    notes = [
        f"{gauge.parts} specimens, {gauge.operators} operators, {gauge.trials} trials; ndc "
        f"{gauge.ndc}; the interaction is {pooled}.",
    ]
    columns = ("gauge R&R (AIAG)", "standard deviation", "of study", "of tolerance")
    return [
        Table("Gauge R&R", columns, rows, notes),
        table("Analysis of variance", SourceRow, gauge.sources, page_only=True),
    ]


def _figures(group: Group) -> list[Figure]:
    if group.chart is None:
        return []
    return [
        Figure(
            f"chart-{group.payload}", f"Control chart, {group.payload}",
            "Chord stiffness of each specimen in the order of pressing, and the moving range. Dashed: "
            "limits of the chart. Dotted: limits of the plan. Red: a rule is broken.",
            "chord stiffness and moving range of every specimen with control limits",
            partial(_draw, group),
        )
    ]  # fmt: skip


def _draw(group: Group) -> str:
    chart = group.chart
    assert chart is not None
    values = np.array([each.value_n_per_m for each in group.specimens]) * 1e-6
    at, ranges = np.arange(1, values.size + 1), np.abs(np.diff(values))
    with figures.figure_of(4.6, rows=2) as (drawn, (upper, lower)):
        for axes, x, y, centre, limits in (
            (upper, at, values, chart.centre, (chart.low, chart.high)),
            (lower, at[1:], ranges, chart.mean_range, (chart.range_high,)),
        ):  # fmt: skip
            axes.plot(x, y, "o-", color=figures.BLUE, ms=4)
            axes.axhline(centre * 1e-6, color=figures.GREY, lw=0.9)
            for limit in limits:
                axes.axhline(limit * 1e-6, color=figures.INK, lw=0.9, ls="--")
        stated = group.acceptance
        for limit in (stated.chord_min_n_per_m, stated.chord_max_n_per_m) if stated else ():
            if limit is not None:
                upper.axhline(limit * 1e-6, color=figures.GREEN, ls=":")
        for each, y in zip(group.specimens, values, strict=True):
            if each.broken:
                upper.plot([each.number], [y], "o", color=figures.RED, ms=7)
                upper.annotate(
                    figures.plain(f"{each.name}: {', '.join(each.broken)}"), (each.number, y),
                    textcoords="offset points", xytext=(4, 6), color=figures.RED, fontsize=8,
                )  # fmt: skip
        upper.set_ylabel("chord [N/µm]")
        lower.set(xlabel="specimen, in the order of pressing", ylabel="moving range [N/µm]")
        lower.set_ylim(bottom=0.0)
        return figures.svg_of(drawn)
