"""Results of a campaign: counts, peaks, detection times, and the bound that follows."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from stepload.results.model import NOTHING, Field, named, number
from stepload_verify.campaign.result import REFUSED, Result

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Group:
    """Runs that are reported together."""

    name: str
    runs: int
    healthy: int
    refused: int
    above_elastic_limit: int
    max_peak_ratio: float
    max_j: float
    p999_peak_ratio: float
    false_trips: int
    false_trip_rate: float
    missed: int
    """Healthy runs that were completed, with a level given up below its force."""
    rate_bound: float
    """Upper 95 % bound of the share of runs above F_c."""


@dataclass(frozen=True, slots=True)
class RuleRow:
    """Runs stopped by one rule; detection times of those with one fault and nothing else wrong."""

    rule: str
    trips: int
    detection_median_s: float
    detection_p99_s: float
    max_peak_ratio: float


@dataclass(frozen=True, slots=True)
class FaultRow:
    """Runs with one kind of fault; those with a named hazard are counted apart."""

    kind: str
    runs: int
    stopped: int
    above_elastic_limit: int
    max_j: float
    hazards: int
    hazards_above: int


def _milliseconds(time_s: float) -> str:
    return NOTHING if math.isnan(time_s) else f"{time_s * 1e3:.1f} ms"


GROUP: tuple[Field[Group], ...] = (
    named("name", "runs on"),
    named("runs", "runs"),
    named("above_elastic_limit", "above F_c"),
    named("rate_bound", "95 % bound", number(".2g")),
    named("max_peak_ratio", "max F/F_c", number(".3f")),
    named("max_j", "max J", number(".3f")),
    named("p999_peak_ratio", "p99.9", number(".3f")),
    Field(lambda row: row.refused or None, label="refused"),
    named("healthy", "healthy"),
    Field(
        lambda row: f"{row.false_trips} ({row.false_trip_rate:.2%})" if row.healthy else None,
        label="false",
    ),
    Field(lambda row: row.missed if row.healthy else None, label="gave a level up"),
)
RULE: tuple[Field[RuleRow], ...] = (
    named("rule", "by"),
    named("trips", "runs"),
    named("detection_median_s", "detected after (median)", _milliseconds),
    named("detection_p99_s", "(99 %)", _milliseconds),
    named("max_peak_ratio", "max F/F_c", number(".3f")),
)
FAULT: tuple[Field[FaultRow], ...] = (
    named("kind", "fault"),
    named("runs", "runs"),
    named("stopped", "stopped"),
    named("above_elastic_limit", "above F_c"),
    named("max_j", "max J", number(".3f")),
    Field(lambda row: row.hazards or None, label="hazards apart"),
    Field(lambda row: row.hazards_above if row.hazards else None, label="above F_c"),
)


def rate_bound(events: int, runs: int) -> float:
    """Upper 95 % bound of a rate after `events` in `runs` independent runs (Clopper–Pearson).

    With no event it is 1 − 0.05^(1/n), about 3/n.
    """
    if runs == 0 or events >= runs:
        return 1.0
    if events == 0:
        return -math.expm1(math.log1p(-CONFIDENCE) / runs)
    low, high = events / runs, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _at_most(events, runs, middle) > 1.0 - CONFIDENCE:
            low = middle
        else:
            high = middle
    return high


def _at_most(events: int, runs: int, rate: float) -> float:
    """Probability of so many events or fewer."""
    return sum(
        math.exp(
            math.lgamma(runs + 1)
            - math.lgamma(i + 1)
            - math.lgamma(runs - i + 1)
            + i * math.log(rate)
            + (runs - i) * math.log1p(-rate)
        )
        for i in range(events + 1)
    )


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
                rule,
                len(rows),
                quantile(times, 0.5),
                quantile(times, 0.99),
                max(row.peak_ratio for row in rows),
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
        kind,
        len(claim),
        sum(row.status == "stopped" for row in claim),
        sum(row.peak_ratio > 1.0 for row in claim),
        max((row.j for row in claim), default=math.nan),
        len(apart),
        sum(row.peak_ratio > 1.0 for row in apart),
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
        "groups": table,
        "rules": by_rule(rows),
        "faults": by_fault(results),
        "refusals": dict(Counter(row.rule for row in results if row.status == REFUSED)),
        "false_trips": dict(Counter(row.rule or row.status for row in rows if row.false_trip)),
        "violations": [_name(row) for row in rows if row.peak_ratio > 1.0],
        "false_trip_runs": [_name(row) for row in rows if row.false_trip],
        "level_missed_runs": [_name(row) for row in rows if row.healthy and row.levels_missed],
        "worst": [{"run": _name(row), "j": row.j, "wrong": row.wrong} for row in worst],
    }


def _name(row: Result) -> str:
    return f"{row.series}-{row.index}"
