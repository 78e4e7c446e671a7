"""Files that other programs read: CSV, Parquet and Excel tables of one run."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from stepload.data.libraries import library
from stepload.data.opened import Run
from stepload.data.table import PHASE, Table
from stepload.errors import BadInputError
from stepload.record.rows import Phase

EXCEL_ROWS = 1_048_575
"""Rows below the header that a sheet of Excel takes."""


class Format(StrEnum):
    """What a table is written as."""

    CSV = "csv"
    PARQUET = "parquet"
    XLSX = "xlsx"


def tables(run: Run) -> dict[str, Table]:
    """Every table of a run by the name of its file: the curve, its levels, touches, raw streams.

    Of a run that ended before there was a contact there are the raw streams alone.
    """
    found: dict[str, Table] = {}
    try:
        found["curve"] = run.curve
        found["levels"] = _of_objects(run.levels, "start_s")
        found["touches"] = _of_objects(run.touches, "time_s")
    except BadInputError:
        found.clear()
    raw = {
        "force": run.force,
        "second_force": run.second_force,
        "arm": run.arm,
        "displacement": run.displacement,
        "ticks": run.ticks,
    }
    return found | {name: table for name, table in raw.items() if table is not None}


def write_tables(run: Run, directory: Path, format: Format) -> list[Path]:
    """Write every table of a run into a directory; the files that were written.

    One file a table, `curve.csv`, `levels.csv` and so on; of Excel one book with a sheet for each
    table. Units are in the names of the columns. A file that is there already is not overwritten.

    Raises:
        BadInputError: the library for the format is missing, a file is there already or cannot be
            written, or a table is too long for a sheet of Excel.
    """
    parts = tables(run)
    about = {
        "run_id": run.run_id,
        "simulated": str(run.simulated).lower(),
        "partial": str(run.partial).lower(),
        **{k: run.metadata.get(k, "") for k in ("plan", "payload", "rig", "started", "stepload")},
    }
    try:
        directory.mkdir(parents=True, exist_ok=True)
        if format is Format.XLSX:
            path = directory / f"{run.metadata.get('plan', '') or 'run'}-{run.run_id}.xlsx"
            _refuse_existing([path])
            _book(path, parts, about)
            return [path]
        paths = {name: directory / f"{name}.{format.value}" for name in parts}
        _refuse_existing(list(paths.values()))
        write = _WRITERS[format]
        for name, path in paths.items():
            write(path, parts[name], about)
        return list(paths.values())
    except OSError as error:
        raise BadInputError(f"{directory}: {error.strerror}") from error


def _refuse_existing(paths: list[Path]) -> None:
    for path in paths:
        if path.exists():
            raise BadInputError(f"{path} is there already", hint="name another directory")


def _of_objects(objects: tuple[Any, ...], time: str) -> Table:
    if not objects:
        return Table({time: np.empty(0)}, time)
    first = asdict(objects[0])
    return Table(
        {name: np.array([getattr(each, name) for each in objects]) for name in first}, time
    )


def _texts(table: Table) -> dict[str, list[Any]]:
    """Columns as Python values; phases by their names."""
    columns = {name: column.tolist() for name, column in table.items()}
    if PHASE in columns:
        names = {int(phase): phase.name.lower() for phase in Phase}
        columns[PHASE] = [names[code] for code in columns[PHASE]]
    return columns


def _csv(path: Path, table: Table, about: Mapping[str, str]) -> None:
    """One header line with units in the names; numbers as Python writes them, exact."""
    columns = _texts(table)
    with path.open("x", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))


def _parquet(path: Path, table: Table, about: Mapping[str, str]) -> None:
    parquet = library("pyarrow.parquet", "Parquet")
    arrow = table.to_arrow()
    told = {f"stepload.{key}": value for key, value in about.items()}
    parquet.write_table(arrow.replace_schema_metadata(told), path, compression="zstd")


def _book(path: Path, parts: Mapping[str, Table], about: Mapping[str, str]) -> None:
    for name, table in parts.items():
        if table.rows > EXCEL_ROWS:
            raise BadInputError(
                f"{name} has {table.rows} rows, a sheet of Excel takes {EXCEL_ROWS}",
                hint="--parquet or --csv take all of them",
            )
    book = library("openpyxl", "an Excel file").Workbook(write_only=True)
    sheet = book.create_sheet("about")
    for pair in about.items():
        sheet.append(list(pair))
    for name, table in parts.items():
        columns = _texts(table)
        sheet = book.create_sheet(name)
        sheet.append(list(columns))
        for row in zip(*columns.values(), strict=True):
            sheet.append([None if value != value else value for value in row])
    book.save(path)


_WRITERS: Mapping[Format, Callable[[Path, Table, Mapping[str, str]], None]] = {
    Format.CSV: _csv,
    Format.PARQUET: _parquet,
}
