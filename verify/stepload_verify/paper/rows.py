"""A printed number next to ours, and what their nearness shows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

NEAR = 0.05
"""Relative deviation that counts as near."""


class Kind(StrEnum):
    """Kinds of evidence, counted apart: agreement means another thing in each."""

    ARITHMETIC = "arithmetic"
    ELEMENTS = "finite elements"
    FITTED = "finite elements × (10)"
    SIMULATED = "simulated"
    RETURNED = "put in, comes back"


SHOWS = {
    Kind.ARITHMETIC: "equations on printed dimensions, materials and tables",
    Kind.ELEMENTS: "half-angles for two secants, and what holds the spheres for Hertz, chosen",
    Kind.FITTED: "the same, and one hardness chosen for all",
    Kind.SIMULATED: "measured on those curves with the errors of the rig; what runs in is chosen",
    Kind.RETURNED: "that (26) gives back what was simulated; no more",
}


class Verdict(StrEnum):
    """Of a printed number beside ours: agrees, near, shows nothing, differs."""

    AGREES = "="
    NEAR = "≈"
    WIDE = "?"
    DIFFERS = "≠"


@dataclass(frozen=True, slots=True)
class Row:
    """One printed number.

    Attributes:
        quantity: what it is, with its unit.
        printed: the number as the paper prints it.
        ours: computed, or the median of simulated runs.
        kind: the evidence.
        span: (lowest, highest) that ours can be: 5 to 95 % of simulated runs.
        near: relative deviation that counts as near.
        wide: the span holds whatever one might have printed.
        limit: the paper says "within" or "below" `printed`.
        repeats: the number is printed twice; this is the second place, not counted.
        why: what there is to say.
    """

    quantity: str
    printed: str
    ours: float
    kind: Kind
    span: tuple[float, float] | None = None
    near: float = NEAR
    wide: bool = False
    limit: bool = False
    repeats: bool = False
    why: str = ""

    @property
    def verdict(self) -> Verdict:
        """Agreement needs half a unit of the last printed digit, or the span."""
        if self._met():
            return Verdict.WIDE if self.wide else Verdict.AGREES
        ratio = self.ours / float(self.printed)
        if self.limit:
            return Verdict.DIFFERS
        near = ratio > 0 and abs(math.log(ratio)) <= math.log1p(self.near)
        return Verdict.NEAR if near and not self.wide else Verdict.DIFFERS

    def _met(self) -> bool:
        if self.limit:
            return self.ours <= float(self.printed)
        low, high = self.span or (self.ours, self.ours)
        return meets(self.printed, low, high)


@dataclass(frozen=True, slots=True)
class Section:
    """`lines` are Markdown with the tables in place, `rows` the printed numbers in them,
    `beside` the same from other evidence, not counted, `files` SVG and CSV text by file name."""

    title: str
    lines: tuple[str, ...]
    rows: tuple[Row, ...] = ()
    beside: tuple[Row, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)

    def text(self) -> str:
        """The section as Markdown."""
        return "\n".join([f"## {self.title}", "", *self.lines, ""])


def meets(printed: str, low: float, high: float) -> bool:
    """Whether a printed number, within half a unit of its last digit, meets [low, high]."""
    half = half_digit(printed) * 1.000001
    return low - half <= float(printed) <= high + half


def half_digit(printed: str) -> float:
    """Half a unit of the last printed digit: 0.5e-2 for "1.64", 0.5e6 for "6.57e8"."""
    mantissa, _, exponent = printed.partition("e")
    decimals = len(mantissa.partition(".")[2])
    return float(0.5 * 10.0 ** (int(exponent or 0) - decimals))


def table(rows: Iterable[Row]) -> list[str]:
    """The rows as a Markdown table."""
    lines = ["| quantity | printed | ours | evidence |", "|---|---|---|---|"]
    for row in rows:
        printed = f"≤ {row.printed}" if row.limit else row.printed
        note = f"; {row.why}" if row.why else ""
        lines.append(f"| {row.quantity} | {printed} | {cell(row)}{note} | {row.kind} |")
    return lines


def grid(rows: Sequence[Row], columns: int, beside: Sequence[Row] = ()) -> list[str]:
    """A Markdown table with `columns` numbers a line: printed, ours, and below ours `beside`.

    Quantities are "line: column".
    """
    names = [row.quantity.rpartition(": ")[2] for row in rows[:columns]]
    head = [f"{whose} {name}" for whose in ("printed", "our") for name in names]
    lines = [f"| | {' | '.join(head)} |", "|---" * (1 + len(head)) + "|"]
    ours = [cell(row) for row in rows]
    if beside:
        ours = [f"{one}<br>*{cell(row)}*" for one, row in zip(ours, beside, strict=True)]
    for first in range(0, len(rows), columns):
        some = slice(first, first + columns)
        label = rows[first].quantity.rpartition(": ")[0]
        cells = [label, *(row.printed for row in rows[some]), *ours[some]]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def cell(row: Row) -> str:
    """Our number with the mark of its verdict, its span on a second line."""
    span = f"<br>{number(row.span[0])}…{number(row.span[1])}" if row.span else ""
    return f"{number(row.ours)} {row.verdict}{span}"


def number(value: float) -> str:
    """Three significant digits, exponents as the paper writes them: 6.57e8, 1.64, 727."""
    if 1e-2 <= abs(value) < 1e3:
        return f"{value:#.3g}".rstrip(".")
    mantissa, exponent = f"{value:.2e}".split("e")
    return f"{mantissa}e{int(exponent)}"
