"""A plot as text: points as dots of braille letters, two across and four down in each."""

from __future__ import annotations

import math
from collections.abc import Sequence

_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
_FIRST = 0x2800


def plot(
    points: Sequence[tuple[float, float]],
    columns: int,
    lines: int,
    title: str,
    *,
    x_range: tuple[float, float] | None = None,
    y_range: tuple[float, float] | None = None,
    levels: Sequence[tuple[float, str]] = (),
) -> str:
    """Points (x, y) in a frame of so many columns and lines of text, title and labels included.

    Args:
        x_range, y_range: what the frame spans; that of the points when None.
        levels: values of y that are drawn as lines across, with their names.
    """
    left, right = x_range or _span([x for x, _ in points])
    low, high = y_range or _span([y for _, y in points])
    labels = [f"{high:.4g}", f"{low:.4g}"]
    margin = max(map(len, (*labels, *(name for _, name in levels)))) + 1
    wide, tall = columns - margin, lines - 2
    if wide < 2 or tall < 2:
        return title[:columns]
    cells = [[0] * wide for _ in range(tall)]

    def dot(x: float, y: float) -> tuple[int, int] | None:
        if not (left <= x <= right and low <= y <= high):
            return None
        across = round((x - left) / (right - left) * (2 * wide - 1))
        down = round((high - y) / (high - low) * (4 * tall - 1))
        return across, down

    margins = [""] * tall
    for y, name in levels:
        if place := dot(left, y):
            margins[place[1] // 4] = name
            for across in range(0, 2 * wide, 2):
                _set(cells, across, place[1])
    for x, y in points:
        if place := dot(x, y):
            _set(cells, *place)
    margins[0] = margins[0] or labels[0]
    margins[-1] = margins[-1] or labels[1]
    rows = [
        f"{name:>{margin - 1}} " + "".join(chr(_FIRST + cell) for cell in row)
        for name, row in zip(margins, cells, strict=True)
    ]
    ends = f"{left:.4g}", f"{right:.4g}"
    foot = " " * margin + ends[0] + ends[1].rjust(max(wide - len(ends[0]), len(ends[1]) + 1))
    return "\n".join(line[:columns] for line in (title, *rows, foot))


def _set(cells: list[list[int]], across: int, down: int) -> None:
    cells[down // 4][across // 2] |= _DOTS[down % 4][across % 2]


def _span(values: Sequence[float]) -> tuple[float, float]:
    """Smallest and largest value, never the same; 0 and 1 for none."""
    finite = [value for value in values if math.isfinite(value)]
    if not finite:
        return 0.0, 1.0
    low, high = min(finite), max(finite)
    return (low, high) if high > low else (low - 0.5, high + 0.5)
