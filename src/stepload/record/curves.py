"""Reads a force curve from a CSV file: strict about every cell, bounded in time and memory."""

from __future__ import annotations

import difflib
import math
from array import array
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn, TextIO

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError

FloatArray = NDArray[np.float64]

MAX_BYTES = 1 << 28
MAX_LINE = 4096
MIN_ROWS = 3
COLUMNS = ("time_s", "position_m", "displacement_m", "force_n")
_HINT = (
    "the first line names the columns: `time_s, position_m, force_n` (travel of the arm), "
    "or `displacement_m, force_n` (deformation, system stiffness already taken out)"
)


@dataclass(frozen=True, slots=True)
class Curve:
    """Columns of equal length N ≥ 3, finite.

    Exactly one of `position_m` (arm travel, with `time_s`) and `displacement_m` is there.
    """

    time_s: FloatArray | None
    position_m: FloatArray | None
    displacement_m: FloatArray | None
    force_n: FloatArray


@dataclass(frozen=True, slots=True)
class _Header:
    delimiter: str
    places: dict[str, int]
    width: int


def _fail(path: Path, line: int, column: int, message: str, hint: str = _HINT) -> NoReturn:
    raise BadInputError(f"{path}:{line}:{column}: {message}", hint=hint)


def _split(line: str, delimiter: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]


def _parse_header(path: Path, number: int, line: str) -> _Header:
    delimiter = max(",;\t", key=line.count)
    names = _split(line, delimiter)
    for name in COLUMNS:
        if names.count(name) > 1:
            _fail(path, number, 1, f"the column {name!r} is there {names.count(name)} times")
    places = {name: names.index(name) for name in COLUMNS if name in names}
    if "position_m" in places and "displacement_m" in places:
        _fail(path, number, 1, "both 'position_m' and 'displacement_m': which one is meant?")
    needed = ["force_n"]
    needed += [] if "displacement_m" in places else ["time_s", "position_m"]
    for name in needed:
        if name not in places:
            near = difflib.get_close_matches(name, [n for n in names if n not in COLUMNS], 1, 0.5)
            found = f"; is {near[0]!r} meant?" if near else f" among {', '.join(names)[:200]}"
            _fail(path, number, 1, f"no column {name!r}{found}")
    return _Header(delimiter, places, len(names))


def _number(text: str, decimal_comma: bool) -> float:
    """A finite number, or NaN."""
    if decimal_comma and "." not in text:
        text = text.replace(",", ".", 1)
    if "_" in text:
        return math.nan
    try:
        value = float(text)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


def _read_rows(path: Path, file: TextIO) -> dict[str, array[float]]:
    header: _Header | None = None
    columns: dict[str, array[float]] = {}
    number = 0
    while line := file.readline(MAX_LINE + 1):
        number += 1
        if len(line) > MAX_LINE:
            _fail(path, number, MAX_LINE, f"a line of more than {MAX_LINE} characters")
        stripped = line.strip()
        if not stripped or stripped.startswith("#"):
            continue
        if header is None:
            header = _parse_header(path, number, line.rstrip("\r\n"))
            columns = {name: array("d") for name in header.places}
            continue
        cells = line.rstrip("\r\n").split(header.delimiter)
        if len(cells) != header.width:
            _fail(path, number, 1, f"{len(cells)} cells, the header has {header.width}")
        for name, place in header.places.items():
            cell = cells[place].strip().strip('"').strip()
            value = _number(cell, header.delimiter != ",")
            if math.isnan(value):
                column = sum(len(c) + 1 for c in cells[:place]) + 1
                _fail(path, number, column, f"{name}: {cell[:40]!r} is not a finite number", "")
            if name == "time_s" and columns[name] and value < columns[name][-1]:
                _fail(path, number, 1, f"time_s goes back from {columns[name][-1]} to {value}", "")
            columns[name].append(value)
    if header is None:
        _fail(path, max(number, 1), 1, "the file is empty")
    if len(columns["force_n"]) < MIN_ROWS:
        _fail(path, number, 1, f"{len(columns['force_n'])} rows, at least {MIN_ROWS} are needed")
    return columns


def read_curve(path: Path) -> Curve:
    """Read a CSV file separated by comma, semicolon or tab (then also with decimal commas).

    Columns may stand in any order among others; empty lines and lines with # are skipped.

    Raises:
        BadInputError: with file:line:column, what is there and what is expected.
    """
    if not path.is_file():
        raise BadInputError(f"{path}: no such file" if not path.exists() else f"{path}: not a file")
    try:
        if path.stat().st_size > MAX_BYTES:
            raise BadInputError(
                f"{path}: {path.stat().st_size} bytes, limit {MAX_BYTES}",
                hint="thin the data out or cut them to the loading",
            )
        with path.open(encoding="utf-8-sig", newline=None) as file:
            columns = _read_rows(path, file)
    except UnicodeDecodeError as error:
        raise BadInputError(
            f"{path}: not UTF-8 text (byte {error.start}: {error.reason})"
        ) from None
    except OSError as error:
        raise BadInputError(f"{path}: {error.strerror}") from error
    arrays = {name: np.array(values, np.float64) for name, values in columns.items()}
    return Curve(
        time_s=arrays.get("time_s"),
        position_m=arrays.get("position_m"),
        displacement_m=arrays.get("displacement_m"),
        force_n=arrays["force_n"],
    )
