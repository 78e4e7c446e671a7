"""The rows of a table of numbers: by numpy's reader where all is plain, else cell by cell.

What is refused is named with its place. The decimal mark is that of the first number that has one;
the other mark is refused, since "1,234" may be either, and so are commas that may all group.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from stepload.record.curve_header import Header

FloatArray = NDArray[np.float64]

MAX_LINE = 4096
_ERRORS = frozenset({"#n/a", "#ref!", "#div/0!", "#value!", "#name?", "#num!", "#null!"})
"""What a spreadsheet writes in place of a number."""
_MISSING = _ERRORS | {"", "-", "--", "nan", "na", "n/a", "null", "none", "nil"}
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
"""A number whose comma may group thousands as well as begin the decimals."""


class RowError(Exception):
    """What is wrong in which line and column (both from 1)."""

    def __init__(self, line: int, column: int, message: str) -> None:
        super().__init__(message)
        self.line, self.column, self.message = line, column, message


@dataclass(slots=True)
class Table:
    """The rows with all numbers: `values` (N, C), `line` (N,) where each stands.

    `missing` has line, column and text of the cell for which a row was dropped.
    """

    values: FloatArray
    line: Sequence[int]
    missing: Sequence[tuple[int, int, str]] = ()


def read_rows(file: TextIO, header: Header, number: int, first: Sequence[str] = ()) -> Table:
    """Read what follows the header; empty lines and comments after # are skipped.

    Args:
        file: the text behind what has been read.
        header: its columns.
        number: the lines that have been read so far, without `first`.
        first: lines that were read ahead.

    Raises:
        RowError: a cell that is no number, a row of another width, too long a line.
    """
    lines = [*first, *file.read().split("\n")]
    for at, line in enumerate(lines, number + 1):
        if len(line) > MAX_LINE:
            raise RowError(at, MAX_LINE, f"a line of more than {MAX_LINE} characters")
    numbers = [at for at, x in enumerate(lines, number + 1) if _is_row(x, header.delimiter)]
    kept = [lines[at - number - 1] for at in numbers]
    _require_decimals(kept, numbers, header)
    values = _plain(kept, header) if kept else None
    return _strict(kept, numbers, header) if values is None else Table(values, numbers)


def _is_row(line: str, delimiter: str | None) -> bool:
    """Whether a line is no comment: a # in it may be the error of a spreadsheet."""
    text = line.strip()
    if not text.startswith("#"):
        return bool(text)
    return text.split(delimiter, 1)[0].strip(' "').lower() in _ERRORS


def _require_decimals(lines: Sequence[str], numbers: Sequence[int], header: Header) -> None:
    """Refuse commas that group thousands, or may: one that cannot shows that all begin decimals."""
    if header.delimiter == ",":
        return
    first: tuple[int, str, str] | None = None
    for number, line in zip(numbers, lines, strict=True):
        if "," not in line:
            continue
        cells = line.split(header.delimiter)
        for column in header.columns:
            text = cells[column.place].strip(' "\t') if column.place < len(cells) else ""
            if "," in text and not _GROUPED.fullmatch(text):
                return
            if "," in text and first is None:
                first = number, column.name, text
    if first is not None:
        number, name, text = first
        raise RowError(
            number, 1,
            f"{name}: {text!r} may be {text.replace(',', '')} or {text.replace(',', '.')}; every"
            " comma has three digits behind it. Write the numbers without grouping, or decimals"
            " with a point",
        )  # fmt: skip


def _plain(lines: Sequence[str], header: Header) -> FloatArray | None:
    """The table by numpy's reader; None where it is not plain."""
    text, delimiter = "\n".join(lines), header.delimiter
    cells = {line.count(delimiter) + 1 if delimiter else len(line.split()) for line in lines}
    if cells != {header.width} or '"' in text or "\x00" in text:
        return None
    if delimiter != "," and "," in text:
        if "." in text:
            return None
        lines = text.replace(",", ".").split("\n")
    places = [column.place for column in header.columns]
    try:
        values = np.loadtxt(
            lines, np.float64, comments=None, delimiter=delimiter, usecols=places, ndmin=2
        )
    except ValueError:
        return None
    return values if len(values) == len(lines) and np.isfinite(values).all() else None


def _strict(lines: Sequence[str], numbers: Sequence[int], header: Header) -> Table:
    """The table cell by cell: rows with a missing number are dropped."""
    decimal = "." if header.delimiter == "," else None
    rows: list[list[float]] = []
    kept: list[int] = []
    missing: list[tuple[int, int, str]] = []
    for number, line in zip(numbers, lines, strict=True):
        cells = line.split(header.delimiter)
        if len(cells) == header.width + 1 and not cells[-1].strip():
            cells.pop()
        if len(cells) != header.width:
            if any(cell.strip(' "\t') for cell in cells):
                raise RowError(number, 1, f"{len(cells)} cells, the header has {header.width}")
            missing.append((number, 1, ""))
            continue
        row: list[float] = []
        for column in header.columns:
            text = cells[column.place].strip().strip('"').strip()
            at = sum(len(cell) + 1 for cell in cells[: column.place]) + 1
            value = math.nan
            if text.lower() not in _MISSING:
                for mark in ".,":
                    if mark in text and decimal not in (None, mark):
                        what = f"{column.name}: {text[:40]!r} where decimals have {decimal!r}"
                        raise RowError(number, at, what)
                    decimal = mark if mark in text else decimal
                value = _number(text)
                if math.isnan(value):
                    what = f"{column.name}: {text[:40]!r} is not a finite number"
                    raise RowError(number, at, what)
            if not math.isfinite(value):
                missing.append((number, at, text))
                break
            row.append(value)
        else:
            rows.append(row)
            kept.append(number)
    values = np.array(rows, np.float64).reshape(-1, len(header.columns))
    return Table(values, kept, missing)


def _number(text: str) -> float:
    """A number; NaN where it is none."""
    try:
        return float(text.replace(",", ".", 1)) if text.isascii() and "_" not in text else math.nan
    except ValueError:
        return math.nan
