"""The picture of a design: time against the half width that is reported."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from stepload.design.answers import Can
from stepload.design.front import Tried
from stepload.design.grid import SHARES
from stepload.design.make import Design
from stepload.errors import BadInputError
from stepload.plan.room_to_write import check_new
from stepload.results.figures import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    SAND,
    figure_of,
    plain,
    png_of,
    svg_of,
)
from stepload.units import format_quantity

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KINDS = (".svg", ".png")
COLOURS = (SAND, ORANGE, GREEN, BLUE)
"""Colours of the top forces, the largest last."""


def check_picture(path: Path) -> None:
    """Check that a picture is an SVG or a PNG file that does not exist yet.

    Raises:
        BadInputError: it is not, or it exists.
    """
    if path.suffix.lower() not in KINDS:
        raise BadInputError(f"--picture {path}: no kind of picture", hint="name it .svg or .png")
    check_new("--picture", path)


def write_picture(found: Design, path: Path) -> None:
    """Draw a design into a new file."""
    with _drawn(found) as figure:
        drawn = svg_of(figure).encode() if path.suffix.lower() == ".svg" else png_of(figure)
    with path.open("xb") as file:
        file.write(drawn)


@contextmanager
def _drawn(found: Design) -> Iterator[Figure]:
    shown = [each for each in found.tried if math.isfinite(each.half_width)]
    with figure_of(4.6) as (figure, [axes]):
        for share, colour in zip(SHARES, COLOURS, strict=True):
            own = [each for each in shown if each.candidate.share == share]
            if own:
                top = format_quantity(max(each.candidate.top_n for each in own), "N")
                good = [each for each in own if each.can is not Can.NO]
                bad = [each for each in own if each.can is Can.NO]
                axes.plot(*_points(good), "o", ms=5, color=colour, label=f"up to {top}")
                axes.plot(*_points(bad), "o", ms=5, mfc="none", color=colour)
        axes.plot(*_points(found.curve), "-", color=INK, lw=1.0, label="the best, judged again")
        axes.plot(*_points([found.chosen]), "s", ms=11, mfc="none", color=INK, label="chosen")
        axes.axvline(found.within_s, color=GREY, ls=":", label="time that was given")
        axes.set(xlabel="time of the run [s]", ylabel="half width of the interval [%]")
        axes.set_ylim(bottom=0.0)
        limit = found.ceiling
        axes.set_title(
            plain(f"{limit.payload} on {limit.rig} (open: IDENTIFIED in less than 90 %)"),
            loc="left", fontsize=10,
        )  # fmt: skip
        axes.legend(fontsize=8.5)
        yield figure


def _points(tried: Sequence[Tried]) -> tuple[list[float], list[float]]:
    return [each.duration_s for each in tried], [100.0 * each.half_width for each in tried]
