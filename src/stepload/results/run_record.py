"""A finished run, read from its record."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

import numpy as np

from stepload.errors import BadInputError
from stepload.estimators.conditions import Conditions
from stepload.record.outcome import RunStatus
from stepload.record.reader import Event, Recording, read_recording
from stepload.record.summary import read_summary
from stepload.record.untrusted import untrusted
from stepload.results.certificate import started_on
from stepload.results.conditions import from_attachments, measured
from stepload.results.press_data import PressData, press_data
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
