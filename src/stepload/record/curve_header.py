"""Finds the names of a table's columns, and determines the role and unit of each, or refuses it."""

from __future__ import annotations

import csv
import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass

import stepload.record.curve_words as w
from stepload.record.curve_mapping import CALLED, NONE, ROLES, CurveMapping, Refusal

MAX_PREAMBLE = 400
"""Lines that an instrument may write before the names of the columns."""
NUMBER = re.compile(
    r"[+\-−]?(?:\d+(?:[,.'’ \u00a0\u2009\u202f]\d{3}(?!\d))*(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?",
    re.ASCII,
)
CLOCK = re.compile(
    r"(?P<date>\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[T ]\s*)?(?P<h>\d{1,2}):(?P<m>[0-5]\d):"
    r"(?P<s>[0-5]?\d(?:[.,]\d+)?)\s*(?P<half>[AaPp][Mm])?(?:Z|[+-]\d\d:?\d\d)?",
    re.ASCII,
)
ERRORS = frozenset({"#n/a", "#ref!", "#div/0!", "#value!", "#name?", "#num!", "#null!"})
"""What a spreadsheet writes in place of a number."""
_EPOCH = {"s": 1e9, "ms": 1e12, "µs": 1e15, "ns": 1e18}
"""Unit of a time since 1970 by the size of its first value, of the years 2001 to 2099."""
_FIRST_ROWS = 3


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its place, its name in the file, what it is, and its unit in SI.

    `unit_place`: the column of its units, or its own where a unit is behind each number.
    `unit_from`: what says the unit; `stated`: whether the user says which column it is.
    """

    place: int
    name: str
    role: str
    unit: str
    scale: float
    unit_place: int | None
    unit_from: str
    stated: bool


@dataclass(frozen=True, slots=True)
class Header:
    """The columns that are used, and the rows below.

    `delimiter` None: spaces. `line`, `units_line`: of names and units, from 1; 0 where there are
    none. `begin`: index of the first line below. `beside`: specimens beside each other.
    """

    delimiter: str | None
    columns: tuple[Column, ...]
    names: tuple[str, ...]
    line: int
    units_line: int
    begin: int
    width: int
    beside: int


def may_be_machine(column: Column) -> bool:
    """Whether a column of displacement may hold the machine's own deflection as well.

    Testing machines use such names for their crosshead's travel; depth, indentation and deformation
    are the payload's, and so is what is stated, and stepload's own name with any unit.
    """
    own = column.stated or re.fullmatch(r"displacement_\w+", column.name)
    return (
        column.role == "displacement_m" and not own and w.has_word(column.name, "perhaps_machine")
    )


def split(line: str, delimiter: str | None) -> list[str]:
    """The cells of a line, without quotes and spaces around them."""
    if delimiter is not None and '"' in line:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    return [cell.strip() for cell in line.split(delimiter)]


def is_comment(text: str) -> bool:
    """Whether a line, not empty, is a comment: a # in it may be the error of a spreadsheet."""
    return text[0] == "#" and re.split(r"[,;\t]", text, maxsplit=1)[0].lower() not in ERRORS


def find_header(
    lines: Sequence[str], mapping: CurveMapping, delimiter: str | None = None, start: int = 0
) -> Header:
    """The first line that names force and travel, among those that an instrument writes above.

    The line below it may hold the units. Where no line names them, the comment above the numbers,
    cells with units, or the stated numbers of columns do.

    Raises:
        Refusal: what looks most like a header, and what it lacks.
    """
    stated = [_bare(text) for _, text in mapping.columns if text != NONE]
    by_number = bool(stated) and all(text.isdigit() for text in stated)
    end = min(len(lines), start + MAX_PREAMBLE)
    names, comments, numbers, first = list[int](), list[int](), 0, 0
    for at in range(start, end):
        if not (text := lines[at].strip()):
            continue
        if is_comment(text):
            comments.append(at)
        elif not _all_numbers(lines[at], delimiter):
            names.append(at)
        else:
            numbers, first = numbers + 1, first or at + 1
            if numbers >= _FIRST_ROWS:
                end = at
                break
    best = Refusal("the file is empty", max(len(lines), 1), known=-1)
    for at in [] if by_number else [*names, *reversed(comments)]:
        try:
            return header_at(lines, at, mapping, delimiter)
        except Refusal as error:
            best = error if error.known > best.known else best
    for at in range(start, min(len(lines), end + 1)):
        try:
            if found := _without_names(lines, at, mapping, delimiter, by_number):
                return found
        except Refusal as error:
            error.line = at + 1
            best = error if error.known > best.known or by_number else best
            if by_number:
                break
    if first and best.known <= 0 and _all_numbers(lines[first - 1], delimiter) > 1:
        both = ("force", "?"), ("position", "?")
        rows = (split(lines[first - 1], mark) for mark in _delimiters(lines[first - 1], delimiter))
        row = next(row for row in rows if all(NUMBER.fullmatch(cell) for cell in row if cell))
        told = ", ".join(f"{n}: {x}" for n, x in enumerate(row, 1))[:200]
        raise Refusal(f"the columns have no names; first row {told}", first, columns=both,
                      units=both, hint="numbers from 1, units such as N, mm, s")  # fmt: skip
    raise best


def _bare(text: str) -> str:
    """A text without the unit in brackets at its end."""
    return re.sub(r"\s*[\[(][^\[\]()]*[\])]$", "", text.strip())


def _delimiters(line: str, given: str | None) -> list[str | None]:
    return [given] if given else [*(mark for mark in "\t;," if mark in line), None]


def _all_numbers(line: str, given: str | None) -> int:
    """How many cells a line of numbers has; 0 where it holds anything else."""
    for delimiter in _delimiters(line, given):
        cells = [cell for cell in split(line, delimiter) if cell]
        if cells and all(map(NUMBER.fullmatch, cells)):
            return len(cells)
    return 0


def _next(lines: Sequence[str], at: int, step: int = 1) -> int:
    """The next line that is neither empty nor a comment; beyond all where there is none."""
    at += step
    while 0 <= at < len(lines) and (not (text := lines[at].strip()) or is_comment(text)):
        at += step
    return at if at >= 0 else len(lines)


def header_at(lines: Sequence[str], at: int, mapping: CurveMapping, given: str | None) -> Header:
    """The header whose names are in this line; raises Refusal."""
    text = lines[at].strip()
    text = text.lstrip("# ") if is_comment(text) else text
    refusal: Refusal | None = None
    found: Header | None = None
    for delimiter in _delimiters(text, given):
        names, below = split(text, delimiter), _next(lines, at)
        first, begin = below, at + 1
        units_at = below
        if units := _row_of_units(lines, below, delimiter, len(names)):
            first, begin = _next(lines, below), below + 1
        else:
            units_at = _next(lines, at, -1)
            units = _row_of_units(lines, units_at, delimiter, len(names))
        cells = split(lines[first], delimiter) if first < len(lines) else []
        fits = len(cells) == len(names) or (len(cells) == len(names) + 1 and not cells[-1])
        if delimiter is None and not (fits or all(w.unit_of(name) for name in names)):
            names = [text]  # several words and no delimiter: one column, or prose
        try:
            columns, beside = _Names(names, units, cells, mapping).columns()
        except Refusal as error:
            error.line, error.known = at + 1, error.known if len(names) > 1 else 0
            refusal = error if refusal is None or error.known > refusal.known else refusal
            continue
        header = Header(
            delimiter, columns, tuple(names), at + 1, units_at + 1 if units else 0, begin,
            len(cells) if fits else len(names), beside,
        )  # fmt: skip
        if fits:
            return header
        found = found or header
    if found is None and refusal is not None:
        raise refusal
    assert found is not None
    return found


def _row_of_units(lines: Sequence[str], at: int, delimiter: str | None, width: int) -> list[str]:
    """The units in a line; none where it holds anything else."""
    cells = split(lines[at], delimiter) if at < len(lines) else []
    found = [w.unit(cell) or cell.strip("[]() ") for cell in cells]
    short = all(len(each) <= 5 and not NUMBER.match(each) for each in found)
    return found if len(cells) == width and short and any(map(w.kind_of, found)) else []


def _without_names(
    lines: Sequence[str], at: int, mapping: CurveMapping, given: str | None, by_number: bool
) -> Header | None:
    """A table whose first row is this line: stated numbers of columns, or units in the cells."""
    places = [int(_bare(t)) - 1 for _, t in mapping.columns if t != NONE] if by_number else [0]
    for delimiter in _delimiters(lines[at], given):
        cells = split(lines[at], delimiter)
        used = [cells[place] if 0 <= place < len(cells) else "" for place in places]
        if len(cells) < 2 or not all(NUMBER.match(x) or CLOCK.fullmatch(x) for x in used):
            continue
        width, names_at = len(cells), _next(lines, at, -1)
        if not by_number and not any(_unit_in(cells, x, [""] * width)[1] for x in range(width)):
            continue
        units = _row_of_units(lines, names_at, delimiter, width)
        names_at = _next(lines, names_at, -1) if units else names_at
        names = split(lines[names_at], delimiter) if names_at < at else []
        if len(names) != width or _all_numbers(lines[names_at], given):
            names, names_at = [""] * width, -1
        columns, beside = _Names(names, units, cells, mapping).columns()
        return Header(delimiter, columns, tuple(names), names_at + 1, 0, at, width, beside)
    return None


def _unit_in(cells: Sequence[str], place: int, names: Sequence[str]) -> tuple[int, str]:
    """The column of the units of a column, and the first of them; "" where there is none.

    The next column holds them where it has no name, or is called so.
    """
    cell = cells[place] if place < len(cells) else ""
    if match := NUMBER.match(cell):
        if rest := cell[match.end() :].strip():
            return place, w.unit(rest) or ""
        beside = names[place + 1] if place + 1 < min(len(cells), len(names)) else "none"
        if not beside or w.has_word(beside, "unit"):
            return place + 1, w.unit(cells[place + 1]) or ""
    return place, ""


class _Names:
    """The columns of a table by names, row of units and cells of the first row (empty: none)."""

    def __init__(
        self, names: Sequence[str], units: Sequence[str], cells: Sequence[str],
        mapping: CurveMapping,
    ) -> None:  # fmt: skip
        self.names, self.cells, self.mapping = names, cells, mapping
        self.units = units or [""] * len(names)
        self.told: dict[int, str] = {}
        """Units in brackets behind the columns that are stated."""

    def columns(self) -> tuple[tuple[Column, ...], int]:
        """The columns that are used, and how many specimens are beside each other.

        Raises:
            Refusal: a column that is needed is missing, there twice, or without a known unit.
        """
        places = self.places()
        chosen: dict[str, list[Column]] = {}
        refusal: Refusal | None = None
        beside = 1
        for each, candidates in places.items():
            try:
                found = [c for place in candidates if (c := self.column(place, each))]
                if not found and each != w.LATERAL:
                    raise self.no_unit(candidates[0], each)
                if len(found) > 1 and each != w.LATERAL:
                    same = len({column.name for column in found}) == 1
                    beside = max(beside, len(found)) if same else beside
                    found = [self.one_of(found, each)]
            except Refusal as error:
                refusal = error if refusal is None or each == "force_n" else refusal
            else:
                if found:
                    chosen[each] = found
        if refusal is None:
            refusal = self.incomplete(chosen) or (self.mixed(chosen) if beside > 1 else None)
        if refusal is not None:
            refusal.known += len(places)
            raise refusal
        return tuple(column for found in chosen.values() for column in found), beside

    def places(self) -> dict[str, list[int]]:
        """The columns that could have each role."""
        places: dict[str, list[int]] = {}
        stated = {ROLES[name] for name, _ in self.mapping.columns}
        for name, text in self.mapping.columns:
            if text != NONE:
                place, self.told[place] = self.place(text, name)
                places.setdefault(ROLES[name], []).append(place)
        exact = {each for each in w.KIND_OF_ROLE if each in self.names} - stated
        travels = stated & w.TRAVELS or exact & w.TRAVELS or w.TRAVELS
        for place, name in enumerate(self.names):
            kind = w.kind_of(_unit_in(self.cells, place, self.names)[1])
            of_cell = {"force": "force_n", "length": "position_m", "time": "time_s"}.get(kind)
            each = w.role(name) if name else of_cell
            if each is None or each in stated or place in self.told:
                continue
            if each in w.TRAVELS - travels or (each in exact and name != each):
                continue
            places.setdefault(each, []).append(place)
        return places

    def place(self, text: str, name: str) -> tuple[int, str]:
        """The column that a text states, and the unit in its brackets; raises Refusal."""
        lower = [each.lower() for each in self.names]
        for sought, told in ((text, ""), (_bare(text), w.unit(w.bracketed(text)) or "")):
            same = [at for at, each in enumerate(self.names) if each == sought]
            same = same or [at for at, each in enumerate(lower) if each == sought.lower()]
            if len(same) > 1:
                break
            if same:
                return same[0], told
            if sought.isdigit() and 1 <= int(sought) <= len(self.names):
                return int(sought) - 1, told
        many = len(same) or "no"
        raise Refusal(f"{many} columns are called {text!r}; {self.all()}", hint="its number",
                      columns=((name, "?"),), known=len(same) or len(self.names) > 1)  # fmt: skip

    def all(self) -> str:
        return "columns: " + ", ".join(f"{at} {x!r}" for at, x in enumerate(self.names, 1))[:300]

    def column(self, place: int, each: str) -> Column | None:
        """The column at a place in a role; None where no unit of its kind is known."""
        name, kind, stated = self.names[place], w.KIND_OF_ROLE[each], place in self.told
        first = self.cells[place] if place < len(self.cells) else ""
        if kind == "time" and CLOCK.fullmatch(first):
            return Column(place, name, each, "clock", 1.0, None, "cells", stated)
        unit_place, in_cells = _unit_in(self.cells, place, self.names)
        wanted = dict(self.mapping.units).get(CALLED[each], "") or self.told.get(place, "")
        in_name, in_row = w.unit_of(name) or "", self.units[place]
        factor = w.has_factor(name)
        if factor and not wanted:
            return None
        own = {x for x in (in_name, in_row) if w.kind_of(x) == kind and not factor}
        told = w.unit(wanted) or ""
        if own and told and told not in own and not self.told.get(place):
            raise Refusal(f"the column {name[:60]!r} is in {own.pop()}, not in {told}", known=4,
                          columns=((CALLED[each], f"{place + 1} ({told})"),),
                          hint="where the file is wrong")  # fmt: skip
        others = {each for each in (in_name, in_row, in_cells) if w.kind_of(each)}
        if len(others) > 1 and not wanted and not (in_cells and w.kind_of(in_cells) != kind):
            told = " and ".join(sorted(others))
            raise Refusal(f"the column {name[:60]!r} is in {told}", known=4,
                          units=((CALLED[each], in_cells or in_row),))  # fmt: skip
        sources = {
            "cells": in_cells, "stated": w.unit(wanted) or "", "name": in_name,
            "row of units": in_row, "size": _epoch(first) if kind == "time" else "",
        }  # fmt: skip
        for source, symbol in sources.items():
            if w.kind_of(symbol) == kind:
                at = unit_place if source == "cells" else None
                return Column(place, name, each, symbol, w.scale_of(symbol), at, source, stated)
            if symbol and source == "name":
                return None
        return None

    def one_of(self, found: Sequence[Column], each: str) -> Column:
        """The one column of several in a role that is meant; raises Refusal."""
        many, specimen, column = len(found), self.mapping.specimen, found[0]
        if len({column.name for column in found}) == 1 and column.name:
            if specimen.isdigit() and int(specimen) <= many:
                return found[int(specimen) - 1]
            raise Refusal(f"{many} specimens beside each other, with {column.name!r} each",
                          hint=f"1 to {many}", specimen="1")  # fmt: skip
        if each == "time_s" and (stamp := [c for c in found if c.name.endswith("header.stamp")]):
            return stamp[0]
        along = [column for column in found if not {"x", "y"} & set(w.words(column.name))]
        if each == "position_m" and len(along) == 1 and "z" in w.words(along[0].name):
            return along[0]
        told = ", ".join(f"{column.place + 1} {column.name!r}" for column in found)
        text = column.name
        if self.names.count(text) > 1 or not text:
            text = f"{column.place + 1} ({column.unit})"
        raise Refusal(f"{many} columns could be the {_called(each)}: {told[:200]}",
                      hint="or another of them", columns=((CALLED[each], text),))  # fmt: skip

    def no_unit(self, place: int, each: str) -> Refusal:
        """The refusal of a column whose unit is not known."""
        name, kind = self.names[place], w.KIND_OF_ROLE[each]
        written = w.unit_of(name) or self.units[place] or w.bracketed(name)
        mass = w.MASSES.get(written.lower()) if kind == "force" else None
        meant = mass or w.near(written or name, kind) or "?"
        message = f"the column {name[:60]!r} has no unit that is known"
        if mass or w.kind_of(written):
            what = "a mass" if mass else f"no unit of a {kind}"
            message = f"the column {name[:60]!r} is in {written}, {what}"
        elif meant != "?":
            message += f"; is {meant!r} meant?"
        if w.has_factor(name):
            message = f"the column {name[:60]!r} may be multiplied: its unit with the factor?"
        text = meant if w.kind_of(meant) else "?"
        return Refusal(message, units=((CALLED[each], text),), hint=f"known: {w.listed(kind)}")

    def mixed(self, chosen: dict[str, list[Column]]) -> Refusal | None:
        """The refusal of a stated column of one specimen beside another's."""
        for column in (column for found in chosen.values() for column in found if column.stated):
            same = [at for at, name in enumerate(self.names) if name == column.name]
            own = f"{same.index(column.place) + 1}"
            if len(same) > 1 and own != self.mapping.specimen:
                return Refusal(f"column {column.place + 1} is of specimen {own}", specimen=own)
        return None

    def incomplete(self, chosen: dict[str, list[Column]]) -> Refusal | None:
        """The refusal of a header without force, without travel, or with two travels."""
        if chosen.keys() >= w.TRAVELS:
            one, other = (chosen[each][0] for each in ("position_m", "displacement_m"))
            return Refusal(
                f"both {one.name!r} and {other.name!r}: which one is meant?",
                columns=(("position", one.name or str(one.place + 1)),),
                hint="travel of the machine; or displacement=, deformation of the payload alone",
            )  # fmt: skip
        roles = {CALLED[each] for each in chosen}
        if chosen and (idle := [name for name, _ in self.mapping.units if name not in roles]):
            return Refusal(f"--units {idle[0]}: no column is the {idle[0]}; there are "
                           f"{', '.join(sorted(roles))}", known=5)  # fmt: skip
        missing = [] if "force_n" in chosen else ["force"]
        missing += [] if chosen.keys() & w.TRAVELS else ["position"]
        if not missing:
            return None
        needed = ROLES[missing[0]]
        close = difflib.get_close_matches(needed, self.names, 1, 0.5)
        meant = f"is {close[0]!r} meant?" if close else self.all()
        return Refusal(
            f"no column for the {_called(needed)} ({needed}); {meant}",
            columns=tuple((each, close[0] if close and each == missing[0] else "?") 
                          for each in missing),
            hint="names or numbers, units in brackets: 'force=3 (kN)'",
        )  # fmt: skip


def _epoch(text: str) -> str:
    """The unit of a time since 1970; "" where it is none."""
    value = float(text) if re.fullmatch(r"[0-9]+(?:\.[0-9]*)?", text) else 0.0
    return next((each for each, size in _EPOCH.items() if size <= value < 4.1 * size), "")


def _called(each: str) -> str:
    return {"time_s": "time", "force_n": "force", w.LATERAL: "lateral force"}.get(each, "travel")
