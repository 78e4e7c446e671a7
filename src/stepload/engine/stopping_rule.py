"""Whether the first loading has gone far enough, or cannot become far enough.

Judged once per level, after its hold, by the deformation alone; neither the apparent stiffness nor
the quality of a fit is used. The errors that matter most are the same for all levels (the system
stiffness, the smooth error of the travel), so a run that ends early is no more often wrong than one
that does not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from stepload.feasibility.until import Need, Until
from stepload.identification.chord import REFERENCE_SHARE

SURE = 2.0
"""Standard uncertainties added to a deformation before it is judged too small for good."""


class Verdict(StrEnum):
    """Verdict after a level; values are stable, they are written to records."""

    MORE = "more"
    ENOUGH = "enough"
    UNREACHABLE = "unreachable"


class Held(NamedTuple):
    """Mean force and position of a hold, or of a touch."""

    force_n: float
    position_m: float


class Reach(NamedTuple):
    """A level that is still to come, and the largest deformation possible there."""

    need: Need
    most_m: float

    @property
    def share(self) -> float:
        """That deformation as a share of the least with which the level can be enough."""
        return self.most_m / self.need.least_m

    @property
    def text(self) -> str:
        """The end of a sentence that says why that deformation is too little."""
        level_n, least_m = self.need.level_n, self.need.least_m
        if math.isinf(least_m):
            return (
                "and at no level that is left any deformation is known so well (preflight: none "
                "is enough)"
            )
        return (
            f"so at {level_n:g} N by {self.most_m * 1e6:.3g} µm at the most, and the known errors "
            f"alone need {least_m * 1e6:.3g} µm there (preflight asks for more than that, as room "
            "for what the contact does of its own)"
        )


def nearest(needs: Sequence[Need], index: int, deformation_m: float) -> Reach | None:
    """The remaining level that comes nearest to its needed deformation; None after the last.

    A contact that is loaded for the first time is never softer at a higher force: its deformation
    grows at most in proportion to the force.

    Args:
        needs: of every level.
        index: of the level that was held.
        deformation_m: of the payload, from 10 % of that level to the level.
    """
    here = needs[index]
    most_m = deformation_m + SURE * here.sigma_m
    left = (Reach(later, most_m * later.level_n / here.level_n) for later in needs[index + 1 :])
    return max(left, key=lambda reach: reach.share, default=None)


def judge(needs: Sequence[Need], index: int, deformation_m: float) -> Verdict:
    """The verdict on the deformation at a level; arguments as for `nearest`."""
    if needs[index].is_enough(index, deformation_m):
        return Verdict.ENOUGH
    reach = nearest(needs, index, deformation_m)
    return Verdict.UNREACHABLE if reach is not None and reach.share < 1.0 else Verdict.MORE


class StoppingRule:
    """The first loading, as measured at its touches and its holds.

    Args:
        until: what every level needs.
    """

    def __init__(self, until: Until) -> None:
        self.until = until
        self._points: list[Held] = []

    def touched(self, force_n: float, position_m: float) -> None:
        """Add a touch: the loading begins, or resumes after the contact was opened."""
        self._points.append(Held(force_n, position_m))

    def held(self, force_n: float, position_m: float) -> float:
        """Add a hold; the payload's deformation in m from 10 % of its force to its force."""
        self._points.append(Held(force_n, position_m))
        forces, positions = (np.array(column) for column in zip(*self._points, strict=True))
        order = np.argsort(forces, kind="stable")
        deformation_m = positions - self.until.conditions.bend(forces)
        low_m = np.interp(REFERENCE_SHARE * force_n, forces[order], deformation_m[order])
        return float(deformation_m[-1] - low_m)
