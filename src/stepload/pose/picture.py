"""The picture of a search: K_zz over radius and height, with the best poses."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from stepload.pose.chain import reach_m
from stepload.pose.rig_search import Posture
from stepload.pose.search import STEP
from stepload.pose.tables import stiffest
from stepload.report.figures import INK, ORANGE, figure_of, plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@contextmanager
def drawn(found: Posture) -> Iterator[Figure]:
    """The picture, to be saved inside the block."""
    from matplotlib.colors import LogNorm

    radius, height, most = stiffest(found)
    with figure_of(6.4, width=7.2) as (figure, [axes]):
        size = 72.0 * 4.6 / max(np.ptp(radius), np.ptp(height), STEP * reach_m(found.arm))
        seen = axes.scatter(
            radius * 1e3, height * 1e3, c=most, marker="s", cmap="viridis",
            s=(0.9 * STEP * reach_m(found.arm) * size) ** 2, linewidths=0.0,
            norm=LogNorm(most.min(), max(most.max(), 1.01 * most.min())),
        )  # fmt: skip
        for each in found.best:
            at = np.hypot(each.tip_m[0], each.tip_m[1]) * 1e3, each.tip_m[2] * 1e3
            axes.plot(*at, "o", ms=13, mfc="white", mec=INK)
            axes.annotate(each.name, at, ha="center", va="center", fontsize=8.5, color=INK)
        for each in found.calibrated:
            at = np.hypot(each.tip_m[0], each.tip_m[1]) * 1e3, each.tip_m[2] * 1e3
            axes.plot(*at, "X", ms=10, color=ORANGE, mec=INK, label=plain(each.name))
        if found.calibrated:
            axes.legend(fontsize=8.5)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set(
            xlabel="contact from the base's axis [mm]", ylabel="contact above the base's foot [mm]"
        )
        axes.set_title(
            plain(f"{found.arm.name}: stiffest way to hold the arm at each place"), loc="left",
            fontsize=10,
        )  # fmt: skip
        figure.colorbar(seen, ax=axes, label="K_zz of the joints [N/m]")
        yield figure
