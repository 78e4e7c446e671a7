"""Reads a force curve from the file of another machine: strict about every cell, bounded in time
and memory, and with an account of what was read how."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stepload.contact.curve_factors import FACTORED
from stepload.errors import printable
from stepload.identification.curve_channels import signs
from stepload.record.curve_header import Header, find_header, is_comment, may_be_machine
from stepload.record.curve_mapping import ALL, CALLED, CurveMapping, Refusal
from stepload.record.curve_rows import MISSING, FloatArray, Table, decimal_mark, read_rows
from stepload.record.curve_text import (
    Lines,
    encodings,
    is_workbook,
    read_bytes,
    text_lines,
    workbook_lines,
)
from stepload.record.curve_words import LATERAL, has_word
from stepload.units import format_quantity, percent

MIN_ROWS = 3
MISSING_SHARE = 0.05
"""A larger share of rows without all numbers is refused."""
SINCE_1970_S = 1e8
"""A time that begins later is counted from its first value."""
GAP, LEAST_GAP_S = 20.0, 1.0
"""A clock jumps ahead where a step is so many times the median step, and at least so long."""
RESTART = 0.5
"""Force and travel begin again where both fall by this share of their range in one row."""
LONGEST_S = 86400.0
"""A test whose unit of time follows from the size of its numbers is shorter."""
_MARKS = {"\t": "tab", ";": "semicolon", ",": "comma", None: "spaces"}


@dataclass(frozen=True, slots=True)
class ColumnRead:
    """A column as it was read: its role, number (from 1), name and unit in the file, where the unit
    is from, and its first and last values in SI."""

    role: str
    number: int
    name: str
    unit: str
    unit_from: str
    first: float
    last: float


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Lines of one reason that are no rows: how many, the first of them and its text."""

    reason: str
    lines: int
    first_line: int
    text: str


@dataclass(frozen=True, slots=True)
class Reading:
    """How a file was read.

    Attributes:
        encoding, delimiter, decimal, sheet: of the file; `sheet` of a workbook.
        names_line, units_line: from 1; 0 where there is none.
        columns: the used ones.
        unused: names of the others.
        rows, first_line, last_line: how many rows were read, and where they are.
        left_out: what is no row.
        specimen, specimens: which of how many tests in the file.
        sign: which channel is negative when pressing, in words.
        notes: what is unusual.
    """

    encoding: str
    delimiter: str
    decimal: str
    sheet: str
    names_line: int
    units_line: int
    columns: tuple[ColumnRead, ...]
    unused: tuple[str, ...]
    rows: int
    first_line: int
    last_line: int
    left_out: tuple[LeftOut, ...]
    specimen: str
    specimens: int
    sign: str
    notes: tuple[str, ...]

    @property
    def mapping(self) -> CurveMapping:
        """What would have to be stated to read such a file in the same way."""
        own = [c for c in self.columns if c.role != LATERAL]
        plain = {c.name for c in own} if len({c.name for c in own} - {""}) == len(own) else set()
        return CurveMapping(
            columns=tuple(
                (CALLED[c.role], c.name if c.name in plain else str(c.number)) for c in own
            ),
            units=tuple((CALLED[c.role], c.unit) for c in own if c.unit != "clock"),
            sheet=self.sheet,
            decimal=self.decimal,
            encoding="" if self.encoding in ("utf-8", "xlsx") else self.encoding,
        )

    def about(self) -> Iterator[str]:
        """What a look shows below the columns, line by line."""
        units = f", units in line {self.units_line}" if self.units_line else ""
        sheet = f" sheet {self.sheet!r}" if self.sheet else ""
        yield (
            f"{self.encoding}{sheet}, {self.delimiter}, decimal mark {self.decimal}; "
            f"names in line {self.names_line}{units}"
        )
        yield from [*self.lines()][1:]
        if self.sign:
            yield self.sign
        if self.unused:
            yield f"not used: {', '.join(self.unused)[:200]}"
        yield from self.notes

    def lines(self) -> Iterator[str]:
        """One to three lines: the columns, the rows, what was left out."""
        yield "read: " + ", ".join(
            f"{CALLED[c.role]} {printable(c.name) or f'column {c.number}'!r} in {c.unit}"
            for c in self.columns
        )
        many = f", specimen {self.specimen} of {self.specimens}" if self.specimens > 1 else ""
        yield f"{self.rows} rows, lines {self.first_line} to {self.last_line}{many}"
        if self.left_out:
            yield "left out: " + ", ".join(
                f"{each.lines} {each.reason} (line {each.first_line}: {printable(each.text, 20)!r})"
                for each in self.left_out
            )


@dataclass(frozen=True, slots=True)
class Curve:
    """Columns of equal length N ≥ 3, finite, SI.

    Attributes:
        time_s: times that do not fall; None where the file has none.
        position_m, displacement_m: exactly one of the two is there: travel of the machine, or the
            payload's deformation.
        force_n: force.
        lateral_n: (C, N) components of the lateral force; None where the file has none.
        notes: what else is to be known of the data, in sentences.
        perhaps_machine: name of the column of displacement where it may hold the deflection of the
            machine as well; "" where it says that it does not.
        reading: how the file was read; None of a curve from no file.
    """

    time_s: FloatArray | None
    position_m: FloatArray | None
    displacement_m: FloatArray | None
    force_n: FloatArray
    lateral_n: FloatArray | None = None
    notes: tuple[str, ...] = ()
    perhaps_machine: str = ""
    reading: Reading | None = None


@dataclass(frozen=True, slots=True)
class _Part:
    """One test of a file: rows of one of its tables."""

    header: Header
    table: Table
    rows: slice

    @property
    def at(self) -> int:
        return self.table.line[self.rows.start]


def read_curve(path: Path, mapping: CurveMapping | None = None) -> Curve:
    """Read a table separated by comma, semicolon or tab (then also with decimal commas) or spaces,
    or a sheet of a workbook.

    Columns may be in any order among others. Every line that is no row is counted with its reason.

    Raises:
        BadInputError: with file:line:column, what is there and what is expected, or the option that
            answers what the file leaves open.
    """
    mapping = mapping or CurveMapping()
    mapping.check()
    data = read_bytes(path)
    try:
        if is_workbook(data):
            lines = workbook_lines(path, mapping)
            return _read(lines, find_header(lines.texts, mapping, "\t"), mapping)
        if mapping.sheet:
            raise Refusal("--sheet of a text", hint="sheets are in .xlsx")
        return _read(*_header_of(data, mapping), mapping)
    except Refusal as refusal:
        raise refusal.as_error(path, mapping) from None


def _header_of(data: bytes, mapping: CurveMapping) -> tuple[Lines, Header]:
    """Lines and header of a text, the same in all encodings that it may have; raises Refusal."""
    found: dict[object, tuple[Lines, Header]] = {}
    refusal: Refusal | None = None
    for encoding in encodings(data, mapping.encoding):
        lines = text_lines(data, encoding)
        try:
            header = find_header(lines.texts, mapping, lines.delimiter, lines.begin)
        except Refusal as error:
            refusal = refusal or error
            continue
        key = tuple((c.place, c.role, c.unit) for c in header.columns), header.begin
        found.setdefault(key, (lines, header))
    if len(found) > 1:
        names = [lines.encoding for lines, _ in found.values()]
        raise Refusal("the encoding decides what the columns are", encoding=names[0],
                      hint=f"or {', '.join(names[1:])}")  # fmt: skip
    if not found:
        assert refusal is not None
        raise refusal
    return next(iter(found.values()))


def _read(lines: Lines, header: Header, mapping: CurveMapping) -> Curve:
    parts = [
        part for head, table in _tables(lines, header, mapping) for part in _parts(head, table)
    ]
    long = [part for part in parts if part.rows.stop - part.rows.start >= MIN_ROWS]
    first = parts[0]
    if not long:
        count = len(first.table.values)
        at = first.table.line[-1] if count else first.header.begin
        _check_missing(first, lines.notes)
        raise Refusal(f"{count} rows, at least {MIN_ROWS} are needed", at)
    part, all_in_one = long[0], mapping.specimen == ALL
    if len(long) > 1 and first.header.beside == 1:
        if not mapping.specimen:
            starts = ", ".join(f"{n} at line {each.at}" for n, each in enumerate(long[:6], 1))
            raise Refusal(
                f"{len(long)} tests in one file: {starts}{', …' if len(long) > 6 else ''}",
                long[1].at, specimen="1", hint="or another; all: they are one test",
            )  # fmt: skip
        if all_in_one:
            if any(each.table is not part.table for each in long):
                raise Refusal("--specimen all of different tables", long[1].at, specimen="1")
            part = _Part(part.header, part.table, slice(0, len(part.table.values)))
    if mapping.specimen.isdigit() and first.header.beside == 1:
        if int(mapping.specimen) > len(long):
            raise Refusal(f"--specimen {mapping.specimen}: the file has {len(long)}", specimen="1")
        part = long[int(mapping.specimen) - 1]
    _check_missing(part, lines.notes)
    return _curve(lines, part, mapping, max(len(long), first.header.beside))


def _tables(lines: Lines, header: Header, mapping: CurveMapping) -> Iterator[tuple[Header, Table]]:
    """The tables of a file, one below the other; raises Refusal."""
    later: dict[int, Header] = {}

    def another(at: int) -> bool:
        try:
            found = find_header(lines.texts[: at + 5], mapping, header.delimiter, at)
        except Refusal:
            return False
        if found.line == at + 1 and found.names:
            later[at] = found
        return at in later

    while True:
        decimal = mapping.decimal or decimal_mark(lines.texts, header)
        table = read_rows(lines.texts, header, decimal, another)
        yield header, table
        if table.stop is None:
            return
        header = later[table.stop]


def _check_missing(part: _Part, notes: Sequence[str]) -> None:
    """Refuse a table in which too many numbers are missing."""
    table = part.table
    rows = len(table.values)
    if table.missing > MISSING_SHARE * (rows + table.missing):
        line, at, text = table.left_out.get(MISSING, [(1, 1, "")])[0]
        raise Refusal(
            f"{text[:40]!r} is not a finite number; {table.missing} of "
            f"{rows + table.missing} rows lack a number{''.join(f'; {n}' for n in notes)}",
            line, at, hint=f"at most {percent(MISSING_SHARE, 2)} may be missing",
        )  # fmt: skip


def _parts(header: Header, table: Table) -> list[_Part]:
    """The tests of a table: they end where the time goes back, or force and travel begin again, or
    the names are repeated otherwise than by a logger that has repeated them every so many rows."""
    values, count = table.values, len(table.values)
    by_role = {column.role: at for at, column in enumerate(header.columns)}
    starts: set[int] = set()
    if count > 1:
        travel = next(
            at for each, at in by_role.items() if each in ("position_m", "displacement_m")
        )
        fell = np.ones(count - 1, dtype=np.bool_)
        for at in (by_role["force_n"], travel):
            step = np.diff(values[:, at])
            typical = float(np.median(np.abs(step)))
            back = np.abs(step) > max(RESTART * float(np.ptp(values[:, at])), 20.0 * typical)
            stays = np.zeros_like(back)
            after = np.abs(values[3:, at] - values[1:-2, at]) < 0.5 * np.abs(step[:-2])
            stays[:-2] = after
            fell &= back & stays
        starts |= {int(at) + 1 for at in np.flatnonzero(fell)}
        if "time_s" in by_role:
            starts |= {
                int(at) + 1 for at in np.flatnonzero(np.diff(values[:, by_role["time_s"]]) < 0.0)
            }
        elif table.again and not _regular(table.again, count):
            starts |= {at for at in table.again if 0 < at < count}
    edges = [0, *sorted(starts), count]
    return [_Part(header, table, slice(a, b)) for a, b in zip(edges, edges[1:], strict=False)]


def _regular(again: Sequence[int], count: int) -> bool:
    """Whether names are repeated every so many rows."""
    lengths = np.diff([0, *again])
    lengths = lengths[lengths > 0]
    return bool(len(lengths) > 1 and np.ptp(lengths) == 0 and count - again[-1] <= lengths[0])


def _curve(lines: Lines, part: _Part, mapping: CurveMapping, specimens: int) -> Curve:
    header, table = part.header, part.table
    found: dict[str, list[FloatArray]] = {}
    read: list[ColumnRead] = []
    for column, values in zip(header.columns, table.values[part.rows].T, strict=True):
        scale = 1.0 if column.unit_place is not None else column.scale
        scaled = np.ascontiguousarray(values if scale == 1.0 else values * scale)
        found.setdefault(column.role, []).append(scaled)
        read.append(
            ColumnRead(
                column.role, column.place + 1, column.name[:60], column.unit,
                column.source.partition(" stated")[0], float(scaled[0]), float(scaled[-1]),
            )
        )  # fmt: skip
    notes = list(lines.notes)
    time_s = found["time_s"][0] if "time_s" in found else None
    if time_s is not None and (np.diff(time_s) < 0.0).any():
        notes.append("the time goes back: it is not used")
        time_s = None
    if time_s is not None:
        time_s, more = _checked_time(time_s, header, table, part)
        notes += more
    travel = next(found[each][0] for each in ("position_m", "displacement_m") if each in found)
    used = {column.place for column in header.columns}
    unused = tuple(name[:60] for at, name in enumerate(header.names) if at not in used and name)
    notes += [
        f"cycles are found from force and travel; the column {name!r} is not used"
        for name in unused if has_word(name, "cycle")
    ][:1]  # fmt: skip
    reading = Reading(
        encoding=lines.encoding,
        delimiter=_MARKS.get(header.delimiter, str(header.delimiter)),
        decimal=table.decimal,
        sheet=lines.sheet,
        names_line=header.line,
        units_line=header.units_line,
        columns=tuple(read),
        unused=unused,
        rows=len(travel),
        first_line=part.at,
        last_line=table.line[part.rows.stop - 1],
        left_out=tuple(
            LeftOut(reason, len(each), each[0][0], each[0][2][:60])
            for reason, each in table.left_out.items()
        ),
        specimen=mapping.specimen,
        specimens=specimens,
        sign=_sign(travel, found["force_n"][0]),
        notes=tuple(notes),
    )
    return Curve(
        time_s=time_s,
        position_m=found["position_m"][0] if "position_m" in found else None,
        displacement_m=found["displacement_m"][0] if "displacement_m" in found else None,
        force_n=found["force_n"][0],
        lateral_n=np.stack(found[LATERAL]) if LATERAL in found else None,
        notes=(*_factored(lines, header), *notes),
        perhaps_machine=next((c.name[:60] for c in header.columns if may_be_machine(c)), ""),
        reading=reading,
    )


def _checked_time(
    time_s: FloatArray, header: Header, table: Table, part: _Part
) -> tuple[FloatArray, list[str]]:
    """The time from its first value where that is a date, and notes on a clock that jumps ahead."""
    column = next(column for column in header.columns if column.role == "time_s")
    steps = np.diff(time_s)
    if column.source.startswith("size"):
        if float(np.ptp(time_s)) > LONGEST_S:
            raise Refusal(f"the column {column.name[:60]!r} has no unit that is known", header.line,
                          units=(("time", "?"),), hint="ms, s, …")  # fmt: skip
    if time_s[0] > SINCE_1970_S:
        time_s = time_s - time_s[0]
    at, median_s = int(np.argmax(steps)), float(np.median(steps))
    if steps[at] < max(GAP * median_s, LEAST_GAP_S):
        return time_s, []
    line = table.line[part.rows.start + at + 1]
    return time_s, [
        f"the clock jumps ahead by {format_quantity(float(steps[at]), 's')} at line {line}, median "
        f"step {format_quantity(median_s, 's')}: drift and creep between are not known"
    ]


def _sign(travel_m: FloatArray, force_n: FloatArray) -> str:
    """Which channels are negative when pressing, in words; "" for none."""
    turn = signs(travel_m, force_n)
    turned = [name for name, each in (("force", turn.force), ("travel", turn.travel)) if each < 0.0]
    return f"{' and '.join(turned)} fall when pressing: turned" if turned else ""


def _factored(lines: Lines, header: Header) -> Iterator[str]:
    """What the comments above a table say of factors that its curve was multiplied by."""
    for line in lines.texts[: header.begin]:
        text = line.strip()
        if text and is_comment(text) and (told := text.lstrip("# ")).startswith(FACTORED):
            yield told
