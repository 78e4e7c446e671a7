"""The report's figures: arrays in, one SVG text out each. No state is kept between calls."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from stepload.identification.fit import FloatArray
from stepload.report.press_data import IntArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_POINTS, MOST_DOTS = 4000, 1500
INK, BLUE, ORANGE, GREEN, RED, GREY, SAND = (
    "#1d2733", "#1f5fa8", "#c8641b", "#2f7d4f", "#b3261e", "#8a94a0", "#d9a77f",
)  # fmt: skip
MOST_NAMES = 14
"""Largest number of curves that a legend names; more cannot be told apart by colour."""
Line = tuple[FloatArray, FloatArray, str, Mapping[str, Any]]
"""x and y (N,) each, marker or line, and further properties of one curve."""


def colour(index: int) -> str:
    """The colour of a curve by its place among others."""
    return (BLUE, ORANGE, GREEN, RED, INK, GREY)[index % 6]


@contextmanager
def figure_of(
    height: float, rows: int = 1, width: float = 8.6
) -> Iterator[tuple[Figure, list[Axes]]]:
    """A figure in the report's style, sizes in inches, and its axes from top to bottom."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    style: dict[Any, Any] = {
        "font.size": 9.5, "axes.edgecolor": GREY, "axes.labelcolor": INK, "text.color": INK,
        "xtick.color": INK, "ytick.color": INK, "axes.spines.top": False,
        "axes.spines.right": False, "axes.grid": True, "grid.color": "#e6eaee",
        "figure.facecolor": "none", "axes.facecolor": "none", "legend.frameon": False,
        "svg.hashsalt": "stepload", "lines.linewidth": 1.2,
    }  # fmt: skip
    with mpl.rc_context(style):
        figure = Figure(figsize=(width, height), layout="constrained")
        axes = figure.subplots(rows, 1, sharex=rows > 1, squeeze=False)
        yield figure, [row[0] for row in axes]


def _lay_out(figure: Figure) -> None:
    """Place the axes without drawing, which saving would do by drawing the whole figure once."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    engine = figure.get_layout_engine()
    if engine is None:
        return
    FigureCanvasSVG(figure)
    dpi, figure.dpi = figure.dpi, FigureCanvasSVG.fixed_dpi
    engine.execute(figure)
    figure.dpi = dpi
    figure.set_layout_engine(None)  # "none" would keep a placeholder, and saving draw twice


def svg_of(figure: Figure) -> str:
    """The figure as SVG text, the same for the same figure."""
    buffer = io.StringIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")  # a name in a script it cannot write
        _lay_out(figure)
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


def png_of(figure: Figure) -> bytes:
    """The figure as PNG on white."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100, facecolor="white")
    return buffer.getvalue()


def plain(text: str) -> str:
    """A name from a user's file as a label, without mathematics or hidden characters."""
    shown = "".join(c if c.isprintable() else "?" for c in text).replace("$", r"\$")
    return f" {shown}"  # a label that begins with an underscore is left out of a legend


def thin(count: int, value: FloatArray) -> IntArray:
    """Indices of at most about `count` points that keep every local extreme of `value` (N,)."""
    n = len(value)
    if n <= count:
        return np.arange(n)
    width = int(np.ceil(2.0 * n / count))
    whole = n // width * width
    blocks = value[:whole].reshape(-1, width)
    start = np.arange(len(blocks)) * width
    picked = np.concatenate(
        [start + np.nanargmin(blocks, 1), start + np.nanargmax(blocks, 1), [0, n - 1]]
    )
    return np.unique(picked)


def lines(
    curves: Sequence[Line],
    x: str,
    y: str,
    *,
    height: float = 3.0,
    zero: bool = False,
    legend: bool = True,
) -> str:
    """Curves in one plot with names for its axes; `zero` draws the line y = 0."""
    with figure_of(height) as (figure, (axes,)):
        for across, up, form, style in curves:
            axes.plot(across, up, form, **style)
        if zero:
            axes.axhline(0.0, color=INK, lw=0.8)
        axes.set(xlabel=x, ylabel=y)
        if legend and axes.get_legend_handles_labels()[1]:
            axes.legend(loc="best", markerscale=2, fontsize=8)
        return svg_of(figure)


def intervals(rows: Sequence[tuple[str, float, float, float]], x: str) -> str:
    """One row for each (name, value, low, high) in N/m, shown in N/µm."""
    with figure_of(1.2 + 0.45 * len(rows)) as (figure, (axes,)):
        for place, (_, value, low, high) in enumerate(rows):
            axes.plot([low * 1e-6, high * 1e-6], [place] * 2, color=BLUE, lw=2.5, alpha=0.5)
            axes.plot([value * 1e-6], [place], "o", ms=6, color=BLUE)
        axes.set_yticks(range(len(rows)), [plain(name) for name, *_ in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlabel(x)
        return svg_of(figure)
