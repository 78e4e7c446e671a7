"""The runs of a batch together: one chord a specimen, their mean, and what stands out.

Everything follows from the records. All chords are between the forces that all runs have; errors
that the runs share are kept apart from what scatters, as in a comparison.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np

from stepload.errors import BadInputError
from stepload.identification.difference import correlations
from stepload.identification.quantity import Quantity, ResultVerdict
from stepload.identification.smooth import NORMAL_95
from stepload.plan.model import Acceptance
from stepload.report import batch_statistics as stats
from stepload.report.comparison_runs import ComparedRun, chords, compared_run
from stepload.report.identified import Line, Pair
from stepload.report.model import Mood
from stepload.report.rows import Cell, Row, figure, in_one_unit, schema_of
from stepload.report.run_record import SavedRun, labelled
from stepload.units import format_quantity as f

FEWEST = 8
"""Specimens from which a control chart may say that nothing stands out."""
TRIAL = "trial="
"""Begin of the tag that says which repeat of a specimen a run is."""
MOODS: dict[str, Mood] = {
    "outside limits": "bad", "out of control": "bad", "few specimens": "doubt",
    "in control": "good",
}  # fmt: skip
"""The verdicts on a batch."""


class Specimen(Row):
    """One specimen, the mean of its runs."""

    number: int = figure("In the order of pressing, from 1.", "no")
    name: str = figure("Which piece.", "specimen")
    runs: int = figure("Runs of it that count.", "runs")
    value_n_per_m: Annotated[
        float, Cell(lambda row: in_one_unit(row.interval_n_per_m, "N/m", row.value_n_per_m)[0])
    ] = figure("Its chord stiffness.", "chord")
    interval_n_per_m: Annotated[
        Pair, Cell(lambda row: in_one_unit(row.interval_n_per_m, "N/m", row.value_n_per_m)[1])
    ] = figure("95 %, with what all specimens share; mean of the ends of its runs.", "95 %")
    touch_m: float | None = figure("Travel of the arm at its first touch.", "touch")
    broken: Annotated[tuple[str, ...], ", ".join] = figure(
        "What it breaks: WE1 to WE4 (control chart), ESD (outlier).", "stands out by"
    )
    limits: str = figure(
        'inside, outside, or unclear where its interval crosses a limit; "" without.', "limits"
    )


class Mean(Row):
    """The mean over specimens; all in N/m."""

    value: float = figure("Mean of the chord stiffness.")
    sigma: float = figure("Standard deviation between specimens.")
    scatter: float = figure("95 % half width of the mean by that scatter, Student's t.")
    common: float = figure("95 % half width by what all specimens share: more do not narrow it.")
    half: float = figure("95 % half width of both together.")
    lines: tuple[Line, ...] = figure("What all specimens share, by source.")


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
    chart: stats.Chart | None = figure("Null for one specimen.")
    gauge: stats.Gauge | None = figure("Null unless the study is crossed, with two trials or more.")
    capability: stats.Capability | None = figure("Null without limits.")
    chord_min_n_per_m: float | None = figure("Lower limit of the plan.")
    chord_max_n_per_m: float | None = figure("Upper limit of the plan.")
    notes: tuple[str, ...] = figure("What a reader must know.")

    @property
    def headline(self) -> str:
        """The mean in a sentence."""
        span = f"from {f(self.from_n, 'N')} to {f(self.to_n, 'N')}"
        if self.mean is None:
            return f"Chord stiffness {f(self.specimens[0].value_n_per_m, 'N/m')}, {span}"
        value, half = self.mean.value, self.mean.half
        shown, ends = in_one_unit((value - half, value + half), "N/m", value)
        return f"Mean chord stiffness {shown}, 95 % {ends}, {len(self.specimens)} specimens, {span}"


def batch_schema() -> dict[str, Any]:
    """The JSON Schema of a batch."""
    return schema_of(Batch, "batch")


def trial_of(tags: str) -> str:
    """The repeat that a run is, by the tags in its metadata; "" where they do not say."""
    found = (tag.removeprefix(TRIAL) for tag in tags.split("\n") if tag.startswith(TRIAL))
    return next(found, "")


def batch_of(
    name: str, saved: Sequence[SavedRun], acceptance: Acceptance | None, notes: Sequence[str] = ()
) -> Batch:
    """Evaluate the runs of a batch, each press once.

    Raises:
        BadInputError: no run has a chord, they have no forces in common, or payloads differ.
    """
    ordered = labelled(sorted(saved, key=lambda run: run.metadata.get("started", "")))
    compared = [compared_run(run, run.conditions.secant_force_n) for run in ordered]
    runs = [each for each in compared if each.found.headline is not None]
    payloads = sorted({each.run.metadata.get("payload", "") for each in runs})
    if len(payloads) > 1:
        raise BadInputError(
            f"payloads differ: {', '.join(payloads)}", hint="make each a batch of its own: --out"
        )
    if not (found := chords(runs)):
        raise BadInputError("the runs have no chord stiffness between common forces")
    names = [_specimen(each.run) for each in runs]
    place = np.array([list(dict.fromkeys(names)).index(each) for each in names])
    values = np.array([
        np.mean([c.value_n_per_m for c, p in zip(found, place, strict=True) if p == at])
        for at in range(place.max() + 1)
    ])  # fmt: skip
    chart = stats.chart(values)
    limits = acceptance or Acceptance()
    low, high = limits.chord_min_n_per_m, limits.chord_max_n_per_m
    specimens = _specimens(runs, found, place, values, chart, limits if acceptance else None)
    trend, capable = stats.trend(values), acceptance is not None and chart is not None
    gauge, told = _gauge(runs, found)
    return Batch(
        simulated=any(run.simulated for run in ordered), name=name, payload=payloads[0],
        verdict=_verdict(specimens, chart, trend), from_n=found[0].from_n, to_n=found[0].to_n,
        specimens=specimens, mean=_mean(runs, found, place, values), trend=trend, chart=chart,
        gauge=gauge, chord_min_n_per_m=low, chord_max_n_per_m=high,
        capability=stats.capability(values, low, high, chart.sigma) if capable and chart else None,
        notes=(*told, *notes, *_notes(compared)),
    )  # fmt: skip


def _specimen(run: SavedRun) -> str:
    return run.metadata.get("specimen") or run.place


def _notes(runs: Sequence[ComparedRun]) -> list[str]:
    """Runs without a chord, or with one that is not identified."""
    told: dict[str, list[str]] = {}
    for each in runs:
        headline = each.found.headline
        if headline is None:
            told.setdefault("no chord stiffness, left out", []).append(each.run.name)
        elif headline.verdict is not ResultVerdict.IDENTIFIED:
            told.setdefault(f"{headline.verdict}", []).append(each.run.name)
    return [f"{word}: {', '.join(names)}" for word, names in told.items()]


def _specimens(
    runs: Sequence[ComparedRun],
    found: Sequence[Quantity],
    place: stats.IntArray,
    values: stats.FloatArray,
    chart: stats.Chart | None,
    acceptance: Acceptance | None,
) -> tuple[Specimen, ...]:
    ends, out = np.array([each.interval_n_per_m for each in found]), stats.outliers(values)
    made = []
    for at, value in enumerate(values):
        mine = np.flatnonzero(place == at)
        run = runs[mine[0]].run
        low, high = map(float, ends[mine].mean(axis=0))
        touch_m = next((touch.position_m for touch in run.data.touches), None)
        made.append(Specimen(
            number=at + 1, name=_specimen(run), runs=mine.size, value_n_per_m=float(value),
            interval_n_per_m=(low, high), touch_m=touch_m,
            broken=(*(chart.broken[at] if chart else ()), *(("ESD",) if at in out else ())),
            limits=_against(acceptance, low, high),
        ))  # fmt: skip
    return tuple(made)


def _against(acceptance: Acceptance | None, low: float, high: float) -> str:
    """Whether an interval keeps the limits, as ISO 14253-1 decides."""
    if acceptance is None:
        return ""
    least = acceptance.chord_min_n_per_m or -math.inf
    most = acceptance.chord_max_n_per_m or math.inf
    if low >= least and high <= most:
        return "inside"
    return "outside" if high < least or low > most else "unclear"


def _verdict(
    specimens: Sequence[Specimen], chart: stats.Chart | None, trend: stats.Trend | None
) -> str:
    if any(each.limits == "outside" for each in specimens):
        return "outside limits"
    drifts = trend is not None and trend.rank_p < stats.ALPHA
    if drifts or any(each.broken for each in specimens) or (chart and chart.jumps):
        return "out of control"
    return "few specimens" if len(specimens) < FEWEST else "in control"


def _mean(
    runs: Sequence[ComparedRun],
    found: Sequence[Quantity],
    place: stats.IntArray,
    values: stats.FloatArray,
) -> Mean | None:
    """The mean over specimens; None for a single one.

    The variance between specimens holds what differs. What two of them share on average, the mean
    covariance of runs of different specimens, is added: it does not average out.
    """
    if values.size < 2:
        return None
    measured = [each.measured(chord) for each, chord in zip(runs, found, strict=True)]
    apart, lines = place[:, None] != place, []
    for source, correlation in correlations(measured).items():
        sigma = np.array([each.lines.get(source, 0.0) for each in measured])
        shared = float((np.outer(sigma, sigma) * correlation.most)[apart].mean())
        if shared > 0.0:
            lines.append(Line(source=source, size="", relative=math.sqrt(shared)))
    lines.sort(key=lambda line: -(line.relative or 0.0))
    value, sigma_n_per_m = float(values.mean()), float(values.std(ddof=1))
    scatter = stats.student(values.size - 1) * sigma_n_per_m / math.sqrt(values.size)
    common = NORMAL_95 * value * math.hypot(*(line.relative or 0.0 for line in lines))
    return Mean(
        value=value, sigma=sigma_n_per_m, scatter=scatter, common=common,
        half=math.hypot(scatter, common), lines=tuple(lines),
    )  # fmt: skip


def _gauge(
    runs: Sequence[ComparedRun], found: Sequence[Quantity]
) -> tuple[stats.Gauge | None, list[str]]:
    """Gauge R&R, or a note why there is none though specimens were pressed again."""
    cells: dict[tuple[str, str], list[float]] = {}
    for each, chord in zip(runs, found, strict=True):
        key = _specimen(each.run), each.run.metadata.get("operator", "")
        cells.setdefault(key, []).append(chord.value_n_per_m)
    parts, operators = (list(dict.fromkeys(names)) for names in zip(*cells, strict=True))
    counts = {len(values) for values in cells.values()}
    if len(runs) == len(parts):
        return None, []
    whole = len(cells) == len(parts) * len(operators) and len(counts) == 1
    if not whole or counts == {1} or len(parts) < 2:
        return None, ["no gauge R&R: each operator must press each specimen twice or more, alike"]
    return stats.gauge(np.array([[cells[p, o] for o in operators] for p in parts])), []
