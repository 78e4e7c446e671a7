"""Reads a record in stretches of time, for those that are larger than memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stepload.errors import BadInputError
from stepload.record.reader import COLUMNS, Reading
from stepload.record.rows import (
    ArmColumns,
    DisplacementColumns,
    FloatArray,
    ForceColumns,
    TickColumns,
)
from stepload.record.scan import DamageError, open_scan

LATE_S = 5.0
"""A stream that is this much in s behind the newest one in the file is taken to have ended."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """All samples with start_s <= time < end_s; None for a stream that the record has not."""

    start_s: float
    end_s: float
    force: ForceColumns
    second_force: ForceColumns | None
    arm: ArmColumns
    displacement: DisplacementColumns | None
    ticks: TickColumns


def times_of(columns: Any) -> FloatArray:
    """The column of a stream that is its time on the run's clock, shape (N,), in s."""
    times: FloatArray = columns.time_s if hasattr(columns, "time_s") else columns.receive_time_s
    return times


class _Pending:
    """The samples of each stream that were read and not returned yet."""

    def __init__(self, reading: Reading, path: Path) -> None:
        self._reading, self._path = reading, path
        self._parts: dict[str, list[Any]] = {name: [] for name in COLUMNS}

    def take(self) -> None:
        """Take what the reading has gathered."""
        for name in COLUMNS:
            if self._reading.has(name):
                columns = self._reading.stream(name, self._path)
                if len(times_of(columns)):
                    self._parts[name].append(columns)

    def span(self) -> tuple[float, float]:
        """The first pending time, and the time up to which every living stream was read."""
        parts = [held for held in self._parts.values() if held]
        if not parts:
            return np.inf, -np.inf
        newest = [float(times_of(held[-1]).max()) for held in parts]
        first = min(float(times_of(held[0]).min()) for held in parts)
        return first, min(time for time in newest if time > max(newest) - LATE_S)

    def cut(self, start_s: float, end_s: float) -> Stretch:
        """The pending samples before `end_s`; the others stay pending."""
        found = {name: self._split(name, end_s) for name in COLUMNS}
        for name in ("second_force", "displacement"):
            if not self._reading.has(name):
                found[name] = None
        return Stretch(start_s, end_s, *found.values())

    def _split(self, name: str, end_s: float) -> Any:
        parts = self._parts[name] or [self._reading.stream(name, self._path)]
        kind = COLUMNS[name]
        whole = kind(*(np.concatenate(column) for column in zip(*parts, strict=True)))
        before = times_of(whole) < end_s
        rest = kind(*(column[~before] for column in whole))
        self._parts[name] = [rest] if len(times_of(rest)) else []
        return kind(*(column[before] for column in whole))


def read_stretches(path: Path, seconds: float) -> Iterator[Stretch]:
    """The record in stretches of `seconds`, from its first sample on; empty ones are left out.

    Where the file is damaged the stretches end with what is whole.

    Raises:
        BadInputError: not a record of stepload.
    """
    file, scan = open_scan(path)
    reading = Reading(scan)
    pending = _Pending(reading, path)
    begin_s = np.nan
    with file:
        try:
            for record in scan.records():
                reading.take(record)
                if not reading.gathered:
                    continue
                pending.take()
                first_s, whole_s = pending.span()
                if begin_s != begin_s and first_s < np.inf:
                    begin_s = first_s
                while whole_s > begin_s + seconds:
                    yield pending.cut(begin_s, begin_s + seconds)
                    begin_s += seconds
        except DamageError:
            pass
    if "run" not in reading.metadata:
        raise BadInputError(f"{path}: no record of a run")
    pending.take()
    while (first_s := pending.span()[0]) < np.inf:
        begin_s += seconds * max(0.0, np.floor((first_s - begin_s) / seconds))
        yield pending.cut(begin_s, begin_s + seconds)
        begin_s += seconds
