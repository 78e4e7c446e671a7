"""A finished run evaluated again from its record alone, as it was evaluated at its end."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from stepload.envelope.envelope import envelope_of
from stepload.envelope.pose import plan_where_it_stands
from stepload.errors import RefusedError
from stepload.plan.load import load_kept
from stepload.plan.model import Plan
from stepload.record.outcome import ActionResult, Cause, Lateness, RunOutcome, RunStatus
from stepload.record.reader import Recording
from stepload.record.rows import Phase, TickColumns
from stepload.record.untrusted import of_damaged, untrusted
from stepload.results.analyse import Evaluation, evaluate
from stepload.results.certificate import started_on
from stepload.results.conditions import from_attachments
from stepload.results.press_data import number_or_nan
from stepload.results.run_record import largest_force_n, read_to_evaluate, record_in
from stepload.results.stated import Stated
from stepload.rig.pose import from_texts


def plan_of(metadata: Mapping[str, str], attachments: Mapping[str, bytes]) -> Plan:
    """The plan of a run as it was on the day of the run, from the texts that its record keeps.

    Raises:
        PlanError: the record has kept no plan that this version can read.
    """
    texts = [
        (name, data)
        for name, data in attachments.items()
        if name == "plan.yaml" or name.startswith("plan-")
    ]
    day = started_on(metadata.get("started", "")) or date.today()
    return load_kept(
        texts, metadata.get("plan", "plan"), day,
        payload=metadata.get("payload_file", ""),
    )  # fmt: skip


def evaluation_of(path: Path, stated: Stated | None = None) -> Evaluation:
    """Evaluate a record with its stored plan and its end, as far as it was written.

    A record that was never finished has the end of its data as its end, status "unfinished".

    Args:
        path: the record, or the directory of a run.
        stated: statements that replace those of the plan.

    Raises:
        PlanError: the record has kept no plan that this version can read.
        BadInputError: it is no record of stepload.
    """
    file = record_in(path)
    with untrusted(file):
        recording = read_to_evaluate(file)
        plan = plan_of(recording.metadata, recording.attachments)
        with suppress(RefusedError):  # no run continues after that
            plan = plan_where_it_stands(plan, from_texts(recording.metadata))
        run = Evaluation(
            envelope_of(plan), outcome_of(recording), recording,
            recording.metadata.get("dry_run") == "true",
        )  # fmt: skip
        conditions = from_attachments(recording.attachments)
        return damage_named(evaluate(run, stated.applied(conditions) if stated else conditions))


def damage_named(run: Evaluation) -> Evaluation:
    """The evaluation, its problem after the damage of the record where there is any."""
    read = run.recording
    if not (run.problem and read.damage):
        return run
    return replace(run, problem=of_damaged(read.path, read.damage, run.problem))


def outcome_of(recording: Recording) -> RunOutcome:
    """How a run ended, according to its record; its touches and tares are in its events."""
    ticks = recording.ticks
    start_s, end_s = (
        (float(ticks.time_s[0]), float(ticks.time_s[-1])) if len(ticks.time_s) else (0.0, 0.0)
    )
    held = [event for event in recording.events if event.kind == "held"]
    seen = RunOutcome(
        status=RunStatus.UNFINISHED,
        cause=None,
        why="",
        retracted=False,
        safing=(),
        start_s=start_s,
        end_s=end_s,
        peak_force_n=largest_force_n(recording),
        zero_shift_n=math.nan,
        levels_done=sum(bool(event.data.get("loading")) for event in held),
        cycle=int(ticks.cycle[-1]) if len(ticks.cycle) else 0,
        touches=(),
        tares=(),
        lateness=_lateness(ticks),
        errors=(recording.damage,) if recording.damage else (),
    )
    results = recording.results
    return _with_results(seen, results) if results else _broken_off(seen, recording)


def _with_results(seen: RunOutcome, results: Mapping[str, Any]) -> RunOutcome:
    """The outcome that results.json holds."""
    cause, late = results.get("cause"), results.get("lateness") or {}
    return replace(
        seen,
        status=RunStatus(str(results.get("status", RunStatus.UNFINISHED))),
        cause=_cause(cause) if cause else None,
        why=str(results.get("why_it_ended", "")),
        safing=tuple(
            ActionResult(
                str(each["name"]), bool(each["sent"]), str(each["error"]), math.nan,
                float(each["duration_s"]),
            )
            for each in results.get("safing", ())
        ),
        end_s=seen.start_s + float(results.get("duration_s") or 0.0),
        zero_shift_n=number_or_nan(results.get("zero_shift_n")),
        levels_done=int(results.get("levels_done") or 0),
        cycle=int(results.get("cycle") or 0),
        lateness=Lateness(
            int(late.get("ticks") or 0), int(late.get("overruns") or 0),
            number_or_nan(late.get("worst_s")), number_or_nan(late.get("mean_s")),
        ),
        errors=tuple(str(each) for each in results.get("errors", ())),
    )  # fmt: skip


def _cause(told: Mapping[str, Any]) -> Cause:
    texts = ("rule", "unit", "message")
    return Cause._make(
        str(told[key]) if key in texts else number_or_nan(told[key]) for key in Cause._fields
    )


def _broken_off(seen: RunOutcome, recording: Recording) -> RunOutcome:
    """The outcome of an incomplete record, from its ticks and events."""
    ticks, ended = recording.ticks, [e for e in recording.events if e.kind == "end"]
    trips: list[Mapping[str, Any]] = [e.data for e in recording.events if e.kind == "trip"]
    cause = _cause(trips[0]) if trips else None
    if ended:
        status = RunStatus(str(ended[-1].data.get("status")))
        why = f"{ended[-1].data.get('why', '')} The record was not finished."
        return replace(seen, status=status, cause=cause, why=why)
    where = "before its first tick"
    if len(ticks.time_s):
        phase = Phase(int(ticks.phase[-1])).name.replace("_", " ").lower()
        where = f"in its cycle {int(ticks.cycle[-1])}, step {int(ticks.step[-1])} ({phase})"
    why = f"The record breaks off after {seen.end_s - seen.start_s:.1f} s, {where}."
    if cause is not None:
        why += f" The run had been stopped by {cause.rule}: {cause.message}{cause.numbers}."
    return replace(seen, cause=cause, why=why)


def _lateness(ticks: TickColumns) -> Lateness:
    """Lateness from the ticks; the period is the median one."""
    if len(ticks.time_s) < 2:
        return Lateness(len(ticks.time_s), 0, 0.0, 0.0)
    late_s, period_s = ticks.late_s, float(np.median(np.diff(ticks.time_s)))
    overruns = int(np.count_nonzero(late_s > period_s))
    return Lateness(len(late_s), overruns, float(late_s.max()), float(late_s.mean()))
