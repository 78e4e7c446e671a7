"""Finds the names of a table's columns, and determines the role and unit of each, or refuses it."""

from __future__ import annotations

import csv
import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass

from stepload.record.curve_mapping import CALLED, ROLES, CurveMapping, Refusal, listed
from stepload.record.curve_words import (
    KIND_OF_ROLE,
    LATERAL,
    MASSES,
    bracketed,
    has_word,
    kind_of,
    near,
    role,
    scale_of,
    unit,
    unit_of,
    words,
)

MAX_PREAMBLE = 400
"""Lines that an instrument may write before the names of the columns."""
NUMBER = re.compile(
    r"[+\-−]?(?:\d+(?:[,.'’ \u00a0\u2009\u202f]\d{3}(?!\d))*(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?",
    re.ASCII,
)
CLOCK = re.compile(
    r"(?:(?P<date>\d{1,4}[-./]\d{1,2}[-./]\d{1,4})[T ]\s*)?(?P<h>\d{1,2}):(?P<m>[0-5]\d):"
    r"(?P<s>[0-5]?\d(?:[.,]\d+)?)\s*(?P<half>[AaPp][Mm])?(?P<zone>Z|[+-]\d\d:?\d\d)?",
    re.ASCII,
)
ERRORS = frozenset({"#n/a", "#ref!", "#div/0!", "#value!", "#name?", "#num!", "#null!"})
"""What a spreadsheet writes in place of a number."""
_EPOCH = {"s": 1e9, "ms": 1e12, "µs": 1e15, "ns": 1e18}
"""Unit of a time since 1970 by the size of its first value, of the years 2001 to 2100."""
_FIRST_ROWS = 3
NONE = "none"
"""Stated for a role that no column has."""
_TRAVELS = {"position_m", "displacement_m"}


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its place, its name in the file, what it is, and its unit in SI.

    `unit_place`: the column of its units, or its own where a unit stands behind each number.
    `source`: where the unit is from.
    """

    place: int
    name: str
    role: str
    unit: str
    scale: float
    unit_place: int | None = None
    source: str = "name"


@dataclass(frozen=True, slots=True)
class Header:
    """The columns that are used, and the rows below.

    Attributes:
        delimiter: of the cells; None: spaces.
        names: all names; empty where the table has none.
        line: where they are, from 1; 0 where there are none.
        units_line: the row of units; 0 where there is none.
        begin: index of the first line below.
        beside: how many specimens are beside each other.
    """

    delimiter: str | None
    columns: tuple[Column, ...]
    names: tuple[str, ...]
    line: int
    units_line: int
    begin: int
    width: int
    beside: int = 1


def may_be_machine(column: Column) -> bool:
    """Whether a column of displacement may hold the machine's own deflection as well.

    Testing machines use such names for their crosshead's travel; depth, indentation and deformation
    are the payload's, and so is what is stated, and stepload's own name with any unit.
    """
    if column.role != "displacement_m" or column.source.endswith("stated role"):
        return False
    own = re.fullmatch(r"displacement_\w+", column.name)
    return not own and has_word(column.name, "perhaps_machine")


def split(line: str, delimiter: str | None) -> list[str]:
    """The cells of a line, without quotes and spaces around them."""
    if delimiter is not None and '"' in line:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    return [cell.strip() for cell in line.split(delimiter)]


def is_comment(text: str) -> bool:
    """Whether a line that is not empty is a comment: a # in it may be the error of a spreadsheet."""
    return text.startswith("#") and re.split(r"[,;\t]", text, maxsplit=1)[0].lower() not in ERRORS


def find_header(
    lines: Sequence[str], mapping: CurveMapping, delimiter: str | None = None, start: int = 0
) -> Header:
    """The first line that names force and travel, among those that an instrument writes above.

    The line below it may hold the units. Where no line names them, the comment above the numbers,
    cells with units, or the stated numbers of columns do.

    Raises:
        Refusal: what looks most like a header, and what it lacks.
    """
    by_number = any(text != NONE for _, text in mapping.columns) and all(
        bracket_free(text).isdigit() for _, text in mapping.columns if text != NONE
    )
    best: Refusal | None = None
    comments: list[int] = []
    numbers = 0
    end = min(len(lines), start + MAX_PREAMBLE)
    for at in range(start, end):
        text = lines[at].strip()
        if not text:
            continue
        if is_comment(text):
            comments.append(at)
            continue
        if _cells_of_numbers(lines, at, delimiter):
            numbers += 1
            if numbers >= _FIRST_ROWS:
                end = at
                break
            continue
        if by_number:
            continue
        try:
            return _header_at(lines, at, text, mapping, delimiter)
        except Refusal as error:
            if best is None or error.known > best.known:
                best = error
    for at in reversed(comments):
        try:
            return _header_at(lines, at, lines[at].strip().lstrip("# "), mapping, delimiter)
        except Refusal as error:
            if best is None or error.known > best.known:
                best = error
    for at in range(start, min(len(lines), end + 1)):
        if found := _without_names(lines, at, mapping, delimiter, by_number):
            return found
    if numbers and (best is None or not best.known):
        raise Refusal(
            "the columns have no names", end - _FIRST_ROWS + 2, hint="numbers from 1, units such as N, mm, s",
            columns=(("force", "?"), ("position", "?")), units=(("force", "?"), ("position", "?")),
        )  # fmt: skip
    raise best or Refusal("the file is empty", max(len(lines), 1))


def bracket_free(text: str) -> str:
    """A text without the unit in brackets at its end."""
    return re.sub(r"\s*[\[(][^\[\]()]*[\])]$", "", text.strip())


def _delimiters(line: str, given: str | None) -> list[str | None]:
    return [given] if given else [*(mark for mark in "\t;," if mark in line), None]


def _cells_of_numbers(lines: Sequence[str], at: int, given: str | None) -> list[str]:
    """The cells of a line that holds numbers only; none where it does not."""
    for delimiter in _delimiters(lines[at], given):
        cells = split(lines[at], delimiter)
        if all(NUMBER.fullmatch(cell) or not cell for cell in cells) and any(cells):
            return cells
    return []


def _below(lines: Sequence[str], at: int) -> int:
    """The next line that is neither empty nor a comment."""
    for index in range(at + 1, min(len(lines), at + MAX_PREAMBLE)):
        if (text := lines[index].strip()) and not is_comment(text):
            return index
    return len(lines)


def _header_at(
    lines: Sequence[str], at: int, text: str, mapping: CurveMapping, given: str | None
) -> Header:
    """The header whose names are in this line; raises Refusal."""
    refusal: Refusal | None = None
    found: Header | None = None
    for delimiter in _delimiters(text, given):
        names = split(text, delimiter)
        below = _below(lines, at)
        units = _row_of_units(lines, below, delimiter, len(names))
        units_at = below if units else None
        if units is None and at and (units := _row_of_units(lines, at - 1, delimiter, len(names))):
            units_at = at - 1
        first = _below(lines, below) if units_at == below else below
        cells = split(lines[first], delimiter) if first < len(lines) else []
        fits = len(cells) == len(names) or (len(cells) == len(names) + 1 and not cells[-1])
        if delimiter is None and not (
            len(names) > 1 and (fits or all(unit_of(name) is not None for name in names))
        ):
            names = [text]  # several words and no delimiter: one column, or prose
        try:
            columns, beside = columns_of(names, units or [], cells, mapping)
        except Refusal as error:
            error.line, error.known = at + 1, error.known if len(names) > 1 else 0
            if refusal is None or error.known > refusal.known:
                refusal = error
            continue
        units_line = units_at + 1 if units_at is not None else 0
        header = Header(
            delimiter, columns, tuple(names), at + 1, units_line,
            below + 1 if units_at == below else at + 1, len(names), beside,
        )  # fmt: skip
        if fits:
            return header
        found = found or header
    if found is None:
        assert refusal is not None
        raise refusal
    return found


def _row_of_units(
    lines: Sequence[str], at: int, delimiter: str | None, width: int
) -> list[str] | None:
    """The units in a line; None where it holds anything else."""
    cells = split(lines[at], delimiter) if at < len(lines) else []
    bare = [cell.strip("[]() ") for cell in cells]
    known = [unit(each) for each in bare]
    if len(bare) != width or not any(known) or any(NUMBER.fullmatch(each) for each in bare):
        return None
    symbols = all(k or len(each) <= 5 for k, each in zip(known, bare, strict=True))
    return [k or each for k, each in zip(known, bare, strict=True)] if symbols else None


def _without_names(
    lines: Sequence[str], at: int, mapping: CurveMapping, given: str | None, by_number: bool
) -> Header | None:
    """A table without names that begins here: stated numbers of columns, or units in the cells."""
    text = lines[at].strip()
    if not text or is_comment(text):
        return None
    for delimiter in _delimiters(text, given):
        cells = split(lines[at], delimiter)
        shown = [_inside(cell) for cell in cells]
        if len(cells) < 2:
            continue
        if by_number:
            places = [int(bracket_free(t)) - 1 for _, t in mapping.columns if t != NONE]
            ok = [0 <= p < len(cells) and shown[p] is not None for p in places]
            clocks = [0 <= p < len(cells) and CLOCK.fullmatch(cells[p]) for p in places]
            if not all(a or b for a, b in zip(ok, clocks, strict=True)):
                continue
        elif shown[0] is None or not any(map(unit, cells)) and not any(filter(None, shown)):
            continue
        names = [""] * len(cells)
        units: list[str] = []
        for above in range(at - 1, max(at - 4, -1), -1):
            row = split(lines[above].lstrip("# "), delimiter)
            if len(row) == len(cells) and not _cells_of_numbers(lines, above, given):
                if not units and (units := _row_of_units(lines, above, delimiter, len(row)) or []):
                    continue
                names = row
                break
        columns, beside = columns_of(names, units, cells, mapping)
        return Header(delimiter, columns, (), 0, 0, at, len(cells), beside)
    return None


def _inside(cell: str) -> str | None:
    """The unit behind a number in a cell, "" where there is none; None where it is no number."""
    match = NUMBER.match(cell)
    if match is None:
        return None
    rest = cell[match.end() :].strip()
    return rest and unit(rest)


def columns_of(
    names: Sequence[str], units: Sequence[str], cells: Sequence[str], mapping: CurveMapping
) -> tuple[tuple[Column, ...], int]:
    """The columns that are used, and how many specimens are beside each other.

    Args:
        names: of all columns.
        units: of the row of units; empty where there is none.
        cells: of the first row.

    Raises:
        Refusal: a column that is needed is missing, there twice, or without a known unit.
    """
    places: dict[str, list[int]] = {}
    told: dict[int, str] = {}
    stated = {ROLES[name] for name, _ in mapping.columns}
    for name, text in mapping.columns:
        if text == NONE:
            continue
        place, symbol = _place(names, cells, text, name)
        places.setdefault(ROLES[name], []).append(place)
        told[place] = symbol
    exact = {each for each in KIND_OF_ROLE if each in names} - stated
    fixed = (stated or exact) & _TRAVELS or exact & _TRAVELS
    for place, name in enumerate(names):
        each = role(name) if name else _role_of_cell(cells, place)
        if each is None or each in stated or place in told:
            continue
        if (each in exact and name != each) or (each in _TRAVELS and fixed and each not in fixed):
            continue
        places.setdefault(each, []).append(place)
    chosen: dict[str, list[Column]] = {}
    refusal: Refusal | None = None
    beside = 1
    for each, candidates in places.items():
        try:
            found = [
                column
                for place in candidates
                if (column := _column(place, each, names, units, cells, mapping, told))
            ]
            if not found and each != LATERAL:
                raise _no_unit(names[candidates[0]], candidates[0], each, units)
            if len(found) > 1 and each != LATERAL:
                beside = max(beside, len(found))
                found = [_one_of(found, each, mapping)]
        except Refusal as error:
            if refusal is None or each == "force_n":
                refusal = error
            continue
        if found:
            chosen[each] = found
    if refusal is not None:
        refusal.known = len(places)
        raise refusal
    _complete(chosen, names, len(places))
    return tuple(column for found in chosen.values() for column in found), beside


def _place(names: Sequence[str], cells: Sequence[str], text: str, name: str) -> tuple[int, str]:
    """The column that a text states, and the unit in its brackets."""
    bare, symbol = bracket_free(text), unit(bracketed(text)) or ""
    for sought, told in ((text, ""), (bare, symbol)):
        same = [place for place, each in enumerate(names) if each == sought]
        same = same or [p for p, each in enumerate(names) if each.lower() == sought.lower()]
        if len(same) == 1:
            return same[0], told
        if len(same) > 1:
            numbers = ", ".join(str(place + 1) for place in same)
            raise Refusal(
                f"{len(same)} columns are called {sought!r}: {numbers}", known=len(same) + 4,
                columns=((name, f"{same[0] + 1}" + (f" ({told})" if told else "")),),
            )  # fmt: skip
        if sought.isdigit() and 1 <= int(sought) <= max(len(names), len(cells)):
            return int(sought) - 1, told
    raise Refusal(f"no column is called {text!r}; {_all(names)}", columns=((name, "?"),))


def _all(names: Sequence[str]) -> str:
    return "columns: " + ", ".join(f"{i} {n!r}" for i, n in enumerate(names, 1))[:300]


def _role_of_cell(cells: Sequence[str], place: int) -> str | None:
    """The role of a column without a name by the unit in or beside its first cell."""
    _, symbol = _unit_in_cells(cells, place)
    return {"force": "force_n", "length": "position_m", "time": "time_s", "": None}[kind_of(symbol)]


def _unit_in_cells(cells: Sequence[str], place: int) -> tuple[int, str]:
    """The column of the units of a column, and the first of them; "" where there is none."""
    inside = _inside(cells[place]) if place < len(cells) else None
    if inside:
        return place, inside
    beside = unit(cells[place + 1]) if inside is not None and place + 1 < len(cells) else None
    return place + 1, beside or ""


def _column(
    place: int, each: str, names: Sequence[str], units: Sequence[str], cells: Sequence[str],
    mapping: CurveMapping, told: dict[int, str],
) -> Column | None:  # fmt: skip
    """The column at a place in the role; None where no unit of its kind is known."""
    name, kind = names[place] if place < len(names) else "", KIND_OF_ROLE[each]
    role_stated = " stated role" if place in told else ""
    first = cells[place] if place < len(cells) else ""
    if kind == "time" and CLOCK.fullmatch(first):
        return Column(place, name, each, "clock", 1.0, None, "cells" + role_stated)
    in_name, in_row = unit_of(name), units[place] if place < len(units) else ""
    unit_place, in_cells = _unit_in_cells(cells, place)
    wanted = unit(dict(mapping.units).get(CALLED[each], "") or told.get(place, ""))
    if not wanted and in_name and kind_of(in_row) and in_name != in_row:
        raise Refusal(
            f"the column {name[:60]!r} is in {in_row} in the row of units", known=4,
            units=((CALLED[each], in_row),), hint=f"or {in_name}",
        )  # fmt: skip
    sources = {
        "cells": in_cells, "stated": wanted, "name": in_name, "row of units": in_row,
        "size": _epoch(first) if kind == "time" else None,
    }  # fmt: skip
    for source, symbol in sources.items():
        if symbol and (kind_of(symbol) == kind or source == "name"):
            if kind_of(symbol) != kind:
                return None
            at = unit_place if source == "cells" else None
            return Column(place, name, each, symbol, scale_of(symbol), at, source + role_stated)
    return None


def _epoch(text: str) -> str | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return next((each for each, size in _EPOCH.items() if size <= value < 4.1 * size), None)


def _one_of(found: Sequence[Column], each: str, mapping: CurveMapping) -> Column:
    """The one column of several in a role that is meant; raises Refusal."""
    if len({column.name for column in found}) == 1 and found[0].name:
        if mapping.specimen.isdigit() and int(mapping.specimen) <= len(found):
            return found[int(mapping.specimen) - 1]
        raise Refusal(
            f"{len(found)} specimens beside each other: {found[0].name!r} is there "
            f"{len(found)} times", hint=f"1 to {len(found)}", specimen="1",
        )  # fmt: skip
    if each == "time_s" and (stamp := [c for c in found if c.name.endswith("header.stamp")]):
        return stamp[0]
    along = [column for column in found if not {"x", "y"} & set(words(column.name))]
    if each == "position_m" and len(along) == 1 and "z" in words(along[0].name):
        return along[0]
    told = ", ".join(f"{column.place + 1} {column.name!r}" for column in found)
    column = found[0]
    same = sum(each.name == column.name for each in found) > 1 or not column.name
    text = f"{column.place + 1} ({column.unit})" if same else column.name
    raise Refusal(
        f"{len(found)} columns could be the {_called(each)}: {told[:200]}",
        hint="or another of them", columns=((CALLED[each], text),),
    )  # fmt: skip


def _no_unit(name: str, place: int, each: str, units: Sequence[str]) -> Refusal:
    """The refusal of a column whose unit is not known."""
    kind = KIND_OF_ROLE[each]
    written = unit_of(name) or (units[place] if place < len(units) else "")
    written = written or bracketed(name)
    mass = MASSES.get(written.lower())
    if kind == "force" and mass:
        message, meant = f"the column {name[:60]!r} is in {written}, a mass", mass
    elif kind_of(written):
        message, meant = f"the column {name[:60]!r} is in {written}, no unit of a {kind}", "?"
    else:
        meant = near(written or name, kind) or "?"
        message = f"the column {name[:60]!r} has no unit that is known"
        message += f"; is {meant!r} meant?" if meant != "?" else ""
    return Refusal(
        message, hint=f"known: {listed(kind)}",
        units=((CALLED[each], meant if kind_of(meant) else "?"),),
    )  # fmt: skip


def _complete(chosen: dict[str, list[Column]], names: Sequence[str], known: int) -> None:
    """Refuse a header without force, without travel, or with two travels."""
    if chosen.keys() >= _TRAVELS:
        one, other = (chosen[each][0] for each in ("position_m", "displacement_m"))
        raise Refusal(
            f"both {one.name!r} and {other.name!r}: which one is meant?", known=known,
            hint="travel of the machine; or displacement=, deformation of the payload alone",
            columns=(("position", one.name or str(one.place + 1)),),
        )  # fmt: skip
    missing = [] if "force_n" in chosen else ["force"]
    missing += [] if chosen.keys() & _TRAVELS else ["position"]
    if missing:
        close = [difflib.get_close_matches(ROLES[each], names, 1, 0.5) for each in missing]
        meant = f"; is {close[0][0]!r} meant?" if close[0] else f"; {_all(names)}"
        raise Refusal(
            f"no column for the {_called(ROLES[missing[0]])} ({ROLES[missing[0]]}){meant}",
            known=known, columns=tuple((each, "?") for each in missing),
            hint="their names or numbers, units in brackets: 'force=3 (kN)'",
        )  # fmt: skip


def _called(each: str) -> str:
    return {"time_s": "time", "force_n": "force", LATERAL: "lateral force"}.get(each, "travel")
