"""The rows of a table of numbers: many at a time where all is plain, else cell by cell.

What is refused is named with its place, and every line that is no row is counted with its reason.
A mark with three digits behind it everywhere is asked about: "1,234" may be either.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import date

import numpy as np
from numpy.typing import NDArray

from stepload.record.curve_header import CLOCK, ERRORS, NUMBER, Column, Header, is_comment, split
from stepload.record.curve_mapping import Refusal
from stepload.record.curve_words import has_word, kind_of, scale_of, unit

FloatArray = NDArray[np.float64]

MAX_LINE = 4096
BLOCK = 8192
"""Rows that are converted at a time."""
MISSING = "without a number"
"""Reason of a row in which a number is missing."""
_MISSING = ERRORS | {
    "",
    "-",
    "--",
    "nan",
    "na",
    "n/a",
    "null",
    "none",
    "nil",
    "inf",
    "-inf",
    "+inf",
}
_UNCLEAR = re.compile(r"[1-9]\d{0,2}[.,]\d{3}")
"""A number whose mark may group thousands as well as begin the decimals."""
_GROUPS = r"([+-]?)(\d{{1,3}}(?:([{0}'’ \u00a0\u2009\u202f])\d{{3}})(?:\3\d{{3}})*|\d*)" \
    r"(?:[{1}](\d*))?([eE][+-]?\d+)?"  # fmt: skip
_VALUE = {".": re.compile(_GROUPS.format(",", "."), re.ASCII),
          ",": re.compile(_GROUPS.format(".", ","), re.ASCII)}  # fmt: skip
_DAY_S = 86400.0


@dataclass(slots=True)
class Table:
    """The rows with all numbers: `values` (N, C), `line` (N,) where each is, from 1.

    `left_out` has line, column and text of what is no row, by reason; `missing` how many of them
    are rows of the table. `again`: rows (from 0) above which the names are repeated. `stop`: index
    of the line with which another table begins.
    """

    values: FloatArray
    line: list[int]
    decimal: str
    left_out: dict[str, list[tuple[int, int, str]]]
    missing: int = 0
    again: list[int] = field(default_factory=list)
    stop: int | None = None


def number(text: str, decimal: str) -> float:
    """A number with this decimal mark and whole groups of thousands; NaN where it is none."""
    match = _VALUE[decimal].fullmatch(text.replace("−", "-"))
    if match is None:
        return math.nan
    sign, whole, _, part, power = match.groups()
    try:
        return float(f"{sign}{re.sub(r'[^0-9]', '', whole)}.{part or ''}{power or ''}")
    except ValueError:
        return math.nan


def decimal_mark(lines: Sequence[str], header: Header) -> str:
    """The decimal mark of the used columns; raises Refusal where their numbers do not show it.

    A mark is clear where both are in a number, where it is there twice, or where it has not three
    digits behind it. A column without a clear mark takes that of the others only if it is the same.
    """
    columns = [column for column in header.columns if column.unit != "clock"]
    shown: dict[str, tuple[int, str]] = {}
    unclear: dict[int, tuple[int, str, str]] = {}
    for at in range(header.begin, len(lines)):
        line = lines[at]
        if "," not in line and "." not in line:
            continue
        cells = split(line, header.delimiter)
        for column in columns:
            text = cells[column.place] if column.place < len(cells) else ""
            match = NUMBER.match(text)
            mark = _mark(match[0]) if match else ""
            if mark == "?":
                unclear.setdefault(column.place, (at + 1, column.name, match[0] if match else ""))
            elif mark:
                shown.setdefault(mark, (at + 1, f"{column.name}: {text[:40]!r}"))
                columns = [each for each in columns if each is not column]
                unclear.pop(column.place, None)
        if not columns:
            break
    if len(shown) > 1:
        (mark, (_, one)), (_, (line_at, other)) = shown.items()
        raise Refusal(
            f"{other} where decimals have {mark!r} ({one})", line_at, hint="or the other mark",
            decimal=mark,
        )  # fmt: skip
    decimal = next(iter(shown), ".")
    for line_at, name, text in unclear.values():
        if not shown or (decimal not in text):
            bare = re.sub("[.,]", "", text)
            raise Refusal(
                f"{name}: {text!r} may be {bare} or {re.sub('[.,]', '.', text)}: every mark has "
                "three digits behind it", line_at, decimal="," if "." in text else ".",
                hint=f"it groups: {bare}; else --decimal {'.' if '.' in text else ','}",
            )  # fmt: skip
    return decimal


def _mark(text: str) -> str:
    """The decimal mark that a number shows; "" for none, "?" where it may group as well."""
    point, comma = text.rfind("."), text.rfind(",")
    if point < 0 and comma < 0:
        return ""
    if point >= 0 and comma >= 0:
        return "." if point > comma else ","
    mark = "." if point >= 0 else ","
    if text.count(mark) > 1:
        return "," if mark == "." else "."
    return "?" if _UNCLEAR.fullmatch(text.lstrip("+-−")) else mark


def read_rows(
    lines: Sequence[str], header: Header, decimal: str, another: Callable[[int], bool]
) -> Table:
    """Read what follows the header.

    Args:
        lines: of the whole file.
        header: its columns and where they begin.
        decimal: mark.
        another: whether another table begins with the line of this index.

    Raises:
        Refusal: a cell that is no number, a row of another width, too long a line.
    """
    rows = _Rows(lines, header, decimal, another)
    parts: list[FloatArray] = []
    for start in range(header.begin, len(lines), BLOCK):
        block = lines[start : start + BLOCK]
        values = rows.plain(block)
        if values is None:
            values = rows.strict(start, block)
        else:
            rows.line.extend(range(start + 1, start + 1 + len(block)))
        parts.append(values)
        if rows.stop is not None:
            break
    values = np.concatenate(parts) if parts else np.empty((0, len(header.columns)))
    return Table(values, rows.line, decimal, rows.left, rows.missing, rows.again, rows.stop)


class _Rows:
    """What has been read so far."""

    def __init__(
        self, lines: Sequence[str], header: Header, decimal: str, another: Callable[[int], bool]
    ) -> None:
        self.header, self.decimal, self.another, self.count = header, decimal, another, len(lines)
        self.line: list[int] = []
        self.left: dict[str, list[tuple[int, int, str]]] = {}
        self.again: list[int] = []
        self.missing = 0
        self.text = ""
        self.stop: int | None = None
        self.names = [name.lower() for name in header.names]
        self.places = [column.place for column in header.columns]
        self.clock = _Clock()
        self.simple = all(c.unit_place is None and c.unit != "clock" for c in header.columns)

    def plain(self, block: Sequence[str]) -> FloatArray | None:
        """The values of a block that holds nothing but rows; None where it may not."""
        text, delimiter = "\n".join(block), self.header.delimiter
        if not self.simple or not text.isascii() or any(mark in text for mark in '"#_\x00'):
            return None
        if self.decimal == ",":
            if "." in text or delimiter == ",":
                return None
            block = text.replace(",", ".").split("\n")
        count = (lambda line: len(line.split())) if delimiter is None else (
            lambda line: line.count(delimiter) + 1)  # fmt: skip
        if set(map(count, block)) != {self.header.width}:
            return None
        if 0 not in self.places and any(line[:1].isalpha() for line in block):
            return None
        try:
            values = np.loadtxt(
                block, comments=None, delimiter=delimiter, usecols=self.places, ndmin=2
            )
        except ValueError:
            return None
        return values if len(values) == len(block) and np.isfinite(values).all() else None

    def strict(self, start: int, block: Sequence[str]) -> FloatArray:
        """The values of a block, line by line."""
        rows: list[list[float]] = []
        for at, line in enumerate(block, start):
            row = self.row(at, line, len(self.line))
            if self.stop is not None:
                break
            if row is not None:
                rows.append(row)
                self.line.append(at + 1)
        return np.array(rows, np.float64).reshape(-1, len(self.places))

    def row(self, at: int, line: str, count: int) -> list[float] | None:
        """The numbers of a line; None for one that is no row, which is counted."""
        self.text, text = line, line.strip()
        if not text:
            return None
        if is_comment(text):
            return self.leave("comments", at, text)
        cells = split(line, self.header.delimiter)
        if len(cells) == self.header.width + 1 and not cells[-1]:
            cells.pop()
        if [cell.lower() for cell in cells] == self.names and any(self.names):
            self.again.append(count)
            return self.leave("names again", at, text)
        used = [cells[place] if place < len(cells) else "" for place in self.places]
        first = next(filter(None, cells), "")
        if not NUMBER.match(first) and has_word(first, "statistics"):
            return self.leave("statistics", at, first)
        if first and first.lower() not in _MISSING and not any(map(_is_number, (first, *used))):
            if all(unit(cell.strip("[]()")) or not cell for cell in cells):
                return self.leave("units again", at, text)
            if self.another(at):
                self.stop = at
                return None
            self.missing += len(cells) == self.header.width
            return self.leave("text", at, text)
        if len(cells) != self.header.width:
            if not first:
                self.missing += 1
                return self.leave(MISSING, at, "")
            if len(cells) < self.header.width and at >= self.count - 2:
                return self.leave("cut off", at, text)
            raise Refusal(f"{len(cells)} cells, the header has {self.header.width}", at + 1)
        row = []
        for column, cell in zip(self.header.columns, used, strict=True):
            value = math.nan
            if cell.lower() not in _MISSING:
                value = self.value(column, cell, cells, at)
            if not math.isfinite(value):
                self.missing += 1
                return self.leave(MISSING, at, cell, self.column(cells, column))
            row.append(value)
        return row

    def value(self, column: Column, cell: str, cells: Sequence[str], at: int) -> float:
        """The number in a cell, in SI where its unit is in the cells."""
        scale = 1.0
        if column.unit == "clock":
            value = self.clock.read(cell, at)
        else:
            if column.unit_place is not None:
                match = NUMBER.match(cell)
                bare = match[0] if match else cell
                told = cell[len(bare) :] if column.unit_place == column.place else (
                    cells[column.unit_place])  # fmt: skip
                symbol = unit(told) or ""
                if kind_of(symbol) != kind_of(column.unit):
                    what = f"{column.name}: {told.strip()[:40]!r} is no unit of a "
                    what += kind_of(column.unit)
                    raise Refusal(what, at + 1, self.column(cells, column))
                cell, scale = bare, scale_of(symbol)
            value = number(cell, self.decimal)
        if math.isnan(value):
            other = "," if self.decimal == "." else "."
            what = f"{column.name}: {cell[:40]!r} "
            if not math.isnan(number(cell, other)):
                raise Refusal(f"{what}where decimals have {self.decimal!r}", at + 1,
                              self.column(cells, column), decimal=other)  # fmt: skip
            what += "is not a finite number" + self.inside(cell)
            raise Refusal(what, at + 1, self.column(cells, column))
        return value * scale

    def inside(self, cell: str) -> str:
        """What is said of a unit behind the number of one row only."""
        match = NUMBER.match(cell)
        told = match and unit(cell[match.end() :])
        return f": {told} here and not in the first row" if told else ""

    def column(self, cells: Sequence[str], column: Column) -> int:
        """The character (from 1) at which a cell begins, where nothing is quoted."""
        raw = cells if '"' in self.text else self.text.split(self.header.delimiter)
        return sum(len(cell) + 1 for cell in raw[: column.place]) + 1

    def leave(self, reason: str, at: int, text: str, column: int = 1) -> None:
        self.left.setdefault(reason, []).append((at + 1, column, text))


def _is_number(cell: str) -> bool:
    return bool(NUMBER.match(cell) or CLOCK.match(cell)) or cell.lower() in _MISSING - {""}


class _Clock:
    """Times of day with or without a date, in seconds from the first day."""

    def __init__(self) -> None:
        self.first_day: int | None = None
        self.last_s = -math.inf
        self.added_s = 0.0
        self.unclear = ""

    def read(self, text: str, at: int) -> float:
        """Seconds; NaN where it is no clock's time.

        Raises:
            Refusal: the date changes and its day and month may be either.
        """
        match = CLOCK.fullmatch(text)
        if match is None:
            return math.nan
        hour = int(match["h"])
        if match["half"]:
            hour = hour % 12 + 12 * (match["half"].lower() == "pm")
        of_day = hour * 3600.0 + int(match["m"]) * 60.0 + float(match["s"].replace(",", "."))
        if (zone := match["zone"]) and zone != "Z":
            offset = int(zone[1:3]) * 3600.0 + int(zone[-2:]) * 60.0
            of_day -= offset if zone[0] == "+" else -offset
        if match["date"] is not None:
            return of_day + _DAY_S * self.day(match["date"], at)
        if of_day + self.added_s < self.last_s - _DAY_S / 2.0:
            self.added_s += _DAY_S  # past midnight
        self.last_s = of_day + self.added_s
        return self.last_s

    def day(self, text: str, at: int) -> int:
        first, second, third = (int(part) for part in re.split(r"[-./]", text))
        if first <= 31 and "." not in text:
            self.unclear = self.unclear or text
            if text == self.unclear:
                return 0
            raise Refusal(
                f"the date changes from {self.unclear} to {text}: day or month may be first",
                at + 1, columns=(("time", "none"),), hint="read without the time",
            )  # fmt: skip
        try:
            year, month, day = (first, second, third) if first > 31 else (third, second, first)
            number = date(year, month, day).toordinal()
        except ValueError as error:
            raise Refusal(f"{text!r}: {error}", at + 1, columns=(("time", "none"),)) from None
        self.first_day = number if self.first_day is None else self.first_day
        return number - self.first_day
