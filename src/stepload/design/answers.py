"""A map in words: what this rig measures, where (34) is wrong, what to buy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from stepload.design.binomial import Share
from stepload.design.points import BUY, PAYLOADS
from stepload.design.work import Row
from stepload.envelope.benches import Bench, Specimen
from stepload.units import format_quantity

REQUIRED = 0.9
"""Share of its runs that a rig must call IDENTIFIED, and rightly, to measure a payload: the lower
end of the 95 % interval of that share counts, never the share itself."""


class Can(StrEnum):
    """Whether a rig measures a payload."""

    YES = "yes"
    UNSURE = "not shown"
    NO = "no"


def can(measured: Share) -> Can:
    """Whether a rig measures a payload, from the bounds of its probability of doing so."""
    if measured.of and measured.low >= REQUIRED:
        return Can.YES
    return Can.NO if measured.high < REQUIRED else Can.UNSURE


@dataclass(frozen=True, slots=True)
class Map:
    """A map: a rig, payloads, and a row for every cell."""

    rig: Bench
    specimens: Sequence[Specimen]
    rows: Sequence[Row]
    seed: int
    samples: int

    def of(self, series: str) -> list[Row]:
        """The rows of a series."""
        return [row for row in self.rows if row.point.series == series]


@dataclass(frozen=True, slots=True)
class Reach:
    """Range of stiffness of the payloads that are measured in one row of a panel.

    Attributes:
        series, value, change: the row.
        from_n_per_m, to_n_per_m: softest and stiffest measured column, with all columns between
            measured too; NaN where there is none.
        beyond_n_per_m: the next column, which is not measured; NaN where the map ends.
        within_n_per_m: the stiffest column in which the headline is right within 1/t as often,
            whatever its verdict; NaN where there is none.
        k_max_n_per_m: (34).
        unsure: it is undecided whether the next column, or any column where none is measured, is
            measured.
    """

    series: str
    value: float
    change: str
    from_n_per_m: float
    to_n_per_m: float
    beyond_n_per_m: float
    within_n_per_m: float
    k_max_n_per_m: float
    unsure: bool = False

    @property
    def guideline(self) -> str:
        """Comparison with the guideline (34) in this row."""
        if math.isnan(self.to_n_per_m):
            if self.unsure:
                return "not tested: too few --samples"
            return "too bold: nothing is measured"
        if self.to_n_per_m > self.k_max_n_per_m:
            return f"too careful, by {self.to_n_per_m / self.k_max_n_per_m:.3g} at least"
        if math.isnan(self.beyond_n_per_m):
            return "not tested: the map ends below it"
        if self.beyond_n_per_m < self.k_max_n_per_m and not self.unsure:
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
    secants = [row.point.cell.payload.secant_n_per_m for row in rows]
    said = [can(row.measured) for row in rows]
    first, last = _block([each is Can.YES for each in said])
    within = _block([can(row.within) is Can.YES for row in rows])[1]
    return Reach(
        series,
        math.nan if series == BUY else value,
        change,
        secants[first] if last >= 0 else math.nan,
        secants[last] if last >= 0 else math.nan,
        secants[last + 1] if 0 <= last < len(rows) - 1 else math.nan,
        secants[within] if within >= 0 else math.nan,
        rows[0].k_max_n_per_m,
        Can.UNSURE in (said if last < 0 else said[last + 1 : last + 2]),
    )


def _block(yes: Sequence[bool]) -> tuple[int, int]:
    """First and last of the stiffest block of measured columns; last -1: none."""
    last = max((i for i, each in enumerate(yes) if each), default=-1)
    first = last
    while first > 0 and yes[first - 1]:
        first -= 1
    return first, last


@dataclass(frozen=True, slots=True)
class PayloadAnswer:
    """Answer for one payload.

    Attributes:
        specimen: the payload.
        can: whether the rig measures it without a change; NO where it is not pressed.
        row: result without a change; None where it is not pressed.
        best: the most effective single change; None where the rig measures it already, or no change
            helps.
    """

    specimen: Specimen
    can: Can
    row: Row | None
    best: Row | None

    @property
    def text(self) -> str:
        """The answer in a sentence or two."""
        each = self.specimen
        if self.row is None:
            return f"{each.name}: no; {each.why}"
        share, half = self.row.measured, self.row.half_width
        secant = format_quantity(each.secant_n_per_m, "N/m")
        width = "wider than the figure" if math.isnan(half) else f"±{half:.0%}"
        said = (
            f"{each.name}: {self.can}: {secant} at {each.top_n:.3g} N, rightly IDENTIFIED in "
            f"{share.value:.0%} of the runs ({share.low:.0%} to {share.high:.0%}), interval {width}"
        )
        if each.why:
            said += f"; {each.why}"
        if self.can is Can.UNSURE:
            return f"{said}; more --samples would tell"
        return said if self.can is Can.YES else f"{said}. {self._advice()}"

    def _advice(self) -> str:
        if self.best is None:
            return "None of the changes looked at gains anything"
        share, name = self.best.measured, self.best.point.change
        if can(share) is Can.YES:
            return f"To buy: {name}, with which it is measured ({share.value:.0%})"
        half = self.best.half_width
        width = "" if math.isnan(half) else f", interval ±{half:.0%}"
        return f"No single change will do; {name} gains most ({share.value:.0%}{width})"


def payload_answers(found: Map) -> list[PayloadAnswer]:
    """One answer for every payload."""
    rows = found.of(PAYLOADS)
    return [
        payload_answer(each, [row for row in rows if row.point.payload == each.name])
        for each in found.specimens
    ]


def payload_answer(specimen: Specimen, rows: Sequence[Row]) -> PayloadAnswer:
    """The answer for one payload; its first row is the rig as it is, the others have a change."""
    if not rows:
        return PayloadAnswer(specimen, Can.NO, None, None)
    now = can(rows[0].measured)
    best = max(rows, key=gain)
    gains = best is not rows[0] and now is Can.NO
    return PayloadAnswer(specimen, now, rows[0], best if gains else None)


def gain(row: Row) -> tuple[float, float]:
    """Sort key of a row: whether it is measured, then the width of the interval."""
    return row.measured.low, -math.inf if math.isnan(row.half_width) else -row.half_width


def sentences(found: Map) -> list[str]:
    """The answers in words."""
    every = reaches(found)
    bought = [each for each in every if each.series == BUY]
    said = [each.text for each in payload_answers(found)]
    said += [_how_stiff(each, found.rig.top_n) for each in bought[:1]]
    best = max(bought, key=lambda each: _number(each.to_n_per_m), default=None)
    if best is not None and _number(best.to_n_per_m) > _number(bought[0].to_n_per_m):
        said.append(f"Of the changes looked at, {best.change} reaches farthest: {extent(best)}")
    return said


def _how_stiff(each: Reach, top_n: float) -> str:
    limit = format_quantity(each.k_max_n_per_m, "N/m")
    if math.isnan(each.to_n_per_m) and each.unsure:
        return (
            f"As it is this rig may measure some stiffness of the map at {top_n:.4g} N, or none: "
            f"so few runs do not show it, more --samples would tell; (34): {limit}"
        )
    if math.isnan(each.to_n_per_m):
        return f"As it is this rig measures no stiffness of the map at {top_n:.4g} N; (34): {limit}"
    return (
        f"As it is this rig measures spheres of {extent(each)} (secant at {top_n:.4g} N) in at "
        f"least {REQUIRED:.0%} of its runs; the guideline (34), {limit}, is {each.guideline}"
    )


def extent(each: Reach) -> str:
    """The measured range of stiffness in words; a single column is no range."""
    if math.isnan(each.to_n_per_m):
        return "not shown" if each.unsure else "nothing"
    low, high = (format_quantity(n, "N/m") for n in (each.from_n_per_m, each.to_n_per_m))
    return f"about {low}" if low == high else f"{low} to {high}"


def _number(value: float) -> float:
    return -math.inf if math.isnan(value) else value
