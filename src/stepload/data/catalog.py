"""The runs of a directory, one row each, from the summaries of their records alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from stepload.data.columns import library
from stepload.errors import BadInputError
from stepload.record.summary import Summary, read_summary
from stepload.record.untrusted import untrusted
from stepload.report.model import number_or_nan
from stepload.report.rows import OrNan, Row, figure

if TYPE_CHECKING:
    import pandas

RECORD, PART = "run.mcap", "run.mcap.part"
MOST_DEEP = 4
"""Levels of subdirectories that are searched."""


Text = Annotated[str, BeforeValidator(lambda value: value if isinstance(value, str) else "")]
Number = Annotated[OrNan, BeforeValidator(number_or_nan)]


def _began(meaning: str, key: str) -> Any:
    return figure(meaning, at=f"metadata.{key}", default="")


def _result(meaning: str, at: str) -> Any:
    return figure(meaning, at=f"results.{at}", default=math.nan)


class RunRow(Row):
    """One run by the summary of its record, whose content is not trusted.

    Texts are "" and numbers NaN where the record does not state them.
    """

    run_id: Text = _began("Twelve hexadecimal digits.", "run_id")
    started: Text = _began("ISO 8601 with time zone.", "started")
    payload: Text = _began("Name of the payload.", "payload")
    specimen: Text = _began("Which piece.", "specimen")
    batch: Text = _began("Which batch.", "batch")
    plan: Text = _began("Name of the plan.", "plan")
    rig: Text = _began("Name of the rig.", "rig")
    operator: Text = _began("Who ran it.", "operator")
    verdict: Text = figure("Of the evaluation.", default="")
    status: Text = figure('How it ended; "unfinished" without an end.', default="")
    chord_n_per_m: Number = _result("The headline.", "headline.value_n_per_m")
    low_n_per_m: Number = _result("Lower end, 95 %.", "headline.interval_n_per_m.0")
    high_n_per_m: Number = _result("Upper end, 95 %.", "headline.interval_n_per_m.1")
    secant_n_per_m: Number = figure("Secant of the fit to use.", default=math.nan)
    peak_force_n: Number = _result("Largest measured force.", "peak_force_n")
    simulated: bool = figure("A dry run.", default=False)
    tags: Text = figure("Free words.", default="")
    stepload: Text = _began("Version that ran it.", "stepload")
    path: Text = figure("Its record.")
    problem: Text = figure("Why the record could not be read.", default="")


COLUMNS = tuple(RunRow.model_fields)


class Runs(Row):
    """The runs of a directory, as `stepload runs --json` prints them."""

    schema_id: Literal["urn:stepload:runs:1"] = Field(
        alias="$schema", description="`$id` of this schema."
    )
    runs: tuple[RunRow, ...] = figure("One row each.")


def row_of(record: Path) -> RunRow:
    """A run by its record; `problem` says why it cannot be read."""
    try:
        with untrusted(record):
            return _told(read_summary(record))
    except BadInputError as error:
        return _unread(record, error.message.removeprefix(f"{record}: "))


def rows(directory: str | Path, read: Callable[[Path], RunRow] = row_of) -> list[RunRow]:
    """The runs in a directory and below, the oldest first.

    Args:
        read: in place of `row_of`, for one who keeps the rows.

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
        _unread(path, problem) if problem else read(path)
        for path, problem in _records(root, MOST_DEEP)
    ]
    return sorted(found, key=lambda row: (row.started, row.path))


def catalog(directory: str | Path) -> pandas.DataFrame:
    """The runs in a directory and below as a pandas DataFrame, the oldest first.

    Raises:
        BadInputError: it is no directory, or pandas is not installed.
    """
    pd = library("pandas", "the catalogue")
    frame = pd.DataFrame([row.model_dump() for row in rows(directory)], columns=COLUMNS)
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
    """Records in a directory and below; links and hidden entries are left out.

    Other files next to a run's record belong to that run; subdirectories are searched. A directory
    that cannot be read is returned with the reason, a record with "".
    """
    try:
        entries = sorted(directory.iterdir())
        record = next((r for n in (RECORD, PART) if _is_own(r := directory / n)), None)
    except OSError as error:
        yield directory, f"cannot be looked into: {error.strerror}"
        return
    if record is not None:
        yield record, ""
    for entry in entries:
        if entry.is_symlink() or entry.name.startswith("."):
            continue
        if entry.is_dir():
            if deep:
                yield from _records(entry, deep - 1)
        elif record is None and deep and entry.suffix == ".mcap" and _is_own(entry):
            yield entry, ""


def _is_own(path: Path) -> bool:
    """Whether a path is a file, and no link: to open a pipe would wait for ever."""
    return path.is_file() and not path.is_symlink()


def _unread(path: Path, problem: str) -> RunRow:
    return RunRow(path=str(path), problem=problem)


def _told(summary: Summary) -> RunRow:
    began, results = summary.metadata, summary.results or {}
    fits = results.get("fits")
    fit = fits.get(str(results.get("selected"))) if isinstance(fits, dict) else None
    return RunRow.model_validate(
        {
            "metadata": began,
            "results": results,
            "verdict": summary.outcome.get("verdict", results.get("verdict")),
            "status": results.get("status") or "unfinished",
            "secant_n_per_m": fit.get("secant_n_per_m") if isinstance(fit, dict) else None,
            "simulated": "true" in (began.get("simulated"), began.get("dry_run")),
            "tags": ", ".join(began.get("tags", "").split("\n")),
            "path": str(summary.path),
        }
    )
