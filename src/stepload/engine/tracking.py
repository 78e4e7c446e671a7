"""Does the arm follow its target? A command link may stall, and deliver at once what it held back.

The arm then catches up faster than was commanded. So the target does not lead an arm that stands
still by more than is allowed for such a step.
"""

from __future__ import annotations

LEAD_FILTER_S = 0.5
"""Time constant of how far the target leads the position of an arm that follows."""


class Lead:
    """How far the target leads the measured position: servo lag, lost motion, kinematic error.

    The lead is not updated while the arm does not follow.
    """

    def __init__(self, period_s: float) -> None:
        self._share = min(1.0, period_s / LEAD_FILTER_S)
        self._lead_m = 0.0

    def begin(self, lead_m: float) -> None:
        """Use this lead as that of an arm that follows."""
        self._lead_m = lead_m

    def excess(self, target_m: float, position_m: float, allowed_m: float) -> float:
        """By how much the target is more than `allowed_m` ahead; 0.0 while it is not."""
        ahead_m = target_m - position_m - self._lead_m
        if ahead_m > allowed_m:
            return ahead_m - allowed_m
        self._lead_m += self._share * ahead_m
        return 0.0
