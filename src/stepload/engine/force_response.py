"""Rule R6: the arm presses on, and the force does not respond as the softest payload would.

Independent of the step controller's travel limit (`engine.travel_limit`), with its own filters.
"""

from __future__ import annotations

import math
from collections import deque

from stepload.engine.watch import Found, Trip
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.press import ANSWER_FILTER_S, least_rise_n
from stepload.record.rows import Phase

WAITS_SHARE = 0.9
"""Share of the travel limit from which on R6 counts its time."""
STANDS_SHARE = 0.1
"""Share of the travel limit: a target moved by less since the last answer counts as standing."""

_LOAD, _HOLD, _DWELL = int(Phase.LOAD), int(Phase.HOLD), int(Phase.DWELL)


class ForceResponseWatch:
    """Tracks the travel in a load step since the force last responded.

    `travel_m` counts from the last answer but one, with force `answer_n`: the last may be noise.
    An answer counts only if the target has moved on since the one before. Targets are those of
    `reaction_s` ago, to which the force must have responded by now.
    """

    def __init__(self, limits: RunLimits, found: Found) -> None:
        self._found = found
        self._alpha = min(1.0, limits.period_s / ANSWER_FILTER_S)
        ticks = 1 + math.ceil(limits.reaction_s / limits.period_s)
        self._targets_m = deque([math.nan] * ticks, ticks)
        self._mean_n = self._mean_m = self._risen_n = self._risen_m = 0.0
        self.answer_n = self._answer_m = self._taut_s = 0.0
        self._dwelt, self._pressed = 0, False
        self.adopt(limits)

    def adopt(self, limits: RunLimits) -> None:
        """Judge by these thresholds from now on."""
        self._limits = limits
        self.rise_n = least_rise_n(limits.noise_n, limits.reading_s)

    @property
    def travel_m(self) -> float:
        """Travel in m since the answer before the last one."""
        return self._mean_m - self._answer_m

    def limit_m(self) -> float:
        """The travel in m from which on R6 counts its time."""
        limits = self._limits
        share = WAITS_SHARE if limits.travel_limit_time_s else 1.0
        return share * limits.travel_m(self.answer_n)

    def rest(self, target_m: float, smooth_n: float, phase: int) -> None:
        """Update in a tick outside a load step; the force of a hold and a dwell is averaged."""
        targets_m = self._targets_m
        then_m = targets_m[0]
        targets_m.append(target_m)
        if then_m != then_m:
            then_m = target_m
        weight = self._alpha if phase == _HOLD and self._pressed else 1.0
        if phase == _DWELL:
            self._dwelt += 1
            weight /= self._dwelt
        else:
            self._dwelt = 0
        mean_n = self._mean_n
        self._mean_n = self.answer_n = self._risen_n = mean_n + weight * (smooth_n - mean_n)
        self._answer_m = self._risen_m = self._mean_m = then_m
        self._taut_s = 0.0
        self._pressed = phase in (_LOAD, _HOLD)

    def load(self, target_m: float, smooth_n: float) -> Trip | None:
        """Judge a tick of a load step."""
        limits = self._limits
        targets_m = self._targets_m
        then_m = targets_m[0]
        targets_m.append(target_m)
        if then_m != then_m:
            then_m = target_m
        self._pressed = True
        self._mean_n = mean_n = self._mean_n + self._alpha * (smooth_n - self._mean_n)
        self._mean_m = mean_m = self._mean_m + self._alpha * (then_m - self._mean_m)
        gone_m = mean_m - self._risen_m
        least_n = limits.answer_at(self._risen_n) * gone_m
        if mean_n > self._risen_n + max(self.rise_n, least_n):
            last_n, self._risen_n = self._risen_n, mean_n
            if gone_m > STANDS_SHARE * limits.travel_m(self.answer_n):
                self.answer_n, self._answer_m = last_n, self._risen_m
                self._risen_m, self._taut_s = mean_m, 0.0
                return None
        travel_m, limit_m = mean_m - self._answer_m, self.limit_m()
        if travel_m <= limit_m:
            return None
        self._taut_s += limits.period_s
        if self._taut_s <= limits.travel_limit_time_s:
            return None
        return self._found(
            "R6", travel_m, limit_m, "m",
            f"{travel_m * 1e6:.1f} um of travel without the rise in force that the softest payload"
            " stated would give",
        )  # fmt: skip
