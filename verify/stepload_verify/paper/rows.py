"""A printed number next to ours, and what their nearness shows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
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
    """Of a printed number beside ours."""

    AGREES = "agrees"
    NEAR = "near"
    WIDE = "shows nothing"
    DIFFERS = "**differs**"


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
    def deviation(self) -> float:
        """Relative deviation of ours from printed."""
        return self.ours / float(self.printed) - 1.0

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
    lines = ["| quantity | printed | ours | deviation | verdict | evidence |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    for row in rows:
        ours = number(row.ours)
        if row.span:
            ours += f" ({number(row.span[0])} to {number(row.span[1])})"
        note = f"{row.verdict}; {row.why}" if row.why else row.verdict
        printed = f"≤ {row.printed}" if row.limit else row.printed
        lines.append(f"| {row.quantity} | {printed} | {ours} | {off(row)} | {note} | {row.kind} |")
    return lines


def off(row: Row) -> str:
    """Deviation in %, as a factor where it is large; of a limit there is none."""
    if row.limit:
        return ""
    ratio = 1.0 + row.deviation
    return f"× {ratio:.2g}" if not 0.5 < ratio < 2.0 else f"{100 * row.deviation:+.1f} %"


def number(value: float) -> str:
    """Three significant digits, exponents as the paper writes them: 6.57e8, 1.64, 727."""
    if 1e-2 <= abs(value) < 1e3:
        return f"{value:#.3g}".rstrip(".")
    mantissa, exponent = f"{value:.2e}".split("e")
    return f"{mantissa}e{int(exponent)}"
