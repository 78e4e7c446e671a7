"""The figure of how a contact was made: lateral share over the force, and slip events."""

from __future__ import annotations

from functools import partial

from stepload.estimators.contact_quality import ContactQuality
from stepload.results.figures import BLUE, GREEN, INK, ORANGE, RED, SAND, figure_of, svg_of
from stepload.results.model import Figure

COLOURS = {(True, 0): BLUE, (True, 1): GREEN, (False, 0): ORANGE, (False, 1): SAND}
MOST_CYCLES = 2


def share_over_force(found: ContactQuality) -> str:
    """Both components of the share in the first two cycles; slips as marks at the bottom."""
    with figure_of(3.0) as (figure, (axes,)):
        cycles = sorted({branch.cycle for branch in found.branches})[:MOST_CYCLES]
        for branch in found.branches:
            if branch.cycle not in cycles:
                continue
            first = branch.cycle == cycles[0]
            way = "loading" if branch.rising else "unloading"
            for axis, name in enumerate(("first", "second")):
                axes.errorbar(
                    branch.force_n, 100.0 * branch.share[:, axis], 200.0 * branch.sigma,
                    color=COLOURS[branch.rising, axis], ls="-" if first else ":", marker="o",
                    ms=3.0 if first else 2.0, lw=1.2,
                    label=f"{way}, {name} axis across" if first else None,
                )  # fmt: skip
        axes.axhline(0.0, color=INK, lw=0.8)
        bottom = axes.get_ylim()[0]
        for rising, mark, way in ((True, "^", "loading"), (False, "v", "unloading")):
            at_n = [slip.force_n for slip in found.slips if slip.rising == rising]
            if at_n:
                axes.plot(at_n, [bottom] * len(at_n), mark, color=RED, ms=7, clip_on=False,
                          label=f"slip while {way}")  # fmt: skip
        axes.set(xlabel="force along the axis [N]", ylabel="force across [% of it]")
        axes.legend(loc="best", fontsize=8)
        return svg_of(figure)


def quality_figure(found: ContactQuality) -> Figure:
    """The figure with its caption."""
    return Figure(
        "contact", "Lateral force",
        "Force along the sensor's two axes across, as a share of that along the pressing axis, with"
        " twice the standard uncertainty by noise; dotted: the second cycle. Loading and unloading"
        " that differ are sliding friction.",
        "share of the lateral force over the force",
        partial(share_over_force, found),
    )  # fmt: skip
