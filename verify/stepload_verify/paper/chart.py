"""Line charts as SVG text, drawn in the style of the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

from stepload.results.figures import figure_of, svg_of
from stepload_verify.paper.step_load import FloatArray

COLOURS = ("#1b6ca8", "#c0392b", "#2e8b57", "#8e44ad", "#d68910", "#555555")
MANY = 9
"""More dots than these are drawn small."""


@dataclass(frozen=True, slots=True)
class Line:
    """One curve; `dots` draws its points instead, `dashed` marks a limit; no label, no legend."""

    label: str
    x: FloatArray
    y: FloatArray
    dots: bool = False
    dashed: bool = False


def chart(
    title: str, x_label: str, y_label: str, lines: Sequence[Line], *, log_log: bool = False
) -> str:
    """The chart as SVG text; axes from the data, logarithmic in both on `log_log`."""
    with figure_of(4.6) as (figure, (axes,)):
        for line, colour in zip(lines, cycle(COLOURS), strict=False):
            style = "o" if line.dots else "--" if line.dashed else "-"
            size = 2.0 if len(line.x) > MANY else 6.0
            axes.plot(line.x, line.y, style, color=colour, ms=size, label=line.label or None)
        axes.set(title=title, xlabel=x_label, ylabel=y_label)
        if log_log:
            axes.set(xscale="log", yscale="log")
        axes.legend(loc="best")
        return svg_of(figure)
