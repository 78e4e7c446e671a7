"""The runs of a batch together: one chord a specimen, their mean, and what stands out.

Everything follows from the records. All chords are between the forces that all runs have; errors
that the runs share are kept apart from what scatters, as in a comparison.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Annotated

import numpy as np

from stepload.errors import BadInputError
from stepload.identification.difference import Measured, correlations
from stepload.identification.fit import FloatArray
from stepload.identification.smooth import NORMAL_95
from stepload.plan.model import Acceptance
from stepload.report import batch_statistics as stats
from stepload.report import figures
from stepload.report.comparison_runs import ComparedRun, chords, compared_run
from stepload.report.identified import Pair
from stepload.report.model import Document, Figure, Mood, Table, Verdict
from stepload.report.provenance import runs_table
from stepload.report.rows import Row, cells, figure, in_one_unit, table
from stepload.report.run_record import SavedRun, labelled
from stepload.units import format_quantity as f
from stepload.units import percent

FEW, FEWEST = 4, 8
"""Specimens from which there is a trend or a chart, and may say that nothing stands out."""
MOODS: dict[str, Mood] = {
    "outside limits": "bad", "out of control": "bad", "few specimens": "doubt",
    "in control": "good",
}  # fmt: skip
"""The verdicts on a batch."""
RULES = (
    "WE, Western Electric rules: 1 beyond 3 σ; on one side 2 two of three beyond",
    "2 σ, 3 four of five beyond 1 σ, 4 eight in a row. ESD: outlier, ESD test, 5 %.",
)


class Specimen(Row):
    """One specimen, the mean of its runs."""

    number: int = figure("In the order of pressing, from 1.", "no")
    name: str = figure("Which piece.", "specimen")
    runs: int = figure("Runs of it that count.", "runs")
    value_n_per_m: float = figure("Its chord stiffness.", "chord stiffness")
    interval_n_per_m: Pair = figure(
        "95 %, with what all specimens share; mean of the ends of its runs.", "its 95 %"
    )
    broken: Annotated[tuple[str, ...], ", ".join] = figure(
        "What it breaks: WE1 to WE4 (control chart), ESD (outlier).", "stands out by"
    )
    limits: str = figure(
        'inside, outside, or unclear where its interval crosses a limit; "" without.', "limits"
    )


class Mean(Row):
    """The mean over specimens, those that stand out too; half widths as shares of it."""

    value_n_per_m: Annotated[float, lambda k: f(k, "N/m", 4)] = figure("The mean.", "mean")
    sigma_n_per_m: float = figure("Between specimens.", "standard deviation between specimens")
    scatter: Annotated[float, percent] = figure(
        "95 % by that, Student's t.", "its 95 % by scatter, ±"
    )
    common: Annotated[float, percent] = figure(
        "95 % by what all share; more specimens do not narrow it.", "its 95 % by what all share, ±"
    )
    half_width: Annotated[float, percent] = figure("95 % by both.", "its 95 % by both, ±")


class Batch(Row):
    """JSON of `stepload batch`, version 1. SI units; NaN and infinities are null."""

    simulated: bool = figure("Whether simulated devices made the data of a run.")
    name: str = figure("Of the batch.")
    payload: str = figure("Name of the payload.")
    verdict: str = figure("in control, out of control, outside limits or few specimens.")
    from_n: float = figure("Lower force of all chords.")
    to_n: float = figure("Upper force.")
    specimens: tuple[Specimen, ...] = figure("In the order of pressing.")
    mean: Mean | None = figure("Null for one specimen.")
    trend: stats.Trend | None = figure("Null for fewer than four specimens.")
    chart: stats.Chart | None = figure("Null for fewer than four specimens.")
    gauge: stats.Gauge | None = figure("Null unless the study is crossed, with two trials or more.")
    capability: stats.Capability | None = figure("Null without limits, or without a chart.")
    chord_min_n_per_m: float | None = figure("Lower limit of the plan.")
    chord_max_n_per_m: float | None = figure("Upper limit of the plan.")
    notes: tuple[str, ...] = figure("What a reader must know.")

    @property
    def headline(self) -> str:
        """The mean in a sentence."""
        span = f"from {f(self.from_n, 'N')} to {f(self.to_n, 'N')}"
        if self.mean is None:
            return f"Chord stiffness {f(self.specimens[0].value_n_per_m, 'N/m')}, {span}"
        value, half = self.mean.value_n_per_m, self.mean.half_width
        shown, ends = in_one_unit((value * (1.0 - half), value * (1.0 + half)), "N/m", value)
        return f"Mean chord stiffness {shown}, 95 % {ends}, {len(self.specimens)} specimens, {span}"


def batch_of(
    name: str, saved: Sequence[SavedRun], acceptance: Acceptance | None, left: Sequence[str] = ()
) -> Batch:
    """Evaluate the runs of a batch, each press once; `left` are still to be pressed.

    Raises:
        BadInputError: the runs have no chord between common forces, or their payloads differ.
    """
    ordered = labelled(sorted(saved, key=lambda run: run.metadata.get("started", "")))
    compared = [compared_run(run, run.conditions.secant_force_n) for run in ordered]
    runs = [each for each in compared if each.found.headline is not None]
    payloads = {each.run.metadata.get("payload", "") for each in runs}
    if len(payloads) > 1:
        told = f"payloads differ: {', '.join(sorted(payloads))}"
        raise BadInputError(told, hint="make each a batch of its own: --out DIR")
    if not (found := chords(runs)):
        raise BadInputError("the runs have no chord stiffness between common forces")
    measured = [each.measured(chord) for each, chord in zip(runs, found, strict=True)]
    names = [each.run.metadata.get("specimen") or each.run.place for each in runs]
    pieces = list(dict.fromkeys(names))
    place = np.array([pieces.index(each) for each in names])
    ends = np.array([(each.value_n_per_m, *each.interval_n_per_m) for each in found])
    means = np.array([ends[place == at].mean(axis=0) for at in range(len(pieces))])
    values, chart, trend, capable = means[:, 0], None, None, None
    out, limits = stats.outliers(values), acceptance or Acceptance()
    least, most = limits.chord_min_n_per_m, limits.chord_max_n_per_m
    if values.size >= FEW and np.ptp(values) > 0.0:
        chart, trend = stats.chart(values), stats.trend(values)
        if acceptance:
            capable = stats.capability(values, least, most, chart.sigma_n_per_m)
    specimens = tuple(
        Specimen(
            number=at + 1, name=piece, runs=names.count(piece), value_n_per_m=value,
            interval_n_per_m=(low, high),
            broken=(*(chart.broken[at] if chart else ()), *(["ESD"] if at in out else ())),
            limits=_against(low, high, least, most) if acceptance else "",
        )
        for at, (piece, (value, low, high)) in enumerate(zip(pieces, means.tolist(), strict=True))
    )  # fmt: skip
    width = most - least if least and most else None
    gauge, told = _gauge(names, runs, ends[:, 0], width)
    return Batch(
        simulated=any(run.simulated for run in ordered), name=name, payload=payloads.pop(),
        verdict=_verdict(specimens, trend), from_n=found[0].from_n, to_n=found[0].to_n,
        specimens=specimens, mean=_mean(measured, place, values), trend=trend, chart=chart,
        gauge=gauge, chord_min_n_per_m=least, chord_max_n_per_m=most, capability=capable,
        notes=(*_notes(compared, specimens, trend, left), *filter(None, [told])),
    )  # fmt: skip


def _against(low: float, high: float, least: float | None, most: float | None) -> str:
    """Whether an interval keeps the limits, as ISO 14253-1 decides."""
    least, most = least or -math.inf, most or math.inf
    if least <= low and high <= most:
        return "inside"
    return "outside" if high < least or low > most else "unclear"


def _notes(
    runs: Sequence[ComparedRun], pieces: Sequence[Specimen], trend: stats.Trend | None,
    left: Sequence[str],
) -> Iterator[str]:  # fmt: skip
    known = [each for each in runs if each.found.headline is not None]
    sums: dict[tuple[str, str], set[str]] = {}
    for told in (each.run.metadata for each in known):
        for key in told:
            if key.startswith("sha256 plan"):
                sums.setdefault((told.get("plan", ""), key[7:]), set()).add(told[key])
    lists = {
        "still to be pressed": left,
        "outside the limits": [e.name for e in pieces if e.limits == "outside"],
        "the interval crosses a limit": [e.name for e in pieces if e.limits == "unclear"],
        "stands out": [f"{e.name} by {', '.join(e.broken)}" for e in pieces if e.broken],
        "no chord stiffness, left out": [e.run.name for e in runs if e.found.headline is None],
        "not identified": [e.run.name for e in known if e.found.verdict != "identified"],
        "changed between the runs": [": ".join(of) for of, found in sums.items() if len(found) > 1],
    }
    yield from (f"{word}: {'; '.join(names)}" for word, names in lists.items() if names)
    if len(pieces) < FEWEST:
        yield f"{len(pieces)} specimens: that they are in control takes {FEWEST}"
    if trend and trend.rank_p < stats.ALPHA:
        yield f"trend of {f(trend.slope_n_per_m, 'N/m')} a specimen, p = {trend.rank_p:.2g}"


def _verdict(specimens: Sequence[Specimen], trend: stats.Trend | None) -> str:
    if any(each.limits == "outside" for each in specimens):
        return "outside limits"
    drifts = trend is not None and trend.rank_p < stats.ALPHA
    if drifts or any(each.broken for each in specimens):
        return "out of control"
    return "few specimens" if len(specimens) < FEWEST else "in control"


def _mean(measured: Sequence[Measured], place: stats.IntArray, values: FloatArray) -> Mean | None:
    """The mean over specimens; None for a single one.

    The variance between specimens holds what differs. What two of them share on average, the mean
    covariance of runs of different specimens, is added: it does not average out.
    """
    if values.size < 2:
        return None
    apart, shared = place[:, None] != place, 0.0
    for source, correlation in correlations(measured).items():
        own = np.array([each.lines.get(source, 0.0) for each in measured])
        shared += float((np.outer(own, own) * correlation.most)[apart].mean())
    value, sigma = float(values.mean()), float(values.std(ddof=1))
    scatter = stats.student(values.size - 1) * sigma / math.sqrt(values.size) / value
    common = NORMAL_95 * math.sqrt(shared)
    return Mean(value_n_per_m=value, sigma_n_per_m=sigma, scatter=scatter, common=common,
                half_width=math.hypot(scatter, common))  # fmt: skip


def _gauge(
    names: Sequence[str], runs: Sequence[ComparedRun], values: FloatArray, tolerance: float | None
) -> tuple[stats.Gauge | None, str]:
    """Gauge R&R, or why there is none though specimens were pressed again."""
    cells: dict[tuple[str, str], list[float]] = {}
    for name, each, value in zip(names, runs, values.tolist(), strict=True):
        cells.setdefault((name, each.run.metadata.get("operator", "")), []).append(value)
    parts, operators = (dict.fromkeys(each) for each in zip(*cells, strict=True))
    if len(names) == len(parts):
        return None, ""
    study = [[cells.get((part, who), []) for who in operators] for part in parts]
    counts = {len(cell) for row in study for cell in row}
    if len(counts) > 1 or min(counts) < 2 or len(parts) < 2:
        return None, "no gauge R&R: each operator must press each specimen twice or more, alike"
    return stats.gauge(np.array(study), tolerance), ""


def batch_document(found: Batch, runs: Sequence[SavedRun]) -> Document:
    """A batch for people; `runs` are its runs."""
    drawn = Figure(
        "chart", "Control chart",
        "Chord stiffness by specimen. Dashed: limits of the chart. Dotted: limits of the plan."
        " Red: what stands out.",
        "chord stiffness of every specimen with its limits", partial(_draw, found),
    )  # fmt: skip
    return Document(
        title=found.name, subtitle=found.payload,
        verdict=Verdict(MOODS[found.verdict], found.verdict, found.headline),
        reasons=found.notes, tables=[*_tables(found), runs_table(runs)],
        figures=[drawn] if found.chart else [], simulated=found.simulated,
    )  # fmt: skip


def _tables(found: Batch) -> Iterator[Table]:
    title = f"Chord stiffness, {f(found.from_n, 'N')} to {f(found.to_n, 'N')}"
    yield table(title, Specimen, found.specimens, RULES)
    parts = (found.mean, found.trend, found.chart, found.capability)
    rows = [line for part in parts if part is not None for line in cells(type(part), part)]
    yield Table(f"{title}, all specimens", ("figure", "value"), rows)
    if (gauge := found.gauge) is not None:
        pooled = "INT counts as EV" if gauge.pooled else "INT is kept apart"
        note = f"{gauge.operators} operators, {gauge.trials} trials; {pooled}; ndc {gauge.ndc}."
        yield table("Gauge R&R of the chord stiffness", stats.GaugeLine, gauge.lines, [note])


def _draw(found: Batch) -> str:
    assert found.chart is not None
    at = np.array([each.number for each in found.specimens])
    values = np.array([each.value_n_per_m for each in found.specimens]) * 1e-6
    out = np.array([bool(each.broken) for each in found.specimens])
    low, high = found.chart.limits_n_per_m
    levels = (
        (found.chart.centre_n_per_m, figures.GREY, "-"), (low, figures.INK, "--"),
        (high, figures.INK, "--"), (found.chord_min_n_per_m, figures.GREEN, ":"),
        (found.chord_max_n_per_m, figures.GREEN, ":"),
    )  # fmt: skip
    with figures.figure_of(3.0) as (drawn, (axes,)):
        for level, colour, style in levels:
            if level:
                axes.axhline(level * 1e-6, color=colour, ls=style)
        axes.plot(at, values, "o-", color=figures.BLUE)
        axes.plot(at[out], values[out], "o", color=figures.RED)
        axes.locator_params(axis="x", integer=True)
        axes.set(xlabel="specimen, in the order of pressing", ylabel="chord stiffness [N/µm]")
        return figures.svg_of(drawn)
