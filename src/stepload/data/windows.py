"""A record larger than memory, one stretch of time after the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from stepload.data.streams import tables_of
from stepload.data.table import Table
from stepload.errors import BadInputError
from stepload.record.stretches import read_stretches
from stepload.record.untrusted import untrusted
from stepload.results.saved import record_in


@dataclass(frozen=True, slots=True)
class Window:
    """The raw streams of start_s <= time < end_s on the run's clock; see `Run` for the tables."""

    start_s: float
    end_s: float
    force: Table
    second_force: Table | None
    arm: Table
    displacement: Table | None
    ticks: Table


def windows(path: str | Path, seconds: float = 60.0) -> Iterator[Window]:
    """The raw streams of a record in stretches of `seconds`, in the order of time.

    No more than a stretch and what a chunk holds is in memory at once. The tared force, the phase
    and the step are in `ticks`; the zero of the whole run is not known before its end, so there is
    no `curve`.

    Raises:
        BadInputError: `seconds` is not positive, or the file is no record of stepload.
    """
    if not 0.0 < seconds < float("inf"):
        raise BadInputError(f"windows of {seconds} s", hint="a positive number of seconds")
    file = record_in(Path(path))
    with untrusted(file):
        for stretch in read_stretches(file, seconds):
            yield Window(stretch.start_s, stretch.end_s, **tables_of(stretch))
