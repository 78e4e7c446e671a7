"""The rows of a table of numbers: many at a time where all is plain, else cell by cell.

What is refused is named with its place, and every line that is no row is counted with its reason.
A mark with three digits behind it everywhere is asked about: "1,234" may be either.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from datetime import date

import numpy as np
from numpy.typing import NDArray

from stepload.record.curve_header import CLOCK, ERRORS, NUMBER, Column, Header, is_comment, split
from stepload.record.curve_mapping import Refusal
from stepload.record.curve_words import has_word, kind_of, scale_of, unit

FloatArray = NDArray[np.float64]

BLOCK = 8192
"""Rows that are converted at a time."""
MISSING, TEXT, STATISTICS = "without a number", "text", "statistics"
"""Reasons of lines that are no rows."""
_MISSING = ERRORS | {
    "", "-", "--", "nan", "na", "n/a", "null", "none", "nil", "inf", "-inf", "+inf",
}  # fmt: skip
_UNCLEAR = re.compile(r"[+\-−]?[1-9]\d{0,2}[.,]\d{3}")
"""A number whose mark may group thousands as well as begin the decimals."""
_FORM = r"([+-]?)([1-9]\d{{0,2}}(?:([{0}'’ \u00a0\u2009\u202f])\d{{3}})(?:\3\d{{3}})*|\d*)" \
    r"(?:[{1}](\d*))?([eE][+-]?\d+)?"  # fmt: skip
_VALUE = {mark: re.compile(_FORM.format(group, mark), re.ASCII) for mark, group in (".,", ",.")}
_PLAIN = b"0123456789+-.,eE \t\n;"
_LABEL = re.compile(r"^[\s,;]*([A-Za-z][^,;\t\n]*)", re.MULTILINE)
DAY_S = 86400.0


def number(text: str, decimal: str) -> float:
    """A number with this decimal mark and whole groups of thousands; NaN where it is none."""
    match = _VALUE[decimal].fullmatch(text.replace("−", "-"))
    if match is None or not (match[2] or match[4]):
        return math.nan
    return float(f"{match[1]}{re.sub('[^0-9]', '', match[2])}.{match[4] or ''}{match[5] or ''}")


def decimal_mark(lines: Sequence[str], header: Header) -> str:
    """The decimal mark of the used columns; raises Refusal where their numbers do not show it.

    A mark is clear where both are in a number, where it is there twice, or where it has not three
    digits behind it. A column without a clear mark takes that of the others only if it is the same.
    """
    columns = [column for column in header.columns if column.unit != "clock"]
    shown: dict[str, str] = {}
    unclear: dict[int, tuple[int, str, str]] = {}
    for at in range(header.begin, len(lines)):
        if "," not in (line := lines[at]) and "." not in line:
            continue
        cells = split(line, header.delimiter)
        for column in columns.copy():
            text = cells[column.place] if column.place < len(cells) else ""
            whole = column.unit_place != column.place
            match = NUMBER.fullmatch(text) if whole else NUMBER.match(text)
            if match is None or not (mark := _mark(match[0])):
                continue
            if mark == "?":
                unclear.setdefault(column.place, (at + 1, column.name, match[0]))
                continue
            columns.remove(column)
            unclear.pop(column.place, None)
            shown.setdefault(mark, f"{column.name}: {match[0]!r}")
            if len(shown) > 1:
                one, other = shown
                raise Refusal(f"{shown[other]} where decimals have {one!r} ({shown[one]})", at + 1,
                              decimal=one, hint=f"or {other}")  # fmt: skip
        if not columns:
            break
    decimal = next(iter(shown), ".")
    for line_at, name, text in unclear.values():
        if not shown or decimal not in text:
            bare, mark = re.sub("[.,]", "", text), "," if "," in text else "."
            other = "," if decimal == "." else "."
            raise Refusal(
                f"{name}: {text!r} may be {bare} or {text.replace(',', '.')}: every mark has three "
                "digits behind it", line_at, decimal=decimal,
                hint=f"{bare if mark != decimal else text}; or --decimal {other}",
            )  # fmt: skip
    return decimal


def _mark(text: str) -> str:
    """The decimal mark that a number shows; "" for none, "?" where it may group as well."""
    marks = [mark for mark in ".," if mark in text]
    if len(marks) == 2:
        return max(marks, key=text.rfind)
    if not marks or _UNCLEAR.fullmatch(text):
        return "?" * len(marks)
    return {".": ",", ",": "."}[marks[0]] if text.count(marks[0]) > 1 else marks[0]


class Table:
    """The rows below a header.

    Attributes:
        values: (N, C) rows with all numbers; SI where the unit is in the cells.
        line: (N,) where each is, from 1.
        left_out: line, column and text of what is no row, by reason.
        missing: how many of them are rows of the table.
        again: rows (from 0) above which the names are repeated.
        stop: index of the line with which another table begins; None where none does.
    """

    def __init__(
        self, lines: Sequence[str], header: Header, decimal: str, another: Callable[[int], bool]
    ) -> None:
        """Read what follows the header.

        Args:
            lines: of the whole file.
            another: whether another table begins with the line of this index.

        Raises:
            Refusal: a cell that is no number, a row of another width.
        """
        self.header, self.decimal, self.another, self.end = header, decimal, another, len(lines)
        self.places = [column.place for column in header.columns]
        self.names = [name.lower() for name in header.names]
        self.simple = all(c.unit_place is None and c.unit != "clock" for c in header.columns)
        self.line: list[int] = []
        self.left_out: dict[str, list[tuple[int, int, str]]] = {}
        self.missing, self.again, self.clock = 0, list[int](), _Clock()
        self.stop: int | None = None
        begin = [line for line in lines[header.begin : header.begin + 9] if line.strip()]
        self.numbers_first = any(_is_value(split(x, header.delimiter)[0]) for x in begin)
        parts = [np.empty((0, len(self.places)))]
        for start in range(header.begin, len(lines), BLOCK):
            block = lines[start : start + BLOCK]
            if self.stop is not None or not any(block):
                continue
            values = self.plain(block)
            if values is None:
                rows = [row for at, line in enumerate(block, start) if (row := self.row(at, line))]
                values = np.array(rows, np.float64).reshape(-1, len(self.places))
            else:
                self.line.extend(range(start + 1, start + 1 + len(block)))
            parts.append(values)
        self.values: FloatArray = np.concatenate(parts)

    def plain(self, block: Sequence[str]) -> FloatArray | None:
        """The values of a block that holds nothing but rows; None where it may not."""
        text, delimiter, width = "\n".join(block), self.header.delimiter, self.header.width
        odd = not self.simple or self.stop is not None or STATISTICS in self.left_out
        if odd or not text.isascii() or any(mark in text for mark in '"#_\0'):
            return None
        if text.encode().translate(None, _PLAIN):
            labels = set(_LABEL.findall(text))
            if labels and (self.numbers_first or any(has_word(x, "statistics") for x in labels)):
                return None
        if self.decimal == ",":
            if "." in text or delimiter == ",":
                return None
            block = text.replace(",", ".").split("\n")
        if delimiter is None:
            widths = {len(line.split()) for line in block}
        else:
            widths = {line.count(delimiter) + 1 for line in block}
        if widths != {width}:
            return None
        try:
            found = np.loadtxt(
                block, comments=None, delimiter=delimiter, usecols=self.places, ndmin=2
            )
        except ValueError:
            return None
        return found if len(found) == len(block) and np.isfinite(found).all() else None

    def row(self, at: int, line: str) -> list[float] | None:
        """The numbers of a line; None for one that is no row, which is counted."""
        text, header = line.strip(), self.header
        if not text or self.stop is not None:
            return None
        cells = split(line, header.delimiter)
        if is_comment(text):
            marked = (
                len(cells) == header.width
                and len(cells) > 1
                and all(_is_value(cells[place].lstrip("# ")) for place in self.places)
            )
            self.missing += marked
            return self.leave(MISSING if marked else "comments", at, text)
        if len(cells) == header.width + 1 and not cells[-1]:
            cells.pop()
        if [cell.lower() for cell in cells] == self.names and any(self.names):
            self.again.append(len(self.line))
            return self.leave("names again", at, text)
        used = [cells[place] if place < len(cells) else "" for place in self.places]
        first = next(filter(None, cells), "")
        if not NUMBER.match(first) and has_word(first, "statistics"):
            return self.leave(STATISTICS, at, first)
        label = first != "" and not _is_value(first)
        if label and (self.numbers_first or not any(map(_is_value, used))):
            if all(not cell or unit(cell) for cell in cells):
                for column, cell in zip(header.columns, used, strict=True):
                    if cell and column.unit_from == "row of units" and unit(cell) != column.unit:
                        raise Refusal(f"{column.name} in {cell} from here, {column.unit} above",
                                      at + 1, hint="a file of its own")  # fmt: skip
                return self.leave("units again", at, text)
            if self.another(at):
                self.stop = at
                return None
            self.missing += len(cells) == header.width
            return self.leave(TEXT, at, text)
        if len(cells) < header.width and at >= self.end - 2 and first:
            return self.leave("cut off", at, text)
        if len(cells) != header.width and first:
            hint = "decimal commas and commas between the cells: export with semicolons"
            twice = header.delimiter == "," and len(cells) > header.width
            raise Refusal(f"{len(cells)} cells, the header has {header.width}", at + 1,
                          hint=hint if twice else "")  # fmt: skip
        row = []
        for column, cell in zip(header.columns, used, strict=True):
            value = math.nan
            try:
                if cell.lower() not in _MISSING:
                    value = self.value(column, cell, cells, at + 1)
            except Refusal as error:
                error.column = self.start(line, column)
                raise
            if not math.isfinite(value):
                self.missing += 1
                return self.leave(MISSING, at, cell, self.start(line, column))
            row.append(value)
        if foot := self.left_out.get(STATISTICS):
            raise Refusal(f"numbers below the statistics in line {foot[-1][0]}", at + 1)
        self.line.append(at + 1)
        return row

    def start(self, line: str, column: Column) -> int:
        """The character, from 1, at which a cell begins, where no delimiter is quoted."""
        return sum(len(x) + 1 for x in line.split(self.header.delimiter)[: column.place]) + 1

    def value(self, column: Column, cell: str, cells: Sequence[str], line: int) -> float:
        """The number in a cell, in SI where its unit is in the cells; raises Refusal."""
        if column.unit == "clock":
            value, scale = self.clock.read(cell, line), 1.0
        elif column.unit_place is None:
            value, scale = number(cell, self.decimal), 1.0
        else:
            match = NUMBER.match(cell)
            bare = match[0] if match else cell
            own = column.unit_place == column.place
            told = cell[len(bare) :].strip() if own else cells[column.unit_place]
            symbol = unit(told) or ""
            if kind_of(symbol) != kind_of(column.unit):
                what = f"{told[:40]!r} is no unit of a {kind_of(column.unit)}"
                raise Refusal(f"{column.name}: {what}", line)
            value, scale = number(bare, self.decimal), scale_of(symbol)
        if math.isnan(value):
            what = f"{column.name}: {cell[:40]!r} "
            other = "," if self.decimal == "." else "."
            if not math.isnan(number(cell, other)):
                raise Refusal(f"{what}where decimals have {self.decimal!r}", line)
            raise Refusal(f"{what}is not a finite number", line)
        return value * scale

    def leave(self, reason: str, at: int, text: str, column: int = 1) -> list[float] | None:
        """Count a line that is no row; None."""
        self.left_out.setdefault(reason, []).append((at + 1, column, text))
        return None


def _is_value(cell: str) -> bool:
    """Whether a cell is that of a row: a number, a clock's time, or a sign that one is missing."""
    found = NUMBER.match(cell) or CLOCK.match(cell)
    return bool(found) or (cell != "" and cell.lower() in _MISSING)


class _Clock:
    """Times of day in seconds from the first day."""

    def __init__(self) -> None:
        self.day, self.last_s = 0, -math.inf
        self.date = ""
        self.first: date | None = None

    def read(self, text: str, line: int) -> float:
        """Seconds; NaN where it is no clock's time.

        Raises:
            Refusal: the date changes and is not written as 2026-11-28 or 28.11.2026.
        """
        if (match := CLOCK.fullmatch(text)) is None:
            return math.nan
        hour = int(match["h"])
        if match["half"]:
            hour = hour % 12 + 12 * (match["half"].lower() == "pm")
        of_day_s = hour * 3600.0 + int(match["m"]) * 60.0 + float(match["s"].replace(",", "."))
        if (told := (match["date"] or "").rstrip("T ")) != self.date or not told:
            self.next_day(told, of_day_s, line)
        self.last_s = of_day_s + self.day * DAY_S
        return self.last_s

    def next_day(self, told: str, of_day_s: float, line: int) -> None:
        if not told:
            self.day += of_day_s + self.day * DAY_S < self.last_s - DAY_S / 2.0  # past midnight
            return
        parts = "-".join(reversed(told.split("."))) if "." in told else told.replace("/", "-")
        try:
            found = date.fromisoformat(parts)
        except ValueError:
            if self.date:
                message = f"the date {told} may be of another day or month"
                raise Refusal(message, line, columns=(("time", "none"),),
                              hint="read without the time") from None  # fmt: skip
        else:
            self.first = self.first or found
            self.day = (found - self.first).days
        self.date = told
