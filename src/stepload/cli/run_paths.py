"""Names of a run on the command line: its directory, its record, or its id."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

RUNS = "STEPLOAD_RUNS"
"""Environment variable of the directory in which a run id is looked up; by default `runs`."""


def runs_directory() -> Path:
    """The directory of the runs."""
    return Path(os.environ.get(RUNS) or "runs")


def run_path(text: str) -> Path:
    """The path for a text: a file, a directory, or the record of the run with this id.

    Raises:
        BadInputError: no run or more than one has an id that begins with it.
    """
    if os.path.lexists(text) or not _may_be_id(text):
        return Path(text)
    from stepload.data.catalog import find_run

    return find_run(text, runs_directory())


def run_directory(text: str) -> Path:
    """The directory of the run named by a text; raises as `run_path`."""
    path = run_path(text)
    return path.parent if path.is_file() else path


def _may_be_id(text: str) -> bool:
    return 6 <= len(text) <= 12 and all(letter in "0123456789abcdef" for letter in text.lower())


def run_ids(incomplete: str) -> list[str]:
    """Ids of runs that begin with a text, for the shell's completion; it completes paths itself."""
    if not _may_be_id(incomplete.ljust(6, "0")) or not runs_directory().is_dir():
        return []
    from stepload.data.catalog import rows

    return [row.run_id for row in rows(runs_directory()) if row.run_id.startswith(incomplete)]


RunPath = Annotated[
    Path,
    typer.Argument(
        parser=run_path,
        metavar="RUN",
        help="A run: its directory, its record, or its id.",
        autocompletion=run_ids,
    ),
]
RunOrCurve = Annotated[
    Path,
    typer.Argument(
        parser=run_path, metavar="FILE", help="A run (directory, record, id), or a CSV curve."
    ),
]
