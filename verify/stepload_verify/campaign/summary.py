"""Results of a campaign: counts, peaks, detection times, and the bound that follows."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any

from stepload.report.model import NOTHING
from stepload.report.rows import Cell, Row, figure, form
from stepload_verify.campaign.result import REFUSED, Result

CONFIDENCE = 0.95


class Group(Row):
    """Runs that are reported together."""

    name: str = figure("Name of the group.", "runs on")
    runs: int = figure("Runs that preflight let begin.", "runs")
    above_elastic_limit: int = figure("Runs with a force above F_c.", "above F_c")
    rate_bound: Annotated[float, form(".2g")] = figure(
        "Upper 95 % bound of the share of runs above F_c.", "95 % bound"
    )
    max_peak_ratio: Annotated[float, form(".3f")] = figure("Largest F/F_c.", "max F/F_c")
    max_j: Annotated[float, form(".3f")] = figure("Largest J.", "max J")
    p999_peak_ratio: Annotated[float, form(".3f")] = figure("99.9 % of F/F_c.", "p99.9")
    refused: Annotated[int, lambda count: f"{count or NOTHING}"] = figure(
        "Runs that preflight refused.", "refused"
    )
    healthy: int = figure("Runs without a fault.", "healthy")
    false_trips: Annotated[
        int,
        Cell(lambda g: f"{g.false_trips} ({g.false_trip_rate:.2%})" if g.healthy else NOTHING),
    ] = figure("Healthy runs that were stopped.", "false")
    false_trip_rate: float = figure("Their share.")
    missed: Annotated[int, Cell(lambda g: f"{g.missed}" if g.healthy else NOTHING)] = figure(
        "Healthy runs that were completed, with a level given up below its force.",
        "gave a level up",
    )


def _milliseconds(time_s: float) -> str:
    return f"{time_s * 1e3:.1f} ms"


class RuleRow(Row):
    """Runs stopped by one rule; detection times of those with one fault and nothing else wrong."""

    rule: str = figure("Rule, or the status.", "by")
    trips: int = figure("Runs.", "runs")
    detection_median_s: Annotated[float, _milliseconds] = figure(
        "Median time from the fault to the stop.", "detected after (median)"
    )
    detection_p99_s: Annotated[float, _milliseconds] = figure("99 % of them.", "(99 %)")
    max_peak_ratio: Annotated[float, form(".3f")] = figure("Largest F/F_c.", "max F/F_c")


class FaultRow(Row):
    """Runs with one kind of fault; those with a named hazard are counted apart."""

    kind: str = figure("Kind of fault.", "fault")
    runs: int = figure("Runs.", "runs")
    stopped: int = figure("Runs that were stopped.", "stopped")
    above_elastic_limit: int = figure("Runs with a force above F_c.", "above F_c")
    max_j: Annotated[float, form(".3f")] = figure("Largest J.", "max J")
    hazards: Annotated[int, lambda count: f"{count or NOTHING}"] = figure(
        "Runs with a named hazard.", "hazards apart"
    )
    hazards_above: Annotated[
        int, Cell(lambda row: f"{row.hazards_above}" if row.hazards else NOTHING)
    ] = figure("Those of them above F_c.", "above F_c")


def rate_bound(events: int, runs: int) -> float:
    """Upper 95 % bound of a rate after `events` in `runs` independent runs (Clopper–Pearson).

    With no event it is 1 − 0.05^(1/n), about 3/n.
    """
    from scipy.special import betaincinv

    return float(betaincinv(events + 1, runs - events, CONFIDENCE)) if events < runs else 1.0


def quantile(values: Sequence[float], share: float) -> float:
    """The smallest value that at least this share of the values does not exceed; NaN for none."""
    if not values:
        return math.nan
    ordered = sorted(values)
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


def group(name: str, results: Iterable[Result]) -> Group:
    """The figures of some runs."""
    found = list(results)
    rows = [row for row in found if row.status != REFUSED]
    healthy = [row for row in rows if row.healthy]
    above = sum(row.peak_ratio > 1.0 for row in rows)
    ratios = [row.peak_ratio for row in rows]
    false = sum(row.false_trip for row in healthy)
    return Group(
        name=name,
        runs=len(rows),
        healthy=len(healthy),
        refused=len(found) - len(rows),
        above_elastic_limit=above,
        max_peak_ratio=max(ratios, default=math.nan),
        max_j=max((row.j for row in rows), default=math.nan),
        p999_peak_ratio=quantile(ratios, 0.999),
        false_trips=false,
        false_trip_rate=false / len(healthy) if healthy else math.nan,
        missed=sum(row.levels_missed > 0 and not row.false_trip for row in healthy),
        rate_bound=rate_bound(above, len(rows)),
    )


def claimed(results: Iterable[Result]) -> list[Result]:
    """The runs that the claim is made for: without a named hazard."""
    return [row for row in results if not row.hazard]


def groups(results: Sequence[Result]) -> list[Group]:
    """The claim, each class of rig in it, and each named hazard, which is no part of it."""
    claim = claimed(results)
    rows = [group("all rigs", claim)]
    rows += [
        group(f"  {name}", [row for row in claim if row.rig_class == name])
        for name in sorted({row.rig_class for row in claim if row.status != REFUSED})
    ]
    rows += [
        group(f"apart: {hazard}", [row for row in results if row.hazard == hazard])
        for hazard in sorted({row.hazard for row in results if row.hazard})
    ]
    return rows


def by_rule(results: Iterable[Result]) -> list[RuleRow]:
    """How runs ended, most frequent first."""
    found: dict[str, list[Result]] = defaultdict(list)
    for row in results:
        found[row.rule or row.status].append(row)
    table = []
    for rule, rows in sorted(found.items(), key=lambda item: -len(item[1])):
        times = [row.detection_s for row in rows if row.detection_s is not None]
        times = [time_s for time_s in times if time_s >= 0.0]
        table.append(
            RuleRow(
                rule=rule,
                trips=len(rows),
                detection_median_s=quantile(times, 0.5),
                detection_p99_s=quantile(times, 0.99),
                max_peak_ratio=max(row.peak_ratio for row in rows),
            )
        )
    return table


def by_fault(results: Iterable[Result]) -> list[FaultRow]:
    """Outcomes of the runs, by kind of fault."""
    found: dict[str, list[Result]] = defaultdict(list)
    for row in results:
        for kind in row.wrong:
            found[kind].append(row)
    return [_fault_row(kind, rows) for kind, rows in sorted(found.items())]


def _fault_row(kind: str, rows: Sequence[Result]) -> FaultRow:
    claim = claimed(rows)
    apart = [row for row in rows if row.hazard]
    return FaultRow(
        kind=kind,
        runs=len(claim),
        stopped=sum(row.status == "stopped" for row in claim),
        above_elastic_limit=sum(row.peak_ratio > 1.0 for row in claim),
        max_j=max((row.j for row in claim), default=math.nan),
        hazards=len(apart),
        hazards_above=sum(row.peak_ratio > 1.0 for row in apart),
    )


def summary(results: Sequence[Result]) -> Mapping[str, Any]:
    """The JSON object of a campaign; its first figures are those of the claim."""
    table = groups(results)
    claim = table[0]
    rows = [row for row in claimed(results) if row.status != REFUSED]
    worst = sorted(rows, key=lambda row: -row.j)[:10]
    return {
        "runs": claim.runs,
        "refused": claim.refused,
        "above_elastic_limit": claim.above_elastic_limit,
        "max_peak_ratio": claim.max_peak_ratio,
        "max_j": claim.max_j,
        "p999_peak_ratio": claim.p999_peak_ratio,
        "false_trip_rate": claim.false_trip_rate,
        "rate_bound_95": claim.rate_bound,
        "groups": [each.model_dump() for each in table],
        "rules": [each.model_dump() for each in by_rule(rows)],
        "faults": [each.model_dump() for each in by_fault(results)],
        "refusals": dict(Counter(row.rule for row in results if row.status == REFUSED)),
        "false_trips": dict(Counter(row.rule or row.status for row in rows if row.false_trip)),
        "violations": [_name(row) for row in rows if row.peak_ratio > 1.0],
        "false_trip_runs": [_name(row) for row in rows if row.false_trip],
        "level_missed_runs": [_name(row) for row in rows if row.healthy and row.levels_missed],
        "worst": [{"run": _name(row), "j": row.j, "wrong": row.wrong} for row in worst],
    }


def _name(row: Result) -> str:
    return f"{row.series}-{row.index}"
