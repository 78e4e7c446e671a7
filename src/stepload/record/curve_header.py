"""Finds the names of a table's columns, and determines the role and unit of each, or refuses it."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter

import stepload.record.curve_words as w
from stepload.record.curve_mapping import CALLED, NONE, ROLES, CurveMapping, Refusal

MAX_PREAMBLE = 400
"""Lines that an instrument may write before the names of the columns."""
NUMBER = re.compile(
    r"[+\-−]?(?:\d+(?:[,.'’ \u00a0\u2009\u202f]\d{3}(?!\d))*(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?",
    re.ASCII,
)
ERRORS = frozenset({"#n/a", "#ref!", "#div/0!", "#value!", "#name?", "#num!", "#null!"})
"""What a spreadsheet writes in place of a number."""
_FIRST_ROWS = 3
_KNOWN = attrgetter("known")


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its number from 1, its name in the file, what it is, and its unit.

    `unit` "clock": times of day. `unit_from`: what says it. `unit_place`: the column (from 0) of
    its units, or its own where a unit is behind each number. `stated`: the user says which column
    it is. `lowest`, `highest`: its values in SI, once it is read.
    """

    number: int
    name: str
    role: str
    unit: str
    unit_from: str
    unit_place: int | None
    stated: bool
    lowest: float = 0.0
    highest: float = 0.0

    @property
    def place(self) -> int:
        return self.number - 1

    @property
    def may_be_machine(self) -> bool:
        """Whether a displacement may hold the machine's own deflection, as a crosshead's does.

        Depth and deformation are the payload's, so is what is stated or has stepload's own name.
        """
        own = self.stated or re.fullmatch(r"displacement_\w+", self.name)
        return self.role == "displacement_m" and not own and w.has_word(self.name, "machine")


@dataclass(frozen=True, slots=True)
class Header:
    """The columns that are used, and the rows below.

    `delimiter` None: spaces. `line`: of the names, from 1; 0 where there are none. `begin`: index
    of the first line below.
    """

    delimiter: str | None
    columns: tuple[Column, ...]
    names: tuple[str, ...]
    line: int
    begin: int
    width: int


def split(line: str, delimiter: str | None) -> list[str]:
    """The cells of a line, without quotes and spaces around them."""
    if delimiter is not None and '"' in line:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    return [cell.strip() for cell in line.split(delimiter)]


def is_comment(text: str) -> bool:
    """Whether a line, not empty, is a comment: a # in it may be the error of a spreadsheet."""
    return text[0] == "#" and re.split(r"[,;\t]", text, maxsplit=1)[0].lower() not in ERRORS


def find_header(lines: Sequence[str], mapping: CurveMapping, given: str | None = None) -> Header:
    """The first line that names force and travel, among those that an instrument writes above.

    Where no line does, the comment above the numbers, units in cells, or stated numbers of columns.
    Raises Refusal: what looks most like a header, and what it lacks.
    """
    names, comments, rows = list[int](), list[int](), list[int]()
    for at, line in enumerate(lines[:MAX_PREAMBLE]):
        if text := line.strip():
            kind = comments if is_comment(text) else rows if _width(line, given) else names
            kind.append(at)
            if len(rows) == _FIRST_ROWS:
                break
    best = Refusal("the file is empty", max(len(lines), 1), known=-1)
    named = [] if mapping.numbers else [*names, *reversed(comments), *rows[:1]]
    first = [(at, True) for at in sorted([*names, *rows])]
    for at, is_row in (*((at, False) for at in named), *first):
        try:
            return header_at(lines, at, mapping, given, is_row=is_row)
        except Refusal as error:
            best = max(best, error, key=_KNOWN)
            if mapping.numbers and error.known > 0:
                break  # the first row with the stated columns: those below it have no names
    raise best


def _delimiters(line: str, given: str | None) -> list[str | None]:
    return [given] if given else [*(mark for mark in "\t;," if mark in line), None]


def _width(line: str, given: str | None) -> int:
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


def header_at(
    lines: Sequence[str], at: int, mapping: CurveMapping, given: str | None, *, is_row: bool = False
) -> Header:
    """The header whose names are in this line, or whose first row it is; raises Refusal."""
    text = lines[at].strip()
    text = text.lstrip("# ") if is_comment(text) else text
    best = Refusal("no table", at + 1, known=-1)
    for delimiter in _delimiters(text, given):
        cells = split(text, delimiter)
        try:
            if header := (_above if is_row else _below)(lines, at, cells, delimiter, mapping):
                return header
        except Refusal as error:
            error.line, error.known = at + 1, error.known if len(cells) > 1 else 0
            best = max(best, error, key=_KNOWN)
    raise best


def _below(
    lines: Sequence[str], at: int, names: list[str], delimiter: str | None, mapping: CurveMapping
) -> Header:
    """The header with these names, their units below or above them; raises Refusal."""
    row_at, begin, count = _next(lines, at), at + 1, len(names)
    if units := _row_of_units(lines, row_at, delimiter, count):
        row_at, begin = _next(lines, row_at), row_at + 1
    else:
        units = _row_of_units(lines, _next(lines, at, -1), delimiter, count)
    cells = split(lines[row_at], delimiter) if row_at < len(lines) else []
    fits = len(cells) == count or (len(cells) == count + 1 and not cells[-1])
    if delimiter is None and not (fits or all(map(w.unit_of, names))):
        names = [" ".join(names)]  # several words and no delimiter: one column, or prose
    columns = _Names(names, units, cells, mapping).columns()
    width = len(cells) if fits else len(names)
    return Header(delimiter, columns, tuple(names), at + 1, begin, width)


def _above(
    lines: Sequence[str], at: int, cells: list[str], delimiter: str | None, mapping: CurveMapping
) -> Header | None:
    """The header of a table with this first row, by stated numbers or units in cells; else None."""
    width, names_at = len(cells), _next(lines, at, -1)
    stated = mapping.numbers or [0]
    if width < 2 or not all(0 <= x < width and NUMBER.match(cells[x]) for x in stated):
        return None
    no_names = [""] * width
    if not mapping.numbers and not any(_unit_in(cells, x, no_names)[1] for x in range(width)):
        return None
    if units := _row_of_units(lines, names_at, delimiter, width):
        names_at = _next(lines, names_at, -1)
    names = split(lines[names_at], delimiter) if names_at < at else []
    if len(names) != width or _width(lines[names_at], delimiter):
        names, names_at = no_names, -1
    columns = _Names(names, units, cells, mapping).columns()
    return Header(delimiter, columns, tuple(names), names_at + 1, at, width)


def _row_of_units(lines: Sequence[str], at: int, delimiter: str | None, width: int) -> list[str]:
    """The units in a line; none where it holds anything else."""
    cells = split(lines[at], delimiter) if at < len(lines) else []
    found = [w.unit(cell) or cell.strip("[]() ") for cell in cells]
    short = all(len(each) <= 5 and not NUMBER.match(each) for each in found)
    return found if len(cells) == width and short and any(map(w.kind_of, found)) else []


def _unit_in(cells: Sequence[str], place: int, names: Sequence[str]) -> tuple[int, str]:
    """The column of the units of a column (the next, without a name or called so), and the first
    of them; "" where there is none."""
    if match := NUMBER.match(cells[place] if place < len(cells) else ""):
        if rest := cells[place][match.end() :].strip():
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
        self.stated: set[int] = set()
        self.all = "columns: " + ", ".join(f"{at} {x!r}" for at, x in enumerate(names, 1))[:300]

    def columns(self) -> tuple[Column, ...]:
        """The columns that are used.

        Raises Refusal: a column that is needed is missing, there twice, or without a known unit.
        """
        places = self.places()
        try:
            found = {each: [c for place in candidates if (c := self.column(place, each))]
                     for each, candidates in places.items()}  # fmt: skip
            self.check(places, found)
        except Refusal as error:
            error.known += len(places)
            raise
        return tuple(sorted((x for some in found.values() for x in some), key=lambda x: x.number))

    def places(self) -> dict[str, list[int]]:
        """The columns that could have each role."""
        places: dict[str, list[int]] = {}
        stated = {ROLES[name] for name, _ in self.mapping.columns}
        for name, text in self.mapping.columns:
            if text != NONE:
                place = self.place(text, name)
                self.stated.add(place)
                places.setdefault(ROLES[name], []).append(place)
        exact = {each for each in w.KIND_OF_ROLE if each in self.names} - stated
        travels = stated & w.TRAVELS or exact & w.TRAVELS or w.TRAVELS
        for place, name in enumerate(self.names):
            kind = w.kind_of(_unit_in(self.cells, place, self.names)[1])
            of_cell = {"force": "force_n", "length": "position_m", "time": "time_s"}.get(kind)
            each = w.role(name) if name else of_cell
            if each is None or each in stated or place in self.stated:
                continue
            if each in w.TRAVELS - travels or (each in exact and name != each):
                continue
            places.setdefault(each, []).append(place)
        return places

    def place(self, text: str, name: str) -> int:
        """The column that a text states; raises Refusal."""
        same = [at for at, each in enumerate(self.names) if each == text]
        if len(same) == 1:
            return same[0]
        if text.isdigit() and 1 <= int(text) <= len(self.names):
            return int(text) - 1
        raise Refusal(f"{len(same) or 'no'} columns are called {text!r}; {self.all}",
                      hint="its number", columns=((name, "?"),), known=1)  # fmt: skip

    def column(self, place: int, each: str) -> Column | None:
        """The column at a place in a role; None where no unit of its kind is known."""
        name, kind, stated = self.names[place], w.KIND_OF_ROLE[each], place in self.stated
        first = self.cells[place] if place < len(self.cells) else ""
        if kind == "time" and ":" in first:
            return Column(place + 1, name, each, "clock", "cells", None, stated)
        unit_place, in_cells = _unit_in(self.cells, place, self.names)
        wanted, wrong = self.mapping.unit(CALLED[each])
        in_name, in_row = w.unit_of(name) or "", self.units[place]
        if (factor := w.has_factor(name)) and not wanted:
            return None
        own = [x for x in (in_name, in_row) if w.kind_of(x) == kind and not factor]
        if wanted and own and not {wanted, wrong} & {*own}:
            raise Refusal(f"the column {name[:60]!r} is in {own[0]}, not in {wanted}", known=4,
                          units=((CALLED[each], f"{wanted} not {own[0]}"),),
                          hint="only where the file is wrong")  # fmt: skip
        others = {each for each in (in_name, in_row, in_cells) if w.kind_of(each)}
        if len(others) > 1 and not wanted and w.kind_of(in_cells) in ("", kind):
            raise Refusal(f"the column {name[:60]!r} is in {' and '.join(sorted(others))}", known=4,
                          units=((CALLED[each], in_cells or in_row),))  # fmt: skip
        sources = {"cells": in_cells, "stated": wanted, "name": in_name, "row of units": in_row}
        for source, symbol in sources.items():
            if w.kind_of(symbol) == kind:
                at = unit_place if source == "cells" else None
                return Column(place + 1, name, each, symbol, source, at, stated)
            if symbol and source == "name":
                return None
        return None

    def check(self, places: dict[str, list[int]], found: dict[str, list[Column]]) -> None:
        """Raises Refusal: an unknown unit, several columns, a unit for none, a role missing."""
        needed = [each for each in found if each != w.LATERAL]
        if unknown := [each for each in needed if not found[each]]:
            kinds = dict.fromkeys(w.KIND_OF_ROLE[each] for each in unknown)
            first = [places[each][0] for each in unknown]
            told = " and ".join(repr(self.names[at][:60] or f"column {at + 1}") for at in first)
            factor = " with its factor" * any(w.has_factor(self.names[at]) for at in first)
            raise Refusal(f"no known unit of {' or '.join(kinds)}{factor}: {told}",
                          units=tuple((CALLED[each], "?") for each in unknown),
                          hint=w.listed(*kinds) if len(kinds) == 1 else "N, mm, s")  # fmt: skip
        if several := [each for each in needed if len(found[each]) > 1]:
            told = ", ".join(f"{len(found[each])} {CALLED[each]}" for each in several)
            stated = [column for some in found.values() for column in some if column.stated]
            of = max(map(self.beside, stated), default=0)
            same = [next((c for c in found[each] if self.beside(c) == of), found[each][0])
                    for each in several]  # fmt: skip
            raise Refusal(f"more than one column: {told}; {self.all}", hint="or others of them",
                          columns=tuple((CALLED[c.role], self.stating(c))
                                        for c in same))  # fmt: skip
        if found.keys() >= w.TRAVELS:
            one, other = found["position_m"][0], found["displacement_m"][0]
            raise Refusal(
                f"both {one.name!r} and {other.name!r}: which one is meant?",
                columns=(("position", self.stating(one)),),
                hint="travel of the machine; or displacement=, deformation of the payload alone",
            )  # fmt: skip
        roles = {CALLED[each] for each in found}
        if found and (idle := [name for name, _ in self.mapping.units if name not in roles]):
            told = ", ".join(sorted(roles))
            raise Refusal(f"--units {idle[0]}: no column is the {idle[0]}; there are {told}",
                          known=5)  # fmt: skip
        missing = [] if "force" in roles else ["force"]
        missing += [] if found.keys() & w.TRAVELS else ["position"]
        if missing:
            raise Refusal(f"no column for the {missing[0]} ({ROLES[missing[0]]}); {self.all}",
                          columns=tuple((each, "?") for each in missing),
                          hint="names or numbers")  # fmt: skip

    def beside(self, column: Column) -> int:
        """How many columns of the same name are left of one: those of another specimen."""
        return self.names[: column.place].count(column.name)

    def stating(self, column: Column) -> str:
        """The name of a column, or its number where the name is none or not the only one."""
        only = column.name and self.names.count(column.name) == 1
        return column.name if only else str(column.number)
