"""The runs of a directory, one row each, from the summaries of their records alone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepload.data.columns import library
from stepload.errors import BadInputError
from stepload.record.summary import Summary, read_summary
from stepload.record.untrusted import untrusted

if TYPE_CHECKING:
    import pandas

RECORD, PART = "run.mcap", "run.mcap.part"
MOST_DEEP = 4
"""Levels of subdirectories that are searched."""


@dataclass(frozen=True, slots=True)
class RunRow:
    """One run; texts are "" and numbers NaN where the record does not state them.

    `verdict` is that of the evaluation; `status` says how the run ended, "unfinished" without an
    end. `chord_n_per_m` is the headline, `low_n_per_m` and `high_n_per_m` its 95 % interval.
    `problem` says why a record could not be read.
    """

    run_id: str
    started: str
    payload: str
    specimen: str
    batch: str
    plan: str
    rig: str
    operator: str
    verdict: str
    status: str
    chord_n_per_m: float
    low_n_per_m: float
    high_n_per_m: float
    secant_n_per_m: float
    peak_force_n: float
    simulated: bool
    tags: str
    stepload: str
    path: str
    problem: str = ""


COLUMNS = tuple(field.name for field in fields(RunRow))


def rows(directory: str | Path) -> list[RunRow]:
    """The runs in a directory and below, the oldest first.

    Raises:
        BadInputError: it is no directory.
    """
    root = Path(directory)
    if not root.is_dir():
        raise BadInputError(
            f"{root} is no directory",
            hint="name the directory that holds the runs; `stepload run` makes runs/",
        )
    found = [
        _unread(path, problem) if problem else _row(path)
        for path, problem in _records(root, MOST_DEEP)
    ]
    return sorted(found, key=lambda row: (row.started, row.path))


def catalog(directory: str | Path) -> pandas.DataFrame:
    """The runs in a directory and below as a pandas DataFrame, the oldest first.

    Raises:
        BadInputError: it is no directory, or pandas is not installed.
    """
    pd = library("pandas", "the catalogue")
    frame = pd.DataFrame([asdict(row) for row in rows(directory)], columns=COLUMNS)
    frame["started"] = pd.to_datetime(frame["started"], utc=True, errors="coerce", format="ISO8601")
    return frame


def chosen(
    found: Sequence[RunRow], wanted: Mapping[str, str], column: str, *, falling: bool = False
) -> list[RunRow]:
    """The rows whose columns contain the wanted texts, ignoring case, sorted by one column.

    Rows without the number come last.

    Raises:
        BadInputError: there is no such column.
    """
    for name in (*wanted, column):
        if name not in COLUMNS:
            raise BadInputError(f"no column {name!r}", hint=f"there are {', '.join(COLUMNS)}")
    rows = [
        row
        for row in found
        if all(text.lower() in str(getattr(row, name)).lower() for name, text in wanted.items())
    ]
    there = [row for row in rows if getattr(row, column) == getattr(row, column)]
    there.sort(key=lambda row: getattr(row, column), reverse=falling)
    return [*there, *(row for row in rows if getattr(row, column) != getattr(row, column))]


def find_run(text: str, directory: Path) -> Path:
    """The record of the run whose id begins with a text.

    Raises:
        BadInputError: there is none, or more than one.
    """
    if not directory.is_dir():
        raise BadInputError(
            f"{text}: no such file, and no directory {directory} of runs",
            hint="give the path of a record, or say where the runs are: STEPLOAD_RUNS",
        )
    wanted = text.lower()
    found = [row for row in rows(directory) if wanted and row.run_id.startswith(wanted)]
    if len(found) != 1:
        count = "no run" if not found else f"{len(found)} runs"
        raise BadInputError(
            f"{text}: no such file, and {count} in {directory} whose id begins so",
            hint=f"stepload runs {directory}",
        )
    return Path(found[0].path)


def _records(directory: Path, deep: int) -> Iterator[tuple[Path, str]]:
    """Records in a directory and below; links are not followed.

    Other files next to a run's record belong to that run; subdirectories are searched. A directory
    that cannot be read is returned with the reason, a record with "".
    """
    try:
        entries = sorted(directory.iterdir())
        record = next((r for n in (RECORD, PART) if (r := directory / n).is_file()), None)
    except OSError as error:
        yield directory, f"cannot be looked into: {error.strerror}"
        return
    if record is not None:
        yield record, ""
    for entry in entries:
        if entry.is_symlink():
            continue
        if entry.is_dir():
            if deep:
                yield from _records(entry, deep - 1)
        elif record is None and deep and entry.suffix == ".mcap":
            yield entry, ""


def _row(record: Path) -> RunRow:
    try:
        with untrusted(record):
            return _told(read_summary(record))
    except BadInputError as error:
        return _unread(record, error.message.removeprefix(f"{record}: "))


def _unread(path: Path, problem: str) -> RunRow:
    nothing = {f.name: math.nan if f.type == "float" else "" for f in fields(RunRow)}
    told: dict[str, Any] = {"simulated": False, "path": str(path), "problem": problem}
    return RunRow(**nothing | told)


def _told(summary: Summary) -> RunRow:
    began, results = summary.metadata, summary.results or {}
    names = (
        "run_id", "started", "payload", "specimen", "batch", "plan", "rig", "operator", "stepload",
    )  # fmt: skip
    headline = _mapping(results.get("headline"))
    interval = headline.get("interval_n_per_m")
    low, high = interval if isinstance(interval, list) and len(interval) == 2 else (None, None)
    fit = _mapping(_mapping(results.get("fits")).get(str(results.get("selected"))))
    return RunRow(
        **{name: began.get(name, "") for name in names},
        verdict=str(summary.outcome.get("verdict", results.get("verdict", ""))),
        status=str(results.get("status", "")) or "unfinished",
        chord_n_per_m=_number(headline.get("value_n_per_m")),
        low_n_per_m=_number(low),
        high_n_per_m=_number(high),
        secant_n_per_m=_number(fit.get("secant_n_per_m")),
        peak_force_n=_number(results.get("peak_force_n")),
        simulated="true" in (began.get("simulated"), began.get("dry_run")),
        tags=", ".join(began.get("tags", "").split("\n")),
        path=str(summary.path),
    )


def _mapping(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}


def _number(value: object) -> float:
    return float(value) if isinstance(value, (int, float)) else math.nan
