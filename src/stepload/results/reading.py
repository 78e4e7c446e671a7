"""How a record is read to be evaluated: whole, or as means where it is very long."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from stepload.errors import BadInputError
from stepload.record.reader import Recording, read_recording
from stepload.record.summary import read_summary

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
