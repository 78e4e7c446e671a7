"""Files that other programs read: CSV, Parquet, Excel and HDF5 tables of one run."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from stepload.data.columns import library
from stepload.data.run import STREAMS, Run
from stepload.data.table import PHASE, Table
from stepload.errors import BadInputError, printable
from stepload.record.plain import json_text
from stepload.record.rows import Phase
from stepload.report.rows import Row
from stepload.report.run_results import SCHEMA_ID

EXCEL_ROWS = 1_048_575
"""Largest number of rows below the header in an Excel sheet."""
UNITS = {
    "_n_per_m": "N/m", "_m_per_n": "m/N", "_n_m": "N.m", "_rad": "rad", "_n": "N", "_m": "m",
    "_s": "s", "_c": "degC",
}  # fmt: skip
"""UDUNITS names by the end of a column's name, the longest first."""
SIGNALS = {"arm": "position_m", "displacement": "displacement_m", "second_force": "force_z_n"}
"""The column to plot, where it is not the force."""


class Format(StrEnum):
    """Format of an exported table."""

    CSV = "csv"
    PARQUET = "parquet"
    XLSX = "xlsx"
    HDF5 = "h5"


def tables(run: Run) -> tuple[dict[str, Table], str]:
    """Every table of a run by the name of its file: the curve, its levels, touches, raw streams.

    A run that ended before a contact has the raw streams only; the text says why.
    """
    raw: dict[str, Table | None] = {name: getattr(run, name) for name in STREAMS}
    found = {name: table for name, table in raw.items() if table is not None}
    try:
        curve = {
            "curve": run.curve,
            "levels": _of_objects(run.levels, "start_s"),
            "touches": _of_objects(run.touches, "time_s"),
        }
    except BadInputError as error:
        return found, error.message
    return curve | found, ""


def write_tables(
    run: Run, parts: Mapping[str, Table], directory: Path, format: Format
) -> list[Path]:
    """Write tables of a run into a directory; the files that were written.

    One file a table, `curve.csv`, `levels.csv` and so on; of Excel one book with a sheet for each
    table, of HDF5 one file. Units are in the names of the columns. A file that is there already is
    not overwritten, and a file that could not be finished is not left.

    Raises:
        BadInputError: the library for the format is missing, a file is there already or cannot be
            written, or a table is too long for a sheet of Excel.
    """
    about = {
        "run_id": run.run_id,
        "simulated": str(run.simulated).lower(),
        "partial": str(run.partial).lower(),
        **{k: run.metadata.get(k, "") for k in ("plan", "payload", "rig", "started", "stepload")},
    }
    if format in (Format.XLSX, Format.HDF5):
        named = (run.metadata.get("plan", "") or "run", run.run_id)
        # Texts of a record are not trusted: only safe letters become part of a file's name.
        stem = "-".join(re.sub(r"[^\w-]+", "_", text)[:80] for text in named if text)
        paths = {stem: directory / f"{stem}.{format.value}"}
    else:
        paths = {name: directory / f"{name}.{format.value}" for name in parts}
    for path in paths.values():
        if path.exists():
            raise BadInputError(f"{path} is there already", hint="--out names another directory")
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for name, path in paths.items():
            with _whole(path) as part:
                if format is Format.XLSX:
                    _book(part, parts, about)
                elif format is Format.HDF5:
                    _hdf5(part, run, parts, about)
                elif format is Format.CSV:
                    _csv(part, parts[name])
                else:
                    _parquet(part, parts[name], about)
    except OSError as error:
        raise BadInputError(f"{directory}: {error.strerror or error}") from error
    return list(paths.values())


@contextmanager
def _whole(path: Path) -> Iterator[Path]:
    """A temporary file that replaces `path` at the end of the block, or is removed on an error."""
    part = path.with_name(f"{path.name}.part")
    try:
        yield part
        part.rename(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def _of_objects(objects: Sequence[Row], time: str) -> Table:
    if not objects:
        return Table({time: np.empty(0)}, time)
    names = type(objects[0]).model_fields
    return Table(
        {name: np.array([getattr(each, name) for each in objects]) for name in names}, time
    )


def _texts(table: Table) -> dict[str, list[Any]]:
    """Columns as Python values; phases by their names."""
    columns = {name: column.tolist() for name, column in table.items()}
    if PHASE in columns:
        names = {int(phase): phase.name.lower() for phase in Phase}
        columns[PHASE] = [names[code] for code in columns[PHASE]]
    return columns


def _csv(path: Path, table: Table) -> None:
    """One header line with units in the names; numbers as Python writes them, exact."""
    columns = _texts(table)
    with path.open("w", newline="", encoding="utf-8") as file:
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
    excel = library("openpyxl", "an Excel file")
    book = excel.Workbook(write_only=True)
    sheet = book.create_sheet("about")
    for key, value in about.items():
        told = excel.cell.WriteOnlyCell(sheet, printable(value, 1000))
        told.data_type = "s"  # never a formula: anybody may have written the record
        sheet.append([key, told])
    for name, table in parts.items():
        columns = _texts(table)
        sheet = book.create_sheet(name)
        sheet.append(list(columns))
        for row in zip(*columns.values(), strict=True):
            sheet.append([None if value != value else value for value in row])
    book.save(path)


def _hdf5(path: Path, run: Run, parts: Mapping[str, Table], about: Mapping[str, str]) -> None:
    """NeXus base classes: NXdata for each table, with units, and the results."""
    h5py = library("h5py", "HDF5")
    told = {key: value.replace("\0", "") for key, value in {**run.metadata, **about}.items()}
    with h5py.File(path, "w", track_order=True) as file:
        file.attrs.update({"NX_class": "NXroot", "default": "entry", "creator": "stepload"})
        entry = _group(
            file, "entry", "NXentry", title=told["plan"], entry_identifier=told["run_id"],
            start_time=told["started"], program_name="stepload", notes=told.get("notes", ""),
        )  # fmt: skip
        entry.attrs.update({key: told[key] for key in about})
        entry.attrs["default"] = "curve" if "curve" in parts else "force"
        _group(entry, "user", "NXuser", name=told.get("operator", ""))
        told_of = {"name": told["payload"], "description": told.get("specimen", "")}
        _group(entry, "sample", "NXsample", **told_of)
        _group(entry, "instrument", "NXinstrument", name=told["rig"])
        axis = told.get("force_axis", "")[-1:] or "z"
        for name, table in parts.items():
            signal = f"force_{axis}_n" if name == "force" else SIGNALS.get(name, "force_n")
            _fill(_group(entry, name, "NXdata"), table, signal, h5py)
        if run.results is not None:
            kind = {"type": "application/json", "description": SCHEMA_ID}
            _group(entry, "results", "NXnote", data=json_text(run.results), **kind)


def _group(parent: Any, name: str, kind: str, /, **texts: str) -> Any:
    """A group of a NeXus class with text fields."""
    made = parent.create_group(name, track_order=True)
    made.attrs["NX_class"] = kind
    for key, text in texts.items():
        made[key] = text
    return made


def _fill(group: Any, table: Table, signal: str, h5py: Any) -> None:
    """Put the columns of a table into an NXdata group."""
    group.attrs.update({"axes": [table.time], f"{table.time}_indices": 0})
    if signal in table:
        group.attrs["signal"] = signal
    for key, values in table.items():
        kind: Any = h5py.string_dtype() if values.dtype.kind == "U" else values.dtype
        if key == PHASE:
            kind = h5py.enum_dtype({phase.name.lower(): phase for phase in Phase}, basetype="i1")
        column = group.create_dataset(key, data=np.asarray(values, kind), dtype=kind)
        if unit := next((unit for end, unit in UNITS.items() if f"_{key}".endswith(end)), ""):
            column.attrs["units"] = unit
