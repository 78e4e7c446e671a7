"""The rows of a table of numbers: in blocks, by numpy's reader where a block is plain.

A block that is not plain (a missing value, quotes, something that is no number) is read cell by
cell, so that what is refused is named with its place. The decimal mark is that of the first number
that has one; the other mark is refused, since "1,234" may be either.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from stepload.record.curve_header import Header

FloatArray = NDArray[np.float64]

MAX_LINE = 4096
MAX_ROWS = 20_000_000
_BLOCK = 1 << 20
_MISSING = frozenset({"", "-", "--", "nan", "na", "n/a", "#n/a", "null", "none", "nil"})


class RowError(Exception):
    """What is wrong in which line and column (both from 1)."""

    def __init__(self, line: int, column: int, message: str) -> None:
        super().__init__(message)
        self.line, self.column, self.message = line, column, message


@dataclass(slots=True)
class Table:
    """The rows with all numbers: `values` (N, C), `line` (N,) where each stands; what is missing.

    `missing` counts the rows dropped for a number that is missing, `first_missing` is the line,
    column and text of the first such cell.
    """

    values: FloatArray
    line: NDArray[np.int32]
    missing: int = 0
    first_missing: tuple[int, int, str] | None = None


@dataclass(slots=True)
class _Reader:
    header: Header
    decimal: str | None = None
    missing: int = 0
    first_missing: tuple[int, int, str] | None = None
    places: list[int] = field(default_factory=list)

    def plain(self, lines: Sequence[str]) -> FloatArray | None:
        """A block by numpy's reader; None where it is not plain."""
        text = "".join(lines)
        if '"' in text or "\x00" in text:
            return None
        delimiter, separators = self.header.delimiter, self.header.width - 1
        if delimiter is not None:
            if {line.count(delimiter) for line in lines} != {separators}:
                return None
        elif {len(line.split()) for line in lines} != {separators + 1}:
            return None
        if delimiter != "," and "," in text:
            if self.decimal != "," or "." in text:
                return None
            lines = text.replace(",", ".").splitlines()
        elif self.decimal == "," and "." in text:
            return None
        try:
            values = np.loadtxt(
                lines, np.float64, comments=None, delimiter=delimiter, usecols=self.places, ndmin=2
            )
        except ValueError:
            return None
        return values if len(values) == len(lines) and np.isfinite(values).all() else None

    def strict(self, lines: Sequence[str], numbers: Sequence[int]) -> tuple[FloatArray, list[int]]:
        """A block cell by cell: rows with a missing number are dropped and counted."""
        rows, kept = [], []
        for number, line in zip(numbers, lines, strict=True):
            if line.isspace():
                continue
            cells = line.rstrip("\r\n").split(self.header.delimiter)
            if len(cells) == self.header.width + 1 and not cells[-1].strip():
                cells.pop()
            if len(cells) != self.header.width:
                if not any(cell.strip(' "\t') for cell in cells):
                    self._drop(number, 1, "")
                    continue
                raise RowError(number, 1, f"{len(cells)} cells, the header has {self.header.width}")
            row = []
            for column in self.header.columns:
                text = cells[column.place].strip().strip('"').strip()
                at = sum(len(cell) + 1 for cell in cells[: column.place]) + 1
                value = self._number(text, number, at, column.name)
                if not math.isfinite(value):
                    self._drop(number, at, text)
                    break
                row.append(value)
            else:
                rows.append(row)
                kept.append(number)
        return np.array(rows, np.float64).reshape(-1, len(self.places)), kept

    def _drop(self, line: int, column: int, text: str) -> None:
        self.missing += 1
        self.first_missing = self.first_missing or (line, column, text)

    def _number(self, text: str, line: int, column: int, name: str) -> float:
        """A number; NaN where it is missing."""
        if text.lower() in _MISSING:
            return math.nan
        for mark in ".,":
            if mark in text:
                if self.decimal not in (None, mark):
                    raise RowError(
                        line, column, f"{name}: {text[:40]!r} where decimals have {self.decimal!r}"
                    )
                self.decimal = mark
        try:
            if "_" in text or not text.isascii():
                raise ValueError
            return float(text.replace(",", ".", 1))
        except ValueError:
            raise RowError(line, column, f"{name}: {text[:40]!r} is not a finite number") from None


def read_rows(file: TextIO, header: Header, number: int, first: Sequence[str] = ()) -> Table:
    """Read what follows the header.

    Args:
        file: the text behind what has been read.
        header: its columns.
        number: the lines that have been read so far, without `first`.
        first: lines that were read ahead.

    Raises:
        RowError: a cell that is no number, a row of another width, too long a line.
    """
    reader = _Reader(header, places=[column.place for column in header.columns])
    if header.delimiter == ",":
        reader.decimal = "."
    values: list[FloatArray] = [np.empty((0, len(header.columns)))]
    places: list[NDArray[np.int32]] = [np.empty(0, np.int32)]
    rows = 0
    for lines in _blocks(file, first):
        longest = max(map(len, lines))
        if longest > MAX_LINE:
            at = next(i for i, line in enumerate(lines) if len(line) > MAX_LINE)
            message = f"a line of more than {MAX_LINE} characters"
            raise RowError(number + at + 1, MAX_LINE, message)
        numbers, kept = _told(lines, number)
        number += len(lines)
        if not kept:
            continue
        plain = reader.plain(kept) if reader.decimal else None
        if plain is None:
            plain, numbers = reader.strict(kept, numbers)
        values.append(plain)
        places.append(np.array(numbers, np.int32))
        rows += len(plain)
        if rows > MAX_ROWS:
            raise RowError(number, 1, f"more than {MAX_ROWS} rows: thin the data out")
    return Table(
        np.concatenate(values), np.concatenate(places), reader.missing, reader.first_missing
    )


def _told(lines: list[str], before: int) -> tuple[list[int], list[str]]:
    """The lines that are neither empty nor comments, and their numbers."""
    text = "".join(lines)
    numbers = list(range(before + 1, before + len(lines) + 1))
    if "#" not in text and "\n\n" not in text and not text.startswith("\n"):
        return numbers, lines
    kept = [at for at in numbers if lines[at - before - 1].lstrip()[:1] not in ("", "#")]
    return kept, [lines[at - before - 1] for at in kept]


def _blocks(file: TextIO, first: Sequence[str]) -> Iterator[list[str]]:
    """Whole lines, about 1 MB at a time; none empty. Lines end with "\\n"."""
    if first:
        yield [line if line.endswith("\n") else line + "\n" for line in first]
    rest = ""
    while block := file.read(_BLOCK):
        block = rest + block
        end = block.rfind("\n") + 1
        if not end and len(block) > MAX_LINE:
            yield [block]
            return
        rest = block[end:]
        if end:
            yield _lines(block[:end])
    if rest:
        yield [rest + "\n"]


def _lines(text: str) -> list[str]:
    """Lines with their ends, split at "\\n" alone."""
    return [line + "\n" for line in text.split("\n")[:-1]]
