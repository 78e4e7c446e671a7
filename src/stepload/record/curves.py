"""Reads a force curve from the file of another machine: strict about every cell, bounded in time
and memory, and with an account of what was read how."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

import stepload.record.curve_header as h
import stepload.record.curve_text as t
from stepload.contact.curve_factors import FACTORED
from stepload.errors import printable
from stepload.identification.curve_channels import signs
from stepload.record.curve_mapping import ALL, CALLED, CurveMapping, Refusal
from stepload.record.curve_rows import DAY_S, MISSING, FloatArray, Table, decimal_mark
from stepload.record.curve_words import LATERAL, TRAVELS, has_word, is_specimen
from stepload.units import format_quantity, percent

MIN_ROWS = 3
MISSING_SHARE = 0.05
"""A larger share of rows without all numbers is refused."""
SINCE_1970_S = 1e8
"""A time that begins later is counted from its first value."""
GAP, LEAST_GAP_S = 20.0, 1.0
"""A clock jumps ahead where a step is so many times the median step, and at least so long."""
RESTART = 0.5
"""Force and travel begin again where both change by this share of their range in one row."""
MAX_TEXT = 10_000
HEAD = 1 << 18
"""Bytes in which the header is sought where the encoding is not certain."""
_MARKS = {"\t": "tab", ";": "semicolon", ",": "comma", None: "spaces"}


@dataclass(frozen=True, slots=True)
class ColumnRead:
    """A column as it was read: its number from 1, its lowest and highest values in SI."""

    role: str
    number: int
    name: str
    unit: str
    unit_from: str
    lowest: float
    highest: float


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Lines of one reason that are no rows: how many, the first of them and its text."""

    reason: str
    lines: int
    first_line: int
    text: str


@dataclass(frozen=True, slots=True)
class Reading:
    """How a file was read: lines count from 1, 0 is none; `unused` are names of other columns,
    `specimen` one of the `specimens` in the file, `sign` what is negative when pressing, `mapping`
    what would have to be stated to read such a file in the same way."""

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
    mapping: CurveMapping

    def about(self) -> Iterator[str]:
        """What a look shows beside the columns, line by line."""
        sheet = f" sheet {self.sheet!r}" if self.sheet else ""
        units = f", units in line {self.units_line}" if self.units_line else ""
        names = f"names in line {self.names_line}" if self.names_line else "no names"
        yield f"{self.encoding}{sheet}, {self.delimiter}, decimal mark {self.decimal}"
        yield f"{names}{units}; {[*self.lines()][1]}"
        yield from [*self.lines()][2:]
        if self.unused:
            yield f"not used: {', '.join(self.unused)[:200]}"
        if self.sign:
            yield self.sign
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

    table: Table
    rows: slice

    @property
    def line(self) -> list[int]:
        return self.table.line[self.rows]


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
    data = t.read_bytes(path)
    try:
        if t.is_workbook(data):
            lines = t.workbook_lines(path, mapping.sheet)
            return _read(lines, h.find_header(lines.texts, mapping, "\t"), mapping)
        if mapping.sheet:
            raise Refusal("--sheet of a text", hint="sheets are in .xlsx")
        return _read(*_header_of(data, mapping), mapping)
    except Refusal as refusal:
        raise refusal.as_error(path, mapping) from None


def _header_of(data: bytes, mapping: CurveMapping) -> tuple[t.Lines, h.Header]:
    """Lines and header of a text, the same in all encodings that it may have; raises Refusal."""
    found: dict[object, tuple[t.Lines, h.Header]] = {}
    refusal: Refusal | None = None
    several = t.encodings(data, mapping.encoding)
    head = data if len(several) == 1 else data[:HEAD].rpartition(b"\n")[0] or data
    for encoding in several:
        lines = t.text_lines(head, encoding)
        try:
            header = h.find_header(lines.texts, mapping, lines.delimiter, lines.begin)
        except Refusal as error:
            refusal = refusal or error
            continue
        key = tuple((c.place, c.role, c.unit) for c in header.columns), header.begin
        found.setdefault(key, (lines, header))
    if len(found) > 1:
        names = [lines.encoding for lines, _ in found.values()]
        raise Refusal("the encoding decides what the columns are", encoding=names[0],
                      hint=f"or {', '.join(names[1:])}")  # fmt: skip
    if refusal is not None and not found:
        raise refusal
    lines, header = next(iter(found.values()))
    return (lines if head is data else t.text_lines(data, lines.encoding)), header


def _tables(lines: t.Lines, header: h.Header, mapping: CurveMapping) -> Iterator[Table]:
    """The tables of a file, one below the other; raises Refusal."""
    later: dict[int, h.Header] = {}
    tried = 0

    def another(at: int) -> bool:
        nonlocal tried
        tried += 1
        if tried > MAX_TEXT:
            raise Refusal(f"more than {MAX_TEXT} lines of text among the rows", at + 1)
        try:
            later[at] = h.header_at(lines.texts, at, mapping, header.delimiter)
        except Refusal:
            return False
        return True

    while True:
        decimal = mapping.decimal or decimal_mark(lines.texts, header)
        table = Table(lines.texts, header, decimal, another)
        yield table
        if table.stop is None:
            return
        header = later[table.stop]


def _read(lines: t.Lines, header: h.Header, mapping: CurveMapping) -> Curve:
    tables = [*_tables(lines, header, mapping)]
    long = [each for each in tables if len(each.values) >= MIN_ROWS] or tables[:1]
    parts = [part for table in long for part in _parts(table, _changes(lines, table))]
    part, wanted = parts[0], mapping.specimen
    if header.beside == 1 and wanted.isdigit():
        if int(wanted) > len(parts):
            raise Refusal(f"--specimen {wanted}: the file has {len(parts)}", specimen="1")
        part = parts[int(wanted) - 1]
    elif len(parts) > 1 and wanted == ALL and len(long) == 1:
        part = _Part(part.table, slice(0, len(part.table.values)))
    elif len(parts) > 1:
        starts = ", ".join(f"{n} at line {p.line[0]}" for n, p in enumerate(parts[:6], 1))
        raise Refusal(
            f"{len(parts)} tests in one file: {starts}{', …' * (len(parts) > 6)}", parts[1].line[0],
            specimen="1", hint="or another; all: they are one test",
        )  # fmt: skip
    table, rows = part.table, len(part.line)
    if table.missing > MISSING_SHARE * (len(table.values) + table.missing):
        reason = next(each for each in table.left_out if each in (MISSING, "text"))
        line, at, text = table.left_out[reason][0]
        raise Refusal(
            f"{text[:40]!r} is not a finite number; {table.missing} of "
            f"{len(table.values) + table.missing} rows lack a number"
            + "".join(f"; {note}" for note in lines.notes),
            line, at, hint=f"at most {percent(MISSING_SHARE, 2)} may be missing",
        )  # fmt: skip
    if rows < MIN_ROWS:
        line = part.line[-1] if rows else table.header.begin
        raise Refusal(f"{rows} rows, at least {MIN_ROWS} are needed", line)
    short = {each.line[0]: each for each in tables if each not in long and each.line}
    for line, each in short.items():
        table.left_out["of another table"] = [(line, 1, "")] * len(each.line)
    return _curve(lines, part, mapping, max(len(parts), header.beside))


def _changes(lines: t.Lines, table: Table) -> set[int]:
    """Rows with which another specimen begins, by a column that names it; raises Refusal."""
    header, starts = table.header, set[int]()
    used = {column.place for column in header.columns}
    for place, name in enumerate(header.names):
        if place in used or not is_specimen(name):
            continue
        told, last = list[str](), ""
        for line in table.line:
            cells = h.split(lines.texts[line - 1], header.delimiter)
            last = (cells[place] if place < len(cells) else "") or last
            told.append(last)
        changes = [at for at in range(1, len(told)) if told[at] != told[at - 1]]
        if len({*told}) * MIN_ROWS > len(told):
            continue  # it counts the rows
        if len(changes) >= len({*told}):
            raise Refusal(f"rows of several specimens ({name[:40]!r}) are mixed",
                          table.line[changes[0]], hint="sort them, or a file for each")  # fmt: skip
        starts |= {*changes}
    return starts


def _parts(table: Table, starts: set[int]) -> list[_Part]:
    """The tests of a table: they end where the time goes back, or force and travel begin again, or
    the names are repeated otherwise than by a logger, every so many rows, or at `starts`."""
    values, count = table.values, len(table.values)
    place = {column.role: at for at, column in enumerate(table.header.columns)}
    if count > MIN_ROWS:
        begins = np.ones(count - 3, dtype=np.bool_)
        for each in {"force_n", *TRAVELS} & place.keys():
            x = values[:, place[each]]
            step = np.abs(np.diff(x))
            most = max(RESTART * float(np.ptp(x)), GAP * float(np.median(step)))
            stays = np.abs(x[3:] - x[1:-2]) < RESTART * step[:-2]
            begins &= (step[:-2] > most) & stays & (np.abs(x - x[0])[1:-2] < np.abs(x - x[0])[:-3])
        force = values[:, place["force_n"]]
        ends = [int(at) + 1 for at in np.flatnonzero(begins)]  # not that of a fast retract
        starts |= {at for at in ends if np.ptp(force[at:]) > RESTART * np.ptp(force)}
    if "time_s" in place:
        back = np.flatnonzero(np.diff(values[:, place["time_s"]]) < 0.0)
        starts |= {int(at) + 1 for at in back}
    elif table.again:
        lengths = np.diff([0, *(at for at in table.again if at), count])
        if len(lengths) < 3 or np.ptp(lengths[:-1]) > 0 or lengths[-1] > lengths[0]:
            starts |= {at for at in table.again if 0 < at < count}
    return [_Part(table, slice(*ends)) for ends in pairwise([0, *sorted(starts), count])]


def _curve(lines: t.Lines, part: _Part, mapping: CurveMapping, specimens: int) -> Curve:
    table, header = part.table, part.table.header
    found: dict[str, list[FloatArray]] = {}
    read: list[ColumnRead] = []
    for column, values in zip(header.columns, table.values[part.rows].T, strict=True):
        scale = 1.0 if column.unit_place is not None else column.scale
        scaled = np.ascontiguousarray(values if scale == 1.0 else values * scale)
        found.setdefault(column.role, []).append(scaled)
        ends = float(scaled.min()), float(scaled.max())
        read.append(ColumnRead(column.role, column.place + 1, column.name[:60], column.unit,
                               column.unit_from, *ends))  # fmt: skip
    time_s, notes = _checked_time(found.get("time_s", [None])[0], part)
    used = {column.place for column in header.columns}
    unused = tuple(name[:60] for at, name in enumerate(header.names) if at not in used and name)
    notes = [*lines.notes, *notes, *(
        f"the column {name!r} is not used: cycles are found from force and travel"
        for name in unused if has_word(name, "cycle")
    )]  # fmt: skip
    travel_m, force_n = next(found[each][0] for each in TRAVELS & found.keys()), found["force_n"][0]
    turn = signs(travel_m, force_n)
    falls = [name for name, sign in (("force", turn.force), ("travel", turn.travel)) if sign < 0.0]
    reading = Reading(
        encoding=lines.encoding,
        delimiter=_MARKS.get(header.delimiter, str(header.delimiter)),
        decimal=table.decimal,
        sheet=lines.sheet,
        names_line=header.line,
        units_line=header.units_line,
        columns=tuple(read),
        unused=unused,
        rows=len(force_n),
        first_line=part.line[0],
        last_line=part.line[-1],
        left_out=tuple(
            LeftOut(reason, len(each), each[0][0], each[0][2][:60])
            for reason, each in table.left_out.items()
        ),
        specimen=mapping.specimen,
        specimens=specimens,
        sign=f"sign: {' and '.join(falls)} negative when pressing, turned" if falls else "",
        notes=tuple(notes),
        mapping=_mapping(lines, table, specimens),
    )
    comments = (text for line in lines.texts[: header.begin] if (text := line.strip()))
    told = (text.lstrip("# ") for text in comments if h.is_comment(text))
    return Curve(
        time_s=time_s,
        position_m=found.get("position_m", [None])[0],
        displacement_m=found.get("displacement_m", [None])[0],
        force_n=force_n,
        lateral_n=np.stack(found[LATERAL]) if LATERAL in found else None,
        notes=(*(text for text in told if text.startswith(FACTORED)), *notes),
        perhaps_machine=next((c.name[:60] for c in header.columns if h.may_be_machine(c)), ""),
        reading=reading,
    )


def _mapping(lines: t.Lines, table: Table, specimens: int) -> CurveMapping:
    """What says how a file was read; not that a doubtful displacement is the payload's."""
    columns = [column for column in table.header.columns if column.role != LATERAL]
    sure = [column for column in columns if not h.may_be_machine(column)]
    unique = all(table.header.names.count(column.name) == 1 for column in columns)
    by_name = unique and specimens == 1
    return CurveMapping(
        columns=tuple((CALLED[c.role], c.name if by_name else str(c.place + 1)) for c in sure),
        units=tuple((CALLED[c.role], c.unit) for c in columns if c.unit != "clock"),
        sheet=lines.sheet,
        decimal=table.decimal,
        encoding="" if lines.encoding in ("utf-8", "xlsx") else lines.encoding,
    )


def _checked_time(time_s: FloatArray | None, part: _Part) -> tuple[FloatArray | None, list[str]]:
    """The time from its first value where that is a date, and notes on a clock that jumps."""
    if time_s is None:
        return None, []
    header = part.table.header
    column = next(column for column in header.columns if column.role == "time_s")
    steps = np.diff(time_s)
    if column.unit_from == "size" and float(np.ptp(time_s)) > DAY_S:
        raise Refusal(f"the column {column.name[:60]!r} has no unit that is known", header.line,
                      units=(("time", "?"),), hint="ms, s, …")  # fmt: skip
    if (steps < 0.0).any():
        return None, ["the time goes back: it is not used"]
    if time_s[0] > SINCE_1970_S:
        time_s = time_s - time_s[0]
    at, median_s = int(np.argmax(steps)), float(np.median(steps))
    if steps[at] < max(GAP * median_s, LEAST_GAP_S):
        return time_s, []
    return time_s, [
        f"the clock jumps ahead by {format_quantity(float(steps[at]), 's')} at line "
        f"{part.line[at + 1]}, median step {format_quantity(median_s, 's')}: drift and creep "
        "between are not known"
    ]
