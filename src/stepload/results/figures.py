"""The report's figures: arrays in, one SVG text out each. No state is kept between calls."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.record.rows import Phase
from stepload.results.press_data import IntArray, PressData

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_POINTS, MOST_DOTS = 4000, 1500
INK, BLUE, ORANGE, GREEN, RED, GREY, SAND = (
    "#1d2733", "#1f5fa8", "#c8641b", "#2f7d4f", "#b3261e", "#8a94a0", "#d9a77f",
)  # fmt: skip
PHASE_TINT = {
    Phase.FREE_AIR: "#e8edf3",
    Phase.TARE: "#e8edf3",
    Phase.ALIGN: "#f3ecdc",
    Phase.NULLING: "#d2e0ee",
    Phase.FAST_APPROACH: "#e4efe8",
    Phase.GUARDED_APPROACH: "#d3e8da",
    Phase.DWELL: "#d3e8da",
    Phase.TOUCH_RETRACT: "#f3ecdc",
    Phase.LOAD: "#dbe6f4",
    Phase.HOLD: "#c6d8ee",
    Phase.UNLOAD: "#f7e3d6",
    Phase.UNLOAD_HOLD: "#f1d3be",
    Phase.RETRACT: "#e4efe8",
    Phase.POST_TARE: "#e8edf3",
    Phase.SAFING: "#f6d0cd",
}


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


def _spans(data: PressData) -> Iterator[tuple[Phase, float, float]]:
    edges = np.flatnonzero(np.diff(data.phase)) + 1
    bounds = np.concatenate([[0], edges, [len(data.phase) - 1]])
    for first, last in pairwise(bounds):
        yield Phase(int(data.phase[first])), float(data.time_s[first]), float(data.time_s[last])


def _shade(axes: Axes, data: PressData) -> None:
    named = set()
    for phase, start_s, end_s in _spans(data):
        if tint := PHASE_TINT.get(phase):
            label = None if phase in named else phase.name.replace("_", " ").lower()
            named.add(phase)
            axes.axvspan(start_s, end_s, color=tint, lw=0, label=label)


def over_time(data: PressData) -> str:
    """Force and travel against time, phases shaded."""
    with figure_of(5.2, rows=2) as (figure, (upper, lower)):
        for axes, value, scale, label, colour in (
            (upper, data.force_n, 1.0, "force [N]", BLUE),
            (lower, data.travel_m, 1e6, "displacement [µm]", ORANGE),
        ):
            index = thin(MOST_POINTS, value)
            _shade(axes, data)
            axes.plot(data.time_s[index], value[index] * scale, color=colour)
            axes.set_ylabel(label)
            axes.margins(x=0)
        seen = np.isin(data.phase, [Phase.TOUCH_RETRACT, Phase.LOAD, Phase.HOLD, Phase.UNLOAD])
        if np.any(seen):
            reach = data.travel_m[seen] * 1e6
            pad = 0.08 * (np.ptp(reach) or 1.0)
            lower.set_ylim(max(reach.min(), -0.5 * reach.max()) - pad, reach.max() + pad)
        lower.set_xlabel("time since start [s]")
        figure.legend(*upper.get_legend_handles_labels(), loc="outside upper center", ncols=6)
        return svg_of(figure)


def against_limit(data: PressData, predicted_peak_n: FloatArray, tick_s: FloatArray,
                  limits_n: Mapping[str, float]) -> str:  # fmt: skip
    """Force and the supervisor's predicted peak against every limit; F_c on top."""
    with figure_of(3.4) as (figure, (axes,)):
        index = thin(MOST_POINTS, predicted_peak_n)
        axes.plot(
            tick_s[index], predicted_peak_n[index], color=GREY, lw=0.8, label="predicted peak (R2)"
        )
        index = thin(MOST_POINTS, data.force_n)
        axes.plot(data.time_s[index], data.force_n[index], color=BLUE, label="measured force")
        colours = {"F_c": RED, "F_c used": ORANGE, "F_lim": GREEN}
        for name, limit_n in limits_n.items():
            colour = colours.get(name, INK)
            axes.axhline(limit_n, color=colour, ls="--", lw=1.1)
            axes.annotate(
                f"{name} {limit_n:.4g} N", (1.0, limit_n), xycoords=("axes fraction", "data"),
                ha="right", va="bottom", color=colour, fontsize=9,
            )  # fmt: skip
        axes.set_ylim(top=1.12 * max([*limits_n.values(), float(np.nanmax(data.force_n))]))
        axes.margins(x=0)
        axes.set(xlabel="time since start [s]", ylabel="force [N]")
        axes.legend(loc="upper left")
        return svg_of(figure)


Law = Callable[[FloatArray], FloatArray]


def force_deformation(
    loading: tuple[FloatArray, FloatArray],
    unloading: tuple[FloatArray, FloatArray],
    laws: Mapping[str, Law],
    believed: str,
    band: tuple[FloatArray, FloatArray, FloatArray] | None,
    predicted: Sequence[tuple[str, FloatArray, FloatArray]],
) -> str:
    """Measured force against payload deformation with every fitted law and the predicted one.

    Args:
        loading, unloading: (deformation, force) as measured, SI, (N,) each; the second may be
            empty.
        laws: every fitted law, deformation → force; `believed` is the name of one of them, or "".
        band: (deformation, lowest, highest force) of the believed law at 95 %, None without one.
        predicted: (label, deformation, force) of each law that theory predicts.
    """
    with figure_of(3.2, width=5.4) as (figure, (axes,)):
        for (x, y), colour, name in (
            (unloading, SAND, "measured, unloading"),
            (loading, GREY, "measured, loading"),
        ):
            if x.size:
                step = max(1, len(y) // MOST_DOTS)
                axes.plot(x[::step] * 1e6, y[::step], ".", ms=2.0, color=colour, label=name)
        if band is not None:
            x, low, high = band
            axes.fill_between(x * 1e6, low, high, color=BLUE, alpha=0.18, lw=0, label="95 % band")
        x, y = loading
        reach = np.linspace(float(x.min()), float(x.max()), 400)
        others = iter((ORANGE, GREEN, RED, INK))
        for name, law in laws.items():
            best = name == believed
            axes.plot(
                reach * 1e6, law(reach), color=BLUE if best else next(others, GREY),
                lw=2.0 if best else 1.1, ls="-" if best else "--", zorder=3 if best else 2,
                label=f"{name} (believed)" if best else name,
            )  # fmt: skip
        for label, predicted_m, predicted_n in predicted:
            axes.plot(predicted_m * 1e6, predicted_n, ":", lw=1.6, color=INK, label=label)
        axes.set(xlabel="payload deformation from touch [µm]", ylabel="force [N]")
        _frame(axes, loading, unloading)
        axes.legend(loc="upper left", markerscale=4, fontsize=8)
        return svg_of(figure)


def _frame(
    axes: Axes,
    loading: tuple[FloatArray, FloatArray],
    unloading: tuple[FloatArray, FloatArray],
) -> None:
    """Limits by what was measured: no band and no law hides it."""
    x, y = (np.concatenate(pair) for pair in zip(loading, unloading, strict=True))
    right, top = float(loading[0].max()), float(y.max())
    left = max(float(x.min()), -0.15 * abs(right))
    pad = 0.04 * ((right - left) or 1e-9)
    axes.set_xlim((left - pad) * 1e6, (max(right, float(x.max())) + pad) * 1e6)
    axes.set_ylim(min(0.0, float(y.min())), 1.1 * top if top > 0.0 else 1.0)


def residuals(force_n: FloatArray, residual_n: Mapping[str, FloatArray], believed: str) -> str:
    """Measured force minus each fitted law, against force."""
    with figure_of(3.0) as (figure, (axes,)):
        step = max(1, len(force_n) // MOST_DOTS)
        for (name, values), colour in zip(
            residual_n.items(), (ORANGE, GREEN, BLUE, RED), strict=False
        ):
            best = name == believed
            axes.plot(
                force_n[::step], values[::step], ".", ms=2.2 if best else 1.6,
                color=BLUE if best else colour, label=name, zorder=3 if best else 2,
            )  # fmt: skip
        axes.axhline(0.0, color=INK, lw=0.8)
        axes.set(xlabel="force [N]", ylabel="measured − law [N]")
        axes.legend(loc="best", markerscale=4)
        return svg_of(figure)


def misfit(force_n: FloatArray, misfit_m: FloatArray) -> str:
    """Misfit of the line (26) in m over force, (N,) each."""
    with figure_of(3.0) as (figure, (axes,)):
        axes.plot(force_n, misfit_m * 1e6, ".", ms=4, color=BLUE)
        axes.axhline(0.0, color=INK, lw=0.8)
        axes.set(xlabel="force [N]", ylabel="travel − line [µm]")
        return svg_of(figure)
