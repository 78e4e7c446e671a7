"""The rows of a table of numbers: many at a time where all is plain, else cell by cell.

What is refused is named with its place, and every line that is no row is counted with its reason.
A mark with three digits behind it everywhere is asked about: "1,234" may be either.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from stepload.record.curve_header import ERRORS, NUMBER, Column, Header, is_comment, split
from stepload.record.curve_mapping import NONE, Refusal
from stepload.record.curve_words import TRAVELS, has_word, kind_of, role, scale_of, unit

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
_OTHER = {".": ",", ",": "."}
_PLAIN = b"0123456789+-.,eE \t\n;"
_ODD = re.compile(r"^[\s,;]*[^\d\s+\-.,;]|[^\x01-\x7f]|[\"#_]", re.MULTILINE)
"""A line that does not begin with a number, or anything but numbers and words."""
DAY_S = 86400.0


def number(text: str, decimal: str) -> float:
    """A number with this decimal mark and whole groups of thousands; NaN where it is none."""
    match = _VALUE[decimal].fullmatch(text.replace("−", "-"))
    if match is None or not (match[2] or match[4]) or (match[3] and match[5]):
        return math.nan  # nor 0,125 nor 1,234e3 group thousands
    return float(f"{match[1]}{re.sub('[^0-9]', '', match[2])}.{match[4] or ''}{match[5] or ''}")


def decimal_mark(lines: Sequence[str], header: Header) -> str:
    """The decimal mark of the used columns; raises Refusal where their numbers do not show it.

    A mark is clear where both are in a number, where it is there twice, or where it has not three
    digits behind it. A column without a clear mark takes that of the others only if it is the same.
    """
    columns = [column for column in header.columns if column.unit != "clock"]
    decimal, unclear = "", dict[int, tuple[int, str, str]]()
    for at, line in enumerate(lines[header.begin :], header.begin + 1):
        if not columns:
            break
        if "," not in line and "." not in line:
            continue
        cells = split(line, header.delimiter)
        for column in columns.copy():
            text = cells[column.place] if column.place < len(cells) else ""
            match = (NUMBER.match if column.unit_place == column.place else NUMBER.fullmatch)(text)
            if match is None or not (mark := _mark(match[0])):
                continue
            if mark == "?":
                unclear.setdefault(column.place, (at, column.name, match[0]))
                continue
            columns.remove(column)
            unclear.pop(column.place, None)
            decimal = decimal or mark
    for at, name, text in unclear.values():
        if not decimal or decimal not in text:
            mark, bare, point = decimal or ".", re.sub("[.,]", "", text), text.replace(",", ".")
            raise Refusal(
                f"{name}: {text!r} may be {bare} or {point}: every mark has three digits behind it",
                at, decimal=mark,
                hint=f"{point if mark in text else bare}; or --decimal {_OTHER[mark]}",
            )  # fmt: skip
    return decimal or "."


def _mark(text: str) -> str:
    """The decimal mark that a number shows; "" for none, "?" where it may group as well."""
    marks = [mark for mark in ".," if mark in text]
    if len(marks) == 2:
        return max(marks, key=text.rfind)
    if not marks or _UNCLEAR.fullmatch(text):
        return "?" * len(marks)
    return _OTHER[marks[0]] if text.count(marks[0]) > 1 else marks[0]


@dataclass(slots=True)
class LeftOut:
    """Lines of one reason that are no rows: how many, and place and text of the first."""

    reason: str
    lines: int
    first_line: int
    column: int
    text: str


class Table:
    """The rows below a header.

    `values`: (N, C) rows with all numbers; SI where the unit is in the cells. `line`: (N,) where
    each is, from 1. `left_out`: what is no row, by reason, of which `missing` are rows of the
    table. `again`: rows (from 0) above which the names are repeated. `stop`: index of the line with
    which another table begins; None where none does.
    """

    def __init__(self, lines: Sequence[str], header: Header, decimal: str) -> None:
        """Of all lines; raises Refusal: a cell that is no number, a row of another width."""
        self.header, self.end = header, len(lines)
        self.decimal = decimal or decimal_mark(lines, header)
        self.places = [column.place for column in header.columns]
        self.names = [name.lower() for name in header.names]
        self.simple = all(c.unit_place is None and c.unit != "clock" for c in header.columns)
        self.line: list[int] = []
        self.left_out: dict[str, LeftOut] = {}
        self.missing, self.again = 0, list[int]()
        self.first: datetime | None = None
        self.days, self.last_s = 0, -math.inf
        self.stop: int | None = None
        begin = [line for line in lines[header.begin : header.begin + 9] if line.strip()]
        self.numbers_first = any(_is_value(split(x, header.delimiter)[0]) for x in begin)
        parts = [np.empty((0, len(self.places)))]
        for start in range(header.begin, len(lines), BLOCK):
            block = lines[start : start + BLOCK]
            if (values := self.plain(block)) is None:
                rows = [row for at, line in enumerate(block, start) if (row := self.row(at, line))]
                values = np.array(rows, np.float64).reshape(-1, len(self.places))
            else:
                self.line.extend(range(start + 1, start + 1 + len(block)))
            parts.append(values)
            if self.stop is not None:
                break
        self.values: FloatArray = np.concatenate(parts)

    def plain(self, block: Sequence[str]) -> FloatArray | None:
        """The values of a block that holds nothing but rows of numbers; None where it may not."""
        text, delimiter = "\n".join(block), self.header.delimiter
        if not self.simple or STATISTICS in self.left_out:
            return None
        if text.encode().translate(None, _PLAIN) and (not self.numbers_first or _ODD.search(text)):
            return None
        if self.decimal == ",":
            if "." in text or delimiter == ",":
                return None
            block = text.replace(",", ".").split("\n")
        if delimiter is None:
            widths = {len(line.split()) for line in block}
        else:
            widths = {line.count(delimiter) + 1 for line in block}
        if widths != {self.header.width}:
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
        text, width = line.strip(), self.header.width
        if not text or self.stop is not None:
            return None
        cells = split(line, self.header.delimiter)
        if is_comment(text):
            bare = [cell.lstrip("# ") for cell in cells]
            marked = len(cells) == width > 1 and all(_is_value(bare[x]) for x in self.places)
            self.missing += marked
            return self.leave(MISSING if marked else "comments", at, text)
        if len(cells) == width + 1 and not cells[-1]:
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
                for column, cell in zip(self.header.columns, used, strict=True):
                    other = unit(cell) != column.unit and column.unit_place is None
                    if other and kind_of(unit(cell) or "") == kind_of(column.unit) != "":
                        raise Refusal(f"{column.name} in {cell} from here, {column.unit} above",
                                      at + 1, hint="a file of its own")  # fmt: skip
                return self.leave("units again", at, text)
            roles = set(map(role, split(text, None) if len(cells) == 1 else cells))
            if "force_n" in roles and roles & TRAVELS:
                self.stop = at
                return None
            self.missing += len(cells) == width
            return self.leave(TEXT, at, text)
        if len(cells) < width and at >= self.end - 2 and first:
            return self.leave("cut off", at, text)
        if len(cells) != width and first:
            hint = "decimal commas and commas between the cells: export with semicolons"
            twice = self.header.delimiter == "," and len(cells) > width
            raise Refusal(f"{len(cells)} cells, the header has {width}", at + 1,
                          hint=hint if twice else "")  # fmt: skip
        row = []
        for column, cell in zip(self.header.columns, used, strict=True):
            value = math.nan if cell.lower() in _MISSING else self.value(column, cell, cells)
            if isinstance(value, float) and math.isfinite(value):
                row.append(value)
                continue
            begin = sum(len(x) + 1 for x in line.split(self.header.delimiter)[: column.place]) + 1
            if isinstance(value, float):
                self.missing += 1
                return self.leave(MISSING, at, cell, begin)
            refusal = Refusal(f"{column.name}: {cell[:40]!r} {value}", at + 1, begin)
            refusal.remedy = {"columns": (("time", NONE),)} if column.role == "time_s" else {}
            raise refusal
        if foot := self.left_out.get(STATISTICS):
            raise Refusal(f"numbers below the statistics in line {foot.first_line}", at + 1)
        self.line.append(at + 1)
        return row

    def value(self, column: Column, cell: str, cells: Sequence[str]) -> float | str:
        """The number in a cell, in SI where its unit is in the cells; else what is wrong."""
        if column.unit == "clock":
            return self.clock(cell)
        scale, bare = 1.0, cell
        if column.unit_place is not None:
            bare = match[0] if (match := NUMBER.match(cell)) else cell
            own = column.unit_place == column.place
            told = cell[len(bare) :].strip() if own else cells[column.unit_place]
            kind = kind_of(column.unit)
            if kind_of(symbol := unit(told) or "") != kind:
                return f"has {told[:40]!r}, no unit of a {kind}"
            scale = scale_of(symbol)
        value = number(bare, self.decimal)
        if math.isnan(value):
            other = not math.isnan(number(bare, _OTHER[self.decimal]))
            return f"where decimals have {self.decimal!r}" if other else "is not a finite number"
        return value * scale

    def clock(self, text: str) -> float | str:
        """Seconds from the first time, past midnight where no date is told; else what is wrong.

        ISO 8601 with seconds, or a date as 28.11.2026.
        """
        iso = re.sub(r"^(\d\d)\.(\d\d)\.(\d{4}) ", r"\3-\2-\1 ", text)
        iso = re.sub(r"(^| )(\d:\d\d:)", r"\g<1>0\2", iso)
        date = "" if iso[2:3] == ":" else iso[:10]
        try:
            moment = datetime.fromisoformat(iso if date else f"1970-01-01 {iso}")
        except ValueError:
            moment = None
        if moment is None or not re.search(r"\d\d:\d\d:\d\d", iso):
            return "is no time such as 10:59:58.5 or 2026-11-28 10:59:58"
        moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
        self.first = self.first or moment
        found_s = (moment - self.first).total_seconds()
        if not date:
            self.days += found_s + self.days * DAY_S < self.last_s - DAY_S / 2.0
        self.last_s = found_s + self.days * DAY_S
        return self.last_s

    def leave(self, reason: str, at: int, text: str, column: int = 1) -> list[float] | None:
        """Count a line that is no row; None."""
        found = self.left_out.setdefault(reason, LeftOut(reason, 0, at + 1, column, text[:60]))
        found.lines += 1
        return None


def _is_value(cell: str) -> bool:
    """Whether a cell is that of a row: a number, a clock's time, or a sign that one is missing."""
    return bool(NUMBER.match(cell)) or (cell != "" and cell.lower() in _MISSING)
