"""Reads a force curve from a table of text: strict about every cell, bounded in time and memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn, TextIO

import numpy as np

from stepload.contact.curve_factors import FACTORED
from stepload.errors import BadInputError
from stepload.record.curve_header import (
    HINT,
    LATERAL,
    Header,
    HeaderError,
    delimiter_of,
    may_be_machine,
    parse_header,
    split,
)
from stepload.record.curve_rows import MAX_LINE, FloatArray, RowError, Table, read_rows
from stepload.units import percent

MAX_BYTES = 1 << 26
MIN_ROWS = 3
MAX_PREAMBLE = 400
"""Lines that an instrument may write before the names of the columns."""
MISSING_SHARE = 0.05
"""A larger share of rows without all numbers is refused."""


@dataclass(frozen=True, slots=True)
class Curve:
    """Columns of equal length N ≥ 3, finite, SI.

    Attributes:
        time_s: times that do not fall; None where the file has none.
        position_m, displacement_m: exactly one of the two is there: travel of the machine, or the
            payload's deformation.
        force_n: force.
        lateral_n: (C, N) components of the lateral force; None where the file has none.
        notes: what was skipped, dropped and converted, in sentences.
        perhaps_machine: name of the column of displacement where it may hold the deflection of the
            machine as well; "" where it says that it does not.
    """

    time_s: FloatArray | None
    position_m: FloatArray | None
    displacement_m: FloatArray | None
    force_n: FloatArray
    lateral_n: FloatArray | None = None
    notes: tuple[str, ...] = ()
    perhaps_machine: str = ""


def _fail(path: Path, line: int, column: int, message: str, hint: str = HINT) -> NoReturn:
    raise BadInputError(f"{path}:{line}:{column}: {message}", hint=hint)


@dataclass(frozen=True, slots=True)
class _Head:
    """The header, its line, how many lines were read, one read ahead, and what `FACTORED` says."""

    header: Header
    at: int
    read: int
    ahead: tuple[str, ...] = ()
    factored: tuple[str, ...] = ()


def _lines(path: Path, file: TextIO) -> Iterator[str]:
    number = 0
    while number < MAX_PREAMBLE and (line := file.readline(MAX_LINE + 1)):
        number += 1
        if len(line) > MAX_LINE:
            _fail(path, number, MAX_LINE, f"a line of more than {MAX_LINE} characters")
        yield line.rstrip("\n")


def _is_row(line: str) -> bool:
    """Whether a line holds numbers only: the data have begun."""
    delimiter = delimiter_of(line)
    cells = [cell for cell in split(line, delimiter) if cell]
    if delimiter != ",":
        cells = [cell.replace(",", ".", 1) for cell in cells]
    try:
        return bool([float(cell) for cell in cells])
    except ValueError:
        return False


def _find_header(path: Path, file: TextIO) -> _Head:
    """The first line that names force and travel, among those that an instrument writes above.

    The line below it may hold the units. Numbers end the search; the comment above them may have
    been the header. What looks most like a header is what is refused.
    """
    best: tuple[int, HeaderError] | None = None
    last, comments, number = "", [], 0
    factored: tuple[str, ...] = ()
    for number, line in enumerate(_lines(path, file), 1):
        text = line.strip()
        if text.startswith("#"):
            comments.append((number, text.lstrip("# ")))
            factored = tuple(told for _, told in comments if told.startswith(FACTORED))
        if not text or text.startswith("#"):
            continue
        try:
            return _Head(parse_header(line), number, number, (), factored)
        except HeaderError as error:
            if best is None or error.known > best[1].known:
                best = number, error
        if last:
            try:
                return _Head(parse_header(last, line), number - 1, number, (), factored)
            except HeaderError:
                pass
        last = line
        if _is_row(text):
            for at, comment in reversed(comments):
                try:
                    return _Head(parse_header(comment), at, number - 1, (line,), factored)
                except HeaderError as error:
                    if error.known > best[1].known:
                        best = at, error
            break
    if best is None:
        _fail(path, max(number, 1), 1, "the file is empty")
    _fail(path, best[0], 1, best[1].message, best[1].hint)


def read_curve(path: Path) -> Curve:
    """Read a table separated by comma, semicolon or tab (then also with decimal commas) or spaces.

    Columns may stand in any order among others; empty lines and comments after # are skipped. Rows
    in which a number is missing are dropped and counted.

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
        try:
            return _read(path, "utf-8-sig")
        except UnicodeDecodeError as error:
            if not _western(path):
                raise BadInputError(
                    f"{path}: not UTF-8 text (byte {error.start}: {error.reason})"
                ) from None
        return _read(path, "cp1252")
    except OSError as error:
        raise BadInputError(f"{path}: {error.strerror}") from error


def _western(path: Path) -> bool:
    """Whether the file may be in a western encoding: few bytes beyond ASCII, no controls."""
    with path.open("rb") as file:
        block = np.frombuffer(file.read(1 << 16), np.uint8)
    control = (block < 9) | ((block > 13) & (block < 32))
    return not control.any() and float(np.mean(block > 127)) < 0.02


def _read(path: Path, encoding: str) -> Curve:
    with path.open(encoding=encoding, newline=None) as file:
        head = _find_header(path, file)
        try:
            table = read_rows(file, head.header, head.read, head.ahead)
        except RowError as error:
            _fail(path, error.line, error.column, error.message, "")
    return _curve(path, head, table)


def _curve(path: Path, head: _Head, table: Table) -> Curve:
    rows, missing = len(table.values), len(table.missing)
    if missing > MISSING_SHARE * (rows + missing):
        line, at, text = table.missing[0]
        share = f"{missing} of {rows + missing} rows lack a number"
        _fail(
            path, line, at, f"{text[:40]!r} is not a finite number; {share}",
            f"at most {percent(MISSING_SHARE, 2)} may be missing: cut the file to what was "
            f"measured",
        )  # fmt: skip
    if rows < MIN_ROWS:
        last = table.line[-1] if rows else head.read
        _fail(path, last, 1, f"{rows} rows, at least {MIN_ROWS} are needed")
    found: dict[str, list[FloatArray]] = {}
    for column, values in zip(head.header.columns, table.values.T, strict=True):
        scaled = values if column.scale == 1.0 else values * column.scale
        found.setdefault(column.role, []).append(np.ascontiguousarray(scaled))
    if "time_s" in found:
        _in_order(path, table, found["time_s"][0])
    return Curve(
        time_s=found["time_s"][0] if "time_s" in found else None,
        position_m=found["position_m"][0] if "position_m" in found else None,
        displacement_m=found["displacement_m"][0] if "displacement_m" in found else None,
        force_n=found["force_n"][0],
        lateral_n=np.stack(found[LATERAL]) if LATERAL in found else None,
        notes=tuple(_notes(head, table)),
        perhaps_machine=next((c.name[:60] for c in head.header.columns if may_be_machine(c)), ""),
    )


def _in_order(path: Path, table: Table, time_s: FloatArray) -> None:
    back = np.flatnonzero(np.diff(time_s) < 0.0)
    if back.size:
        at = int(back[0])
        _fail(
            path, table.line[at + 1], 1,
            f"time_s goes back from {time_s[at]:.12g} to {time_s[at + 1]:.12g}",
            "one test in one file: cut it where the next begins",
        )  # fmt: skip


def _notes(head: _Head, table: Table) -> Iterator[str]:
    if head.at > 1:
        yield f"the columns are named in line {head.at}; what stands above was skipped"
    yield from head.factored
    for column in head.header.columns:
        if column.name != column.role:
            unit = column.unit or "SI"
            yield f"the column {column.name[:60]!r} in {unit} is read as {column.role}"
    if missing := len(table.missing):
        line, _, text = table.missing[0]
        rows = "row" if missing == 1 else "rows"
        yield (
            f"{missing} of {len(table.values) + missing} {rows} dropped: a number is missing "
            f"(first in line {line}: {text[:20]!r})"
        )
