"""Pareto front of plans: those with no faster plan of a narrower interval."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from stepload.design.answers import Can, can
from stepload.design.grid import Candidate
from stepload.design.work import Row

ALIKE = 1.02
"""Intervals that differ by less than this factor count as equal: the faster plan is preferred."""
LAYERS = 2
"""Number of fronts that are judged again, since a plan may look better than it is by chance."""


@dataclass(frozen=True, slots=True)
class Tried:
    """A plan and the result of its simulated runs."""

    candidate: Candidate
    row: Row

    @property
    def can(self) -> Can:
        """Whether the plan is rightly IDENTIFIED often enough."""
        return can(self.row.measured)

    @property
    def half_width(self) -> float:
        """Median half width of the interval, as a share; infinite where it has none."""
        return math.inf if math.isnan(self.row.half_width) else self.row.half_width

    @property
    def width(self) -> str:
        """The half width in words."""
        half = self.half_width
        return f"±{half:.1%}" if math.isfinite(half) else "wider than the figure"

    @property
    def text(self) -> str:
        """The result in a few words."""
        share = self.row.measured
        return (
            f"rightly IDENTIFIED in {share.value:.0%} of the runs ({share.low:.0%} to "
            f"{share.high:.0%}), interval {self.width}"
        )

    @property
    def duration_s(self) -> float:
        """Duration of the plan."""
        return self.candidate.duration_s


def front(tried: Sequence[Tried]) -> list[Tried]:
    """Plans whose interval is narrower than that of every faster one, the fastest first."""
    found: list[Tried] = []
    for each in sorted(tried, key=lambda one: (round(one.duration_s), one.half_width)):
        if math.isfinite(each.half_width) and (not found or each.half_width < found[-1].half_width):
            found.append(each)
    return found


def finalists(tried: Sequence[Tried]) -> list[Tried]:
    """The first `LAYERS` fronts of the plans that may be good enough."""
    left = [each for each in tried if each.can is not Can.NO]
    found: list[Tried] = []
    for _ in range(LAYERS):
        best = front(left)
        found += best
        left = [each for each in left if not any(each is one for one in best)]
    return found


def choose(tried: Sequence[Tried], within_s: float) -> Tried | None:
    """The plan with the narrowest interval among those shown to be good enough and fast enough.

    Of nearly equal intervals, that of the fastest plan. None where no plan is shown to be good
    enough in that time.
    """
    good = [each for each in tried if each.can is Can.YES and each.duration_s <= within_s]
    narrowest = min((each.half_width for each in good), default=math.inf)
    alike = [each for each in good if each.half_width <= ALIKE * narrowest]
    return min(alike, key=lambda each: each.duration_s, default=None)
