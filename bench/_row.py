"""A row of the table of speeds: what was measured, against what, and whether it became worse."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from statistics import median
from typing import Any


@dataclass(frozen=True)
class Row:
    """One figure.

    Attributes:
        name: what it is of.
        unit: of the figure; "×" for a ratio.
        values: one for each repeat.
        goal: what it should be at least, or at most where `smaller`; None: nothing is asked for.
        smaller: whether less is better.
        against: what stands beside it, in words.
        beside: its values, in the same unit; none where the figure is a ratio already.
    """

    name: str
    unit: str
    values: Sequence[float]
    goal: float | None = None
    smaller: bool = False
    against: str = ""
    beside: Sequence[float] = field(default=())

    @property
    def spread(self) -> float:
        """Between the largest and the smallest repeat."""
        return max(self.values) - min(self.values)

    @property
    def met(self) -> bool:
        """Whether the median is as good as the goal, which holds where there is none."""
        if self.goal is None:
            return True
        middle = median(self.values)
        return middle <= self.goal if self.smaller else middle >= self.goal


def row_of(kept: dict[str, Any]) -> Row:
    """A row as it stands in table.json."""
    return Row(**kept)


def as_json(row: Row) -> dict[str, Any]:
    """A row for table.json, four digits of each value."""
    rounded = {
        name: [float(f"{v:.4g}") for v in getattr(row, name)] for name in ("values", "beside")
    }
    return {**asdict(row), **rounded}


def became_worse(now: Row, kept: Row) -> float:
    """By how much of the kept median a figure is worse now; 0 where the spread of either explains
    it, or where it is better."""
    loss = median(now.values) - median(kept.values)
    loss = loss if now.smaller else -loss
    if not math.isfinite(loss) or loss <= max(now.spread, kept.spread):
        return 0.0
    return loss / median(kept.values)


HEAD = ("figure", "median", "smallest to largest", "goal", "beside it", "since the kept table")


def cells(row: Row, kept: Row | None, *, comparable: bool) -> tuple[str, ...]:
    """A row in words, in the order of `HEAD`."""
    goal = ""
    if row.goal is not None:
        sign = "at most" if row.smaller else "at least"
        goal = f"{sign} {row.goal:.3g}{'' if row.met else ' — MISSED'}"
    beside = row.against
    if row.beside:
        beside += f": {median(row.beside):.3g}"
    since = ""
    if kept is None:
        since = "new"
    elif comparable:
        loss = became_worse(row, kept)
        since = f"WORSE by {loss:.0%}" if loss else f"was {median(kept.values):.3g}"
    low, high = min(row.values), max(row.values)
    found = f"{median(row.values):.3g} {row.unit}".strip()
    return row.name, found, f"{low:.3g} to {high:.3g}", goal, beside, since


def markdown(lines: Sequence[Sequence[str]]) -> str:
    """Head and rows as a table of a page."""
    ruled = [lines[0], ["---"] * len(lines[0]), *lines[1:]]
    return "\n".join("| " + " | ".join(line) + " |" for line in ruled)


def plain(lines: Sequence[Sequence[str]]) -> str:
    """The same for a terminal, in columns."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )
