"""The picture of a map: a panel for everything that is varied, the payloads drawn in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from stepload.design.map import BUY, PANELS, Map
from stepload.design.map_report import Reach, reaches, value_text
from stepload.report.figures import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    figure_of,
    plain,
)
from stepload.units import percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stepload.design.map import Row


TITLES = {
    "exponent": "exponent of the payload",
    "system stiffness": "system stiffness K_s",
    "sigma of K_s": "how well K_s is known",
    "position resolution": "position resolution",
    "gauge": "gauge across the contact",
    BUY: "what to buy",
}
LABEL_ROWS = 4
WHITE = 2.0
"""Half width, in those that are wanted, from which a cell is white."""


@contextmanager
def drawn(found: Map) -> Iterator[Figure]:
    """The picture, to be saved inside the block."""
    every = reaches(found)
    shown = [series for series in (*PANELS, BUY) if found.of(series)]
    counts = [sum(each.series == series for each in every) for series in shown]
    with figure_of(1.6 + 0.3 * sum(counts) + 0.32 * len(shown), len(shown)) as (figure, axes):
        for own, series in zip(axes, shown, strict=True):
            _panel(own, found.of(series), [e for e in every if e.series == series], TITLES[series])
        beyond = _payloads(axes, found)
        axes[-1].set_xlabel(
            f"secant stiffness of the payload at {found.rig.top_n:.4g} N [N/m]{beyond}"
        )
        figure.suptitle(
            f"{plain(found.rig.name)}: 95 % interval of the chord, "
            f"±{percent(1.0 / found.rig.conditions.t, 2)} wanted",
            fontsize=11,
        )
        _legend(figure)
        yield figure


def _panel(axes: Axes, rows: Sequence[Row], every: Sequence[Reach], title: str) -> None:
    columns = len(rows) // len(every)
    secants = np.array([row.point.secant_n_per_m for row in rows[:columns]])
    step = np.sqrt(secants[1] / secants[0])
    edges = np.append(secants / step, secants[-1] * step)
    most = 1.0 / rows[0].point.conditions.t
    halves = np.array([row.half_width for row in rows]).reshape(len(every), columns)
    axes.pcolormesh(
        edges, np.arange(len(every) + 1), np.nan_to_num(halves / most, nan=WHITE), cmap="Blues_r",
        vmin=-0.5, vmax=WHITE, rasterized=True,
    )  # fmt: skip
    for number, each in enumerate(every):
        axes.vlines(each.k_max_n_per_m, number, number + 1, color=INK, lw=2.2)
        axes.vlines(each.within_n_per_m * step, number, number + 1, color=ORANGE, lw=2.2)
        for secant, row in zip(secants, rows[number * columns :], strict=False):
            if row.measured:
                axes.plot(secant, number + 0.5, ".", color="white", ms=4)
    axes.set_yticks(np.arange(len(every)) + 0.5, [value_text(each) for each in every])
    axes.set(xscale="log", xlim=(edges[0], edges[-1]), ylim=(0, len(every)))
    axes.set_title(title, loc="left", fontsize=9.5)
    axes.grid(False)


def _payloads(axes: Sequence[Axes], found: Map) -> str:
    """A line for every payload at its stiffness at the map's force; others are listed in words."""
    low, high = axes[0].get_xlim()
    specimens = found.specimens
    inside = sorted({each.at_top_n_per_m for each in specimens if low < each.at_top_n_per_m < high})
    for number, at in enumerate(inside):
        here = [each for each in specimens if each.at_top_n_per_m == at]
        pressed = any(each.top_n >= found.rig.top_n for each in here)
        colour = GREEN if pressed else GREY
        for own in axes:
            own.axvline(at, color=colour, lw=1.0, ls="-" if pressed else ":")
        axes[0].annotate(
            plain(", ".join(each.name for each in here)), (at, 1.0), color=colour, fontsize=7.5,
            xycoords=("data", "axes fraction"), textcoords="offset points",
            xytext=(0, 16 + 10 * (number % LABEL_ROWS)), ha="center", annotation_clip=False,
        )  # fmt: skip
    softer = [each.name for each in specimens if 0.0 < each.at_top_n_per_m <= low]
    stiffer = [each.name for each in specimens if each.at_top_n_per_m >= high]
    told = [
        f"\n{where} than shown: {plain(', '.join(names)).strip()}"
        for where, names in (("softer", softer), ("stiffer", stiffer))
        if names
    ]
    return "".join(told)


def _legend(figure: Figure) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    marks = [
        Patch(color=BLUE, label="blue: the darker, the narrower the interval"),
        Line2D([], [], color=GREY, marker=".", ls="", label="dot: can be measured"),
        Line2D([], [], color=INK, lw=2.2, label="guideline (34)"),
        Line2D([], [], color=ORANGE, lw=2.2, label="interval within 1/t up to here"),
        Line2D([], [], color=GREEN, label="payload"),
        Line2D([], [], color=GREY, ls=":", label="payload that must not be pressed so hard"),
    ]
    figure.legend(handles=marks, loc="outside lower center", ncols=2, fontsize=8.5)
