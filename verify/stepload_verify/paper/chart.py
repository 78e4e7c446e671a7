"""Line charts as SVG text, drawn in the style of the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

from stepload.report.figures import figure_of, svg_of
from stepload_verify.paper.step_load import FloatArray

COLOURS = ("#1b6ca8", "#c0392b", "#2e8b57", "#8e44ad", "#d68910", "#555555")
MANY = 9
"""More dots than these are drawn small."""
CROWD = 6
"""A legend of more entries stands beside the axes."""


@dataclass(frozen=True, slots=True)
class Line:
    """One curve; `dots` draws its points instead, `dashed` marks a limit; no label, no legend.
    Colours go round unless one is given."""

    label: str
    x: FloatArray
    y: FloatArray
    dots: bool = False
    dashed: bool = False
    colour: str | None = None


def chart(
    title: str, x_label: str, y_label: str, lines: Sequence[Line], *, log_log: bool = False
) -> str:
    """The chart as SVG text; axes from the data, logarithmic in both on `log_log`."""
    with figure_of(4.6) as (figure, (axes,)):
        for line, colour in zip(lines, cycle(COLOURS), strict=False):
            style = "o" if line.dots else "--" if line.dashed else "-"
            size = 2.0 if len(line.x) > MANY else 6.0
            axes.plot(
                line.x,
                line.y,
                style,
                color=line.colour or colour,
                ms=size,
                label=line.label or None,
            )
        axes.set(title=title, xlabel=x_label, ylabel=y_label)
        if log_log:
            axes.set(xscale="log", yscale="log")
        if sum(bool(line.label) for line in lines) > CROWD:
            figure.legend(loc="outside right upper")
        else:
            axes.legend(loc="best")
        return svg_of(figure)
