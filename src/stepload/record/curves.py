"""Reads a force curve from the file of another machine: strict about every cell, bounded in time
and memory, and with an account of what was read how."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

import stepload.record.curve_header as h
import stepload.record.curve_text as t
from stepload.contact.curve_factors import FACTORED
from stepload.errors import printable
from stepload.identification.curve_channels import signs
from stepload.record.curve_mapping import ALL, CALLED, NONE, CurveMapping, Refusal
from stepload.record.curve_rows import MISSING, TEXT, FloatArray, LeftOut, Table
from stepload.record.curve_words import LATERAL, TRAVELS, is_specimen, scale_of
from stepload.units import format_quantity, percent

MIN_ROWS = 3
MIN_CHANGES = 20
"""So many changes, all a multiple of some rows apart, are those of a slower channel."""
MISSING_SHARE = 0.05
"""A larger share of rows without all numbers is refused."""
SINCE_1970_S = 1e8
"""A time that begins later is counted from its first value."""
GAP, LEAST_GAP_S = 20.0, 1.0
"""A clock jumps ahead where a step is so many times the median step, and at least so long."""
RESTART = 0.5
"""Force and travel begin again where both change by this share of their range in one row."""


@dataclass(frozen=True, slots=True)
class Reading:
    """How a file was read: lines count from 1, 0 is none; `unused` are names of other columns,
    `specimen` one of the `specimens` in the file, `mapping` what would have to be stated to read
    such a file in the same way."""

    encoding: str
    delimiter: str
    decimal: str
    sheet: str
    names_line: int
    columns: tuple[h.Column, ...]
    unused: tuple[str, ...]
    rows: int
    first_line: int
    last_line: int
    left_out: tuple[LeftOut, ...]
    specimen: str
    specimens: int
    notes: tuple[str, ...]
    mapping: CurveMapping

    def lines(self) -> Iterator[str]:
        """Two or three lines: the columns, the rows, what was left out."""
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


def read_curve(path: Path, mapping: CurveMapping | None = None) -> Curve:
    """Read a table separated by comma, semicolon or tab (then also with decimal commas) or spaces,
    or a sheet of a workbook.

    Columns may be in any order among others. Every line that is no row is counted with its reason.

    Raises:
        BadInputError: with file:line:column, what is there and what is expected, or the option that
            answers what the file leaves open.
    """
    mapping = mapping or CurveMapping()
    data = t.read_bytes(path)
    try:
        if t.is_workbook(data):
            lines = t.workbook_lines(path, mapping.sheet)
            return _read(lines, h.find_header(lines.texts, mapping, "\t"), mapping)
        return _read(*_header_of(data, mapping), mapping)
    except Refusal as refusal:
        raise refusal.as_error(path, mapping) from None


def _header_of(data: bytes, mapping: CurveMapping) -> tuple[t.Lines, h.Header]:
    """Lines and header of a text in the first encoding in which it has a header; raises Refusal.

    Another encoding changes letters, no digit: only in the right one are the words names and units.
    """
    if mapping.sheet:
        raise Refusal("--sheet of a text", hint="sheets are in .xlsx")
    refusals: list[Refusal] = []
    for lines in t.texts(data, mapping.encoding):
        try:
            return lines, h.find_header(lines.texts, mapping, lines.delimiter)
        except Refusal as error:
            refusals.append(error)
    raise refusals[0]


def _read(lines: t.Lines, header: h.Header, mapping: CurveMapping) -> Curve:
    tables = [Table(lines.texts, header, mapping.decimal)]
    while (stop := tables[-1].stop) is not None:
        below = h.header_at(lines.texts, stop, mapping, header.delimiter)
        tables.append(Table(lines.texts, below, mapping.decimal))
    long = [each for each in tables if len(each.values) >= MIN_ROWS] or tables[:1]
    parts = [(table, rows) for table in long for rows in _parts(table, _changes(lines, table))]
    number = int(mapping.specimen) if mapping.specimen.isdigit() else 0
    table, rows = parts[number - 1 if 0 < number <= len(parts) else 0]
    if mapping.specimen == ALL and len(long) == 1:
        rows = slice(None)
    elif number > len(parts) or (len(parts) > 1 and not number):
        begin = [each.line[of][0] for each, of in parts if each.line]
        starts = ", ".join(f"{n} at line {at}" for n, at in enumerate(begin[:6], 1))
        raise Refusal(
            f"{len(parts)} tests in one file: {starts}{', …' * (len(parts) > 6)}",
            begin[1] if len(begin) > 1 else 1, specimen="1",
            hint="or another; all: they are one test",
        )  # fmt: skip
    of_rows = len(table.values) + table.missing
    if table.missing > MISSING_SHARE * of_rows:
        one = next(each for each in table.left_out.values() if each.reason in (MISSING, TEXT))
        raise Refusal(
            f"{one.text[:40]!r} is not a finite number; {table.missing} of {of_rows} rows lack a "
            "number", one.first_line, one.column,
            hint=f"at most {percent(MISSING_SHARE, 2)} may be missing; formulas: save in Excel",
        )  # fmt: skip
    if len(place := table.line[rows]) < MIN_ROWS:
        line = place[-1] if place else table.header.begin
        raise Refusal(f"{len(place)} rows, at least {MIN_ROWS} are needed", line)
    for each in tables:
        if each not in long and each.line:
            told = LeftOut("of another table", len(each.line), each.line[0], 1, "")
            table.left_out[f"table {each.line[0]}"] = told
    return _curve(lines, table, rows, mapping, len(parts))


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


def _parts(table: Table, starts: set[int]) -> list[slice]:
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
    return [slice(*ends) for ends in pairwise([0, *sorted(starts), count])]


def _measured(values: FloatArray, roles: list[str]) -> tuple[slice, tuple[str, ...]]:
    """The rows with a value of their own where a logger repeats one channel while the other moves.

    Between them the repeated one is old, by half their distance in the mean.
    """
    every = {}
    for each in {"force_n", *TRAVELS} & set(roles):
        changes = np.flatnonzero(np.diff(values[:, roles.index(each)])) + 1
        if len(changes) >= MIN_CHANGES:
            every[each] = int(np.gcd.reduce(np.diff(changes))), int(changes[0])
    name, (rows, first) = max(every.items(), key=lambda each: each[1][0], default=("", (1, 0)))
    if len(every) < 2 or all(other % rows == 0 for other, _ in every.values()):
        return slice(None), ()
    told = f"the {CALLED[name]} changes every {rows} rows only: the rows between are not used"
    return slice(first % rows, None, rows), (told,)


def _curve(
    lines: t.Lines, table: Table, rows: slice, mapping: CurveMapping, specimens: int
) -> Curve:
    header, columns = table.header, table.header.columns
    measured, stands = _measured(table.values[rows], [column.role for column in columns])
    place = table.line[rows][measured]
    found: dict[str, list[FloatArray]] = {}
    read: list[h.Column] = []
    for column, values in zip(columns, table.values[rows][measured].T, strict=True):
        in_si = column.unit_place is not None or column.unit == "clock"
        scale = 1.0 if in_si else scale_of(column.unit)
        scaled = np.ascontiguousarray(values if scale == 1.0 else values * scale)
        found.setdefault(column.role, []).append(scaled)
        read.append(replace(column, name=column.name[:60], lowest=float(scaled.min()) + 0.0,
                            highest=float(scaled.max()) + 0.0))  # fmt: skip
    one = {each: arrays[0] for each, arrays in found.items()}
    time_s, notes = _checked_time(one.get("time_s"), place)
    turn = signs(next(one[each] for each in TRAVELS & one.keys()), one["force_n"])
    falls = [name for name, sign in (("force", turn.force), ("travel", turn.travel)) if sign < 0.0]
    turned = (f"sign: {' and '.join(falls)} negative when pressing, turned",) if falls else ()
    named = [column for column in columns if column.role != LATERAL]
    names, used = header.names, {column.place for column in columns}
    stated = dict(mapping.units)
    by_name = all(c.name and names.count(c.name) == 1 for c in named)
    same = CurveMapping(
        columns=(  # not that a doubtful displacement is the payload's
            *((CALLED[c.role], c.name if by_name else str(c.number))
              for c in named if not c.may_be_machine),
            *(pair for pair in mapping.columns if pair[1] == NONE),
        ),
        units=tuple((CALLED[c.role], stated.get(CALLED[c.role], c.unit))
                    for c in named if c.unit != "clock"),
        sheet=lines.sheet,
        decimal=table.decimal,
        encoding="" if lines.encoding in ("utf-8", "xlsx") else lines.encoding,
    )  # fmt: skip
    reading = Reading(
        lines.encoding, header.delimiter or "spaces", table.decimal,
        lines.sheet, header.line, tuple(read),
        unused=tuple(x[:60] for at, x in enumerate(names) if at not in used and x),
        rows=len(place), first_line=place[0], last_line=place[-1],
        left_out=tuple(table.left_out.values()),
        specimen=mapping.specimen, specimens=specimens,
        notes=(*turned, *stands, *notes), mapping=same,
    )  # fmt: skip
    comments = (line.strip().lstrip("# ") for line in lines.texts[: header.begin] if "#" in line)
    return Curve(
        time_s, one.get("position_m"), one.get("displacement_m"), one["force_n"],
        np.stack(found[LATERAL]) if LATERAL in found else None,
        (*(text for text in comments if text.startswith(FACTORED)), *stands, *notes),
        next((c.name[:60] for c in columns if c.may_be_machine), ""), reading,
    )  # fmt: skip


def _checked_time(
    time_s: FloatArray | None, lines: list[int]
) -> tuple[FloatArray | None, tuple[str, ...]]:
    """The time from its first value where that is a date, and a note on a clock that jumps."""
    if time_s is None:
        return None, ()
    steps = np.diff(time_s)
    if (steps < 0.0).any():
        return None, ("the time goes back: it is not used",)
    if time_s[0] > SINCE_1970_S:
        time_s = time_s - time_s[0]
    at, median_s = int(np.argmax(steps)), float(np.median(steps))
    if steps[at] < max(GAP * median_s, LEAST_GAP_S):
        return time_s, ()
    jump, usual = format_quantity(float(steps[at]), "s"), format_quantity(median_s, "s")
    what = f"the clock jumps ahead by {jump} at line {lines[at + 1]}, median step {usual}"
    return time_s, (f"{what}: drift and creep between are not known",)
