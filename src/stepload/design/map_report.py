"""A map in words and tables: for the terminal, as an object for programs, as columns of a file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from stepload.design.map import BUY, LARGEST, PAYLOADS, Map, Row
from stepload.feasibility.map_grid import Bench, Specimen
from stepload.identification.changes import relative_sigma
from stepload.identification.expected import Narrowing
from stepload.report.model import Table
from stepload.units import format_quantity, percent


@dataclass(frozen=True, slots=True)
class Reach:
    """Range of stiffness of the payloads that are measured in one row of a panel.

    Attributes:
        series, value, change: the row.
        from_n_per_m, to_n_per_m: softest column that is measured, and the stiffness up to which
            it goes on without a gap; NaN where there is none.
        within_n_per_m: the stiffness at which the interval becomes wider than ±1/t, below (34) or
            not, between two columns; NaN where no column is within it.
        beyond_n_per_m: the next column; NaN where the map ends.
        k_max_n_per_m: (34).
    """

    series: str
    value: float
    change: str
    from_n_per_m: float
    to_n_per_m: float
    within_n_per_m: float
    beyond_n_per_m: float
    k_max_n_per_m: float

    @property
    def guideline(self) -> str:
        """Comparison of the interval with the guideline (34) in this row."""
        if math.isnan(self.within_n_per_m):
            return "too bold: no interval is narrow enough"
        if self.within_n_per_m > self.k_max_n_per_m:
            return f"too careful, by {self.within_n_per_m / self.k_max_n_per_m:.3g} at least"
        if math.isnan(self.beyond_n_per_m):
            return "not tested: the map ends below it"
        if self.beyond_n_per_m < self.k_max_n_per_m:
            return f"too bold, by {self.k_max_n_per_m / self.beyond_n_per_m:.3g} at least"
        return "right, as far as the columns tell"


def reaches(found: Map) -> list[Reach]:
    """The range of every row of every panel."""
    groups: dict[tuple[str, float, str], list[Row]] = {}
    for row in found.rows:
        if row.point.series != PAYLOADS:
            value = 0.0 if row.point.series == BUY else row.point.value
            groups.setdefault((row.point.series, value, row.point.change), []).append(row)
    return [_reach(*key, rows) for key, rows in groups.items()]


def _reach(series: str, value: float, change: str, rows: Sequence[Row]) -> Reach:
    secants = [*(row.point.secant_n_per_m for row in rows), math.nan]
    first, last = _block([row.measured for row in rows])
    within = _block([row.narrow for row in rows])[1]
    limit_n_per_m, end_n_per_m = rows[0].k_max_n_per_m, _end(rows, within)
    return Reach(
        series,
        math.nan if series == BUY else value,
        change,
        secants[first],
        max(secants[last], min(end_n_per_m, limit_n_per_m)) if last >= 0 else math.nan,
        end_n_per_m,
        secants[within + 1] if within >= 0 else math.nan,
        limit_n_per_m,
    )


def _end(rows: Sequence[Row], last: int) -> float:
    """The stiffness in N/m at which the interval becomes wider than ±1/t, between the last narrow
    column and the next one; NaN where no column is narrow."""
    if last < 0:
        return math.nan
    here, secant = rows[last], rows[last].point.secant_n_per_m
    if last == len(rows) - 1 or math.isnan(rows[last + 1].half_width):
        return secant
    beyond = rows[last + 1]
    share = math.log(1.0 / (here.point.conditions.t * here.half_width))
    share /= math.log(beyond.half_width / here.half_width)
    return secant * math.exp(share * math.log(beyond.point.secant_n_per_m / secant))


def _block(yes: Sequence[bool]) -> tuple[int, int]:
    """First and last of the stiffest block of measured columns; last -1: none."""
    last = max((i for i, each in enumerate(yes) if each), default=-1)
    first = last
    while first > 0 and yes[first - 1]:
        first -= 1
    return first, last


@dataclass(frozen=True, slots=True)
class PayloadAnswer:
    """Answer for one payload; `row` is None where it is not pressed."""

    specimen: Specimen
    row: Row | None

    @property
    def can(self) -> str:
        """Whether the rig measures it."""
        return "yes" if self.row is not None and self.row.measured else "no"

    @property
    def best(self) -> Narrowing | None:
        """What narrows its interval most; None where nothing does."""
        found = self.row.narrowing if self.row is not None else ()
        return min(found, key=lambda each: each.half_width, default=None)

    @property
    def text(self) -> str:
        """The answer in a sentence or two."""
        each = self.specimen
        if self.row is None:
            return f"{each.name}: no; {each.why}"
        secant = format_quantity(each.secant_n_per_m, "N/m")
        said = f"{each.name}: {self.can}: {secant} at {each.top_n:.3g} N, interval "
        said += half_text(self.row.half_width)
        if self.row.point.secant_n_per_m >= self.row.k_max_n_per_m:
            said += f", K_max (34) {format_quantity(self.row.k_max_n_per_m, 'N/m')}"
        if each.why:
            said += f"; {each.why}"
        told = narrowing_text(self.row.narrowing)
        return f"{said}. {told}" if told else said


def half_text(half: float) -> str:
    """A half width in words."""
    return f"±{percent(half, 2)}" if half <= 1.0 else "wider than the figure"


def narrowing_text(found: Sequence[Narrowing]) -> str:
    """What narrows an interval, as a sentence; "" where nothing does."""
    told = [f"{each.todo}: {half_text(each.half_width)} ({each.line})" for each in found]
    return f"Narrower with {'; '.join(told)}" if told else ""


def payload_answers(found: Map) -> list[PayloadAnswer]:
    """One answer for every payload."""
    rows = {row.point.payload: row for row in found.of(PAYLOADS)}
    return [PayloadAnswer(each, rows.get(each.name)) for each in found.specimens]


def sentences(found: Map) -> list[str]:
    """The answers in words."""
    bought = [each for each in reaches(found) if each.series == BUY]
    said = [each.text for each in payload_answers(found)]
    said += [_how_stiff(each, found.rig) for each in bought[:1]]
    best = max(bought, key=lambda each: _number(each.to_n_per_m), default=None)
    if best is not None and _number(best.to_n_per_m) > _number(bought[0].to_n_per_m):
        said.append(f"Of the changes looked at, {best.change} reaches farthest: {extent(best)}")
    return said


def _how_stiff(each: Reach, rig: Bench) -> str:
    limit, top = format_quantity(each.k_max_n_per_m, "N/m"), f"{rig.top_n:.4g} N"
    if math.isnan(each.to_n_per_m):
        return f"As it is this rig measures no stiffness of the map at {top}; (34): {limit}"
    return (
        f"As it is this rig measures spheres of {extent(each)} (secant at {top}) to "
        f"±{percent(1.0 / rig.conditions.t)} or better; the guideline (34), {limit}, is "
        f"{each.guideline}"
    )


def extent(each: Reach) -> str:
    """The measured range of stiffness in words; a single column is no range."""
    if math.isnan(each.to_n_per_m):
        return "nothing"
    low, high = (format_quantity(n, "N/m") for n in (each.from_n_per_m, each.to_n_per_m))
    return f"about {low}" if low == high else f"{low} to {high}"


def _number(value: float) -> float:
    return -math.inf if math.isnan(value) else value


UNITS = {"system stiffness": "N/m", "position resolution": "m", "gauge": "m"}


def payload_table(found: Map) -> Table:
    """Answers for every payload."""
    rows = [
        (
            each.specimen.name,
            f"{each.specimen.top_n:.3g} N" if each.row else "not pressed",
            format_quantity(each.specimen.secant_n_per_m, "N/m"),
            half_text(each.row.half_width) if each.row else "",
            each.can,
            f"{each.best.todo}: {half_text(each.best.half_width)}" if each.best else "",
        )
        for each in payload_answers(found)
    ]
    columns = ("payload", "force", "secant", "interval", "can be measured", "narrower with")
    return Table(f"Payloads on {found.rig.name}", columns, rows, (explained(found),))


def explained(found: Map) -> str:
    """Explanation of the columns in the table of payloads."""
    accuracy = percent(1.0 / found.rig.conditions.t)
    return (
        f"A payload can be measured where the 95 % interval of its chord is ±{accuracy} (1/t) or "
        "narrower, and its secant is below K_max (34)."
    )


def reach_table(found: Map) -> Table:
    """Measured range of stiffness, row by row of the panels."""
    rows = []
    for each in reaches(found):
        limit = format_quantity(each.k_max_n_per_m, "N/m")
        rows.append((each.series, value_text(each), extent(each), limit, each.guideline))
    columns = ("varied", "value", "can be measured, without a gap", "K_max (34)", "(34) is")
    return Table(f"Secant stiffness at {found.rig.top_n:.4g} N", columns, rows)


def value_text(each: Reach) -> str:
    """The change of a row against the rig as it is."""
    if each.change:
        return each.change
    if each.series == "sigma of K_s":
        return f"{100.0 * each.value:.2g} %"
    unit = UNITS.get(each.series)
    return format_quantity(each.value, unit, 2) if unit else f"n = {each.value:g}"


def cell(row: Row) -> dict[str, Any]:
    """A cell as flat columns."""
    point, told = row.point, row.point.conditions
    lines = [line.source for line in row.lines] + [""] * (LARGEST - len(row.lines))
    return {
        "series": point.series,
        "index": point.index,
        "value": point.value,
        "change": point.change,
        "payload": point.payload,
        "top_force_n": point.top_n,
        "secant_n_per_m": point.secant_n_per_m,
        "exponent": point.exponent,
        "system_stiffness_n_per_m": told.sources.system_stiffness_n_per_m or math.nan,
        "system_stiffness_relative_sigma": relative_sigma(told),
        "position_resolution_m": told.position_resolution_m,
        "gauge": told.sources.system_stiffness_n_per_m is None,
        "k_max_n_per_m": row.k_max_n_per_m,
        "half_width": row.half_width,
        "largest_line": lines[0],
        "second_line": lines[1],
        "can": "yes" if row.measured else "no",
        "problem": row.problem,
    }


def data(found: Map) -> dict[str, Any]:
    """The JSON object of a map."""
    rig = found.rig
    return {
        "rig": rig.name,
        "top_force_n": rig.top_n,
        "system_stiffness_n_per_m": rig.conditions.sources.system_stiffness_n_per_m,
        "system_stiffness_note": rig.note,
        "accuracy": 1.0 / rig.conditions.t,
        "answers": sentences(found),
        "payloads": [
            {
                "name": each.specimen.name,
                "top_force_n": each.specimen.top_n,
                "secant_n_per_m": each.specimen.secant_n_per_m,
                "exponent": each.specimen.exponent,
                "can": each.can,
                "half_width": each.row.half_width if each.row else math.nan,
                "why": each.specimen.why,
                "best_change": each.best.todo if each.best else "",
                "narrowing": [asdict(way) for way in each.row.narrowing] if each.row else [],
                "text": each.text,
            }
            for each in payload_answers(found)
        ],
        "reach": [asdict(each) | {"guideline": each.guideline} for each in reaches(found)],
        "cells": [cell(row) for row in found.rows],
    }
