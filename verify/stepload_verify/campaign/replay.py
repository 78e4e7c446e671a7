"""One run of a campaign in full: the plant, its faults, and its course tick by tick."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

from stepload.errors import BadInputError, RefusedError
from stepload.record.outcome import RunOutcome
from stepload.record.rows import Phase, TickRow
from stepload_verify.campaign.ablation import Ablation
from stepload_verify.campaign.result import Job, Result
from stepload_verify.campaign.scenario import (
    ONE_AXIS,
    SIX_AXES,
    Scenario,
    expected_times,
)
from stepload_verify.campaign.single import run_scenario
from stepload_verify.campaign.work import Work

SPARSE_S = 0.1
DENSE_S = 0.03
"""Time around the stop in which every tick is listed; elsewhere one each `SPARSE_S`."""


@dataclass(frozen=True, slots=True)
class Replay:
    """A run done again."""

    scenario: Scenario
    result: Result
    outcome: RunOutcome | None
    rows: list[TickRow]


def replay(work: Work, name: str) -> Replay:
    """Do the run called `name` again: "one-17" with one axis, "six-17" with six.

    Raises:
        BadInputError: not such a name.
        RefusedError: preflight refuses the plan of that run.
    """
    series, _, number = name.rpartition("-")
    if series not in (ONE_AXIS, SIX_AXES) or not number.isdecimal():
        raise BadInputError(f"no run is called {name!r}", hint="one-17 or six-17")
    scenario = work.scenario(Job(series, int(number)))
    if isinstance(scenario, Result):
        raise RefusedError(f"{name}: preflight refuses this plan: {scenario.message}")
    rows: list[TickRow] = []
    ablation = Ablation(work.ablation) if work.ablation else None
    result, outcome = run_scenario(scenario, ablation, rows.append, world=work.world)
    return Replay(scenario, result, outcome, rows)


def plant_rows(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """Every figure of the plant, as planned and as it really is."""
    plan, truth = scenario.plan, scenario.truth
    for name, section in (
        ("arm", plan.rig.arm),
        ("force", plan.rig.force),
        ("second force", plan.rig.second_force),
        ("system stiffness", plan.rig.system_stiffness),
        ("procedure", plan.procedure),
        ("truth", truth),
        ("true payload", truth.payload),
        *((("mount", mount), ("sensor", mount.sensor)) if (mount := truth.mount) else ()),
    ):
        for field in fields(section):
            value = getattr(section, field.name)
            if isinstance(value, (int, float, tuple, str)) and field.name != "faults":
                yield f"{name}: {field.name}", _text(value)
    for term in scenario.limits.terms:
        yield f"limit: {term.name}", f"{term.value:.6g} {term.unit}"


def wrong_rows(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """All faults and incidents, in order of time."""
    for anomaly in scenario.anomalies:
        yield "plant", f"{anomaly.kind} ({anomaly.value:.6g})"
    timed = [
        (fault.start_s, f"{fault.kind}, {fault.duration_s:.4g} s, magnitude {fault.magnitude:.6g}")
        for fault in scenario.faults
    ]
    timed += [(i.start_s, f"{i.kind} {i.detail}".strip()) for i in scenario.incidents]
    for start_s, text in sorted(timed):
        yield f"{start_s:.4f} s", text
    times = expected_times(scenario.plan, scenario.limits, scenario.truth.surface_m)
    yield "expected", f"touch at {times.touch_s:.2f} s, end at {times.end_s:.2f} s"


def timeline(found: Replay) -> Iterator[tuple[str, ...]]:
    """Ticks: time, phase, level, target, force, second force, predicted peak."""
    due_s = -1.0
    phase = -1
    stop_s = found.result.stop_s
    for row in found.rows:
        near = -DENSE_S < row.time_s - stop_s < DENSE_S
        if not (near or row.time_s >= due_s or row.phase != phase):
            continue
        due_s, phase = row.time_s + SPARSE_S, row.phase
        yield (
            f"{row.time_s:.4f}",
            Phase(row.phase).name.lower(),
            f"{row.level_n:.2f}",
            f"{row.target_m * 1e6:.2f}",
            f"{row.force_n:.3f}",
            f"{row.second_force_n:.3f}",
            f"{row.predicted_peak_n:.3f}",
        )


def _text(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
