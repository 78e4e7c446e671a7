"""A finished run, read from its record, and evaluated again from it alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import date, datetime
from pathlib import Path
from typing import Any

import numpy as np

from stepload.errors import BadInputError, RefusedError
from stepload.feasibility.preflight import preflight_of
from stepload.feasibility.stiffness import plan_where_it_stands
from stepload.identification.conditions import Conditions
from stepload.plan.load import load_kept
from stepload.plan.model import Plan
from stepload.record.outcome import ActionResult, Cause, Lateness, RunOutcome, RunStatus
from stepload.record.reader import Event, Recording, read_recording
from stepload.record.rows import Phase, TickColumns
from stepload.record.summary import read_summary
from stepload.record.untrusted import of_damaged, untrusted
from stepload.report.analyse import Evaluation, evaluate
from stepload.report.conditions import Stated, from_attachments, measured
from stepload.report.model import number_or_nan
from stepload.report.press_data import PressData, press_data
from stepload.rig.device import ArmConfiguration
from stepload.rig.pose import from_texts

WHOLE_TICKS, MEAN_TICKS = 250_000, 80_000
"""A run longer than the first is evaluated as so many means."""


def read_to_evaluate(path: Path, ticks: int | None = None) -> Recording:
    """Read a record as every evaluation of it does, so that all of them find the same numbers.

    Args:
        path: the record.
        ticks: how many the run had; None: as its own results tell. A record without any is read
            whole.

    Raises:
        BadInputError: as `read_recording`.
    """
    return read_recording(path, condensed(told_ticks(path) if ticks is None else ticks))


def condensed(ticks: int) -> int:
    """How many samples are read as one mean, to bound the memory that a long run takes."""
    return 1 if ticks <= WHOLE_TICKS else -(-ticks // MEAN_TICKS)


def told_ticks(path: Path) -> int:
    """How many ticks a run had by the results in its record; 0 where they do not tell."""
    results: Mapping[str, object] = {}
    with suppress(BadInputError):  # reading the whole of it says better what is wrong
        results = read_summary(path).results or {}
    lateness = results.get("lateness")
    ticks = lateness.get("ticks") if isinstance(lateness, Mapping) else None
    return ticks if isinstance(ticks, int) else 0


RECORD = "run.mcap"
PART = RECORD + ".part"
LONGEST_LABEL = 40


@dataclass(frozen=True, slots=True)
class SavedRun:
    """Content of a record; `partial`: it was not finished, `events`: the events by time.

    `label` is its name among several runs, see `labelled`; "" for a single run. `cut` says why the
    run was not completed; "" where it was. `peak_force_n` is that of the whole run, see
    `largest_force_n`.
    """

    path: Path
    data: PressData
    conditions: Conditions
    metadata: Mapping[str, str]
    partial: bool
    events: Sequence[Event] = ()
    label: str = ""
    cut: str = ""
    peak_force_n: float = math.nan

    @property
    def name(self) -> str:
        """Its displayed name: its label, or its plan and id."""
        plan, run_id = self.metadata.get("plan", ""), self.metadata.get("run_id", "")
        return self.label or f"{plan or self.path.stem} {run_id}".strip()

    @property
    def place(self) -> str:
        """The name of its directory, or of its file where that has a name of its own."""
        if self.path.name in (RECORD, PART):
            return self.path.absolute().parent.name or self.path.stem
        return self.path.stem

    @property
    def simulated(self) -> bool:
        """Whether it was a dry run."""
        return self.metadata.get("dry_run") == "true"

    @property
    def stood(self) -> ArmConfiguration | None:
        """The arm's configuration when it was opened; None where it was not recorded."""
        return from_texts(self.metadata)

    @property
    def day(self) -> date:
        """The day on which it was started.

        Raises:
            BadInputError: the record does not state it.
        """
        text = self.metadata.get("started", "")
        if (day := started_on(text)) is None:
            raise BadInputError(
                f"{self.path}: the record says it was started at {text!r}, which is no time"
            )
        return day


def started_on(text: str) -> date | None:
    """The day of a time stamp of a record; None where it is invalid."""
    try:
        return datetime.fromisoformat(text).date()
    except ValueError:
        return None


def labelled(runs: Sequence[SavedRun]) -> tuple[SavedRun, ...]:
    """The runs, each with a unique label: its specimen, or its location.

    Where two labels would be equal, all get their location added, or their ids.
    """
    plain = [_short(run.metadata.get("specimen", "") or run.place) for run in runs]
    kept = [_short(f"{name} ({run.place})") for name, run in zip(plain, runs, strict=True)]
    ids = [
        f"{name} ({run.metadata.get('run_id') or number})"
        for number, (name, run) in enumerate(zip(plain, runs, strict=True), 1)
    ]
    labels = next((each for each in (plain, kept) if len(set(each)) == len(each)), ids)
    return tuple(replace(run, label=label) for run, label in zip(runs, labels, strict=True))


def _short(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= LONGEST_LABEL else f"{line[: LONGEST_LABEL - 1]}…"


def record_in(path: Path) -> Path:
    """The record at a path: the file itself, or that in the directory of a run.

    For a run that was never finished it is the unfinished record.

    Raises:
        BadInputError: the directory holds none.
    """
    if not path.is_dir():
        return path
    for name in (RECORD, PART):
        if (path / name).exists():
            return path / name
    raise BadInputError(f"{path} holds no {RECORD}", hint="name the directory of one run")


def saved_run(path: Path) -> SavedRun:
    """Read a record, or the directory of a run.

    Raises:
        BadInputError: it is no record of ours, or ended before there was a contact.
    """
    file = path / RECORD if path.is_dir() else path
    if path.is_dir() and not file.exists():
        raise BadInputError(
            f"{path} holds no {RECORD}",
            hint=f"repair an unfinished record first: stepload recover {path / RECORD}.part",
        )
    with untrusted(file):
        recording = read_to_evaluate(file)
        conditions = from_attachments(recording.attachments)
        data = press_data(recording, across=conditions.across)
        return SavedRun(
            path=file,
            data=data,
            conditions=measured(conditions, data),
            metadata=recording.metadata,
            partial=recording.partial,
            events=recording.events,
            cut=_cut(recording),
            peak_force_n=largest_force_n(recording),
        )


def largest_force_n(recording: Recording) -> float:
    """Size in N of the largest force of a run, NaN where its record does not tell.

    Ticks tell it as well as the results do: those of earlier versions hold that of the first
    loading, and of a long record not every tick is read.
    """
    told = (recording.results or {}).get("peak_force_n")
    sizes = np.append(
        np.abs(recording.ticks.force_n), told if isinstance(told, int | float) else math.nan
    )
    known = sizes[np.isfinite(sizes)]
    return float(known.max()) if known.size else math.nan


def _cut(recording: Recording) -> str:
    """Why a run was not completed, or its record does not show that it was; else ""."""
    told = recording.results or {}
    status = str(told.get("status", RunStatus.UNFINISHED))
    cause = told.get("cause")
    if isinstance(cause, Mapping):
        return f"stopped by {cause.get('rule')}: {cause.get('message')}"
    if status != RunStatus.COMPLETED:
        return f"{status}: {told.get('why_it_ended', '')}".rstrip(": ")
    return "its record is damaged" if recording.partial else ""


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
            preflight_of(plan), outcome_of(recording), recording,
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
