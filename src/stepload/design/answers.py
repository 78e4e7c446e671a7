"""A map in words: what this rig measures, where (34) is wrong, what narrows the interval."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from stepload.design.points import BUY, PAYLOADS, Row
from stepload.envelope.benches import Bench, Specimen
from stepload.evidence.expected import Narrowing
from stepload.units import format_quantity, percent


@dataclass(frozen=True, slots=True)
class Map:
    """A map: a rig, payloads, and a row for every cell."""

    rig: Bench
    specimens: Sequence[Specimen]
    rows: Sequence[Row]

    def of(self, series: str) -> list[Row]:
        """The rows of a series."""
        return [row for row in self.rows if row.point.series == series]


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
    secants = [row.point.secant_n_per_m for row in rows]
    first, last = _block([row.measured for row in rows])
    within = _block([row.narrow for row in rows])[1]
    limit_n_per_m, end_n_per_m = rows[0].k_max_n_per_m, _end(rows, within)
    return Reach(
        series,
        math.nan if series == BUY else value,
        change,
        secants[first] if last >= 0 else math.nan,
        max(secants[last], min(end_n_per_m, limit_n_per_m)) if last >= 0 else math.nan,
        end_n_per_m,
        secants[within + 1] if 0 <= within < len(rows) - 1 else math.nan,
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
