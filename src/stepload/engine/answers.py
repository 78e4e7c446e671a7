"""Rule R6: the arm presses on, and the force does not answer.

Independent of the step controller's leash (`engine.anchor`), with its own means and filters.
"""

from __future__ import annotations

import math

from stepload.engine.watch import Breach, Found
from stepload.envelope.leash import ANSWER_SIGMAS
from stepload.envelope.limits import RunLimits
from stepload.record.rows import Phase

TAUT_SHARE = 0.45
"""Share of the leash beyond which R6 waits for an answer while the target stands."""
MOST_SHARE = 1.1
"""Share of the leash beyond which R6 waits for an answer while the target moves too."""
STANDS_SHARE = 0.1
"""Share of the leash: an arm moved by less than this since its last answer counts as standing."""
ANSWER_FILTER_S = 0.3
"""Time constant of the filter on the force in which R6 looks for an answer."""

_LOAD, _HOLD, _DWELL = int(Phase.LOAD), int(Phase.HOLD), int(Phase.DWELL)


def waits_from(moves: bool) -> float:
    """Share of the leash from which on R6 waits for an answer."""
    return MOST_SHARE if moves else TAUT_SHARE


class AnswerWatch:
    """Tracks the travel in a load step since the force last answered.

    Travel counts from the last answer but one, with force `answer_n` and target `answer_m`: the
    last may be noise. An answer counts only if the arm has moved on since the one before: at rest,
    noise would produce another sooner or later.
    """

    def __init__(self, limits: RunLimits, found: Found) -> None:
        self._found = found
        self._alpha = min(1.0, limits.period_s / ANSWER_FILTER_S)
        self._mean_n = self._mean_m = self._risen_n = self._risen_m = 0.0
        self.answer_n = self.answer_m = self._taut_s = 0.0
        self._dwelt, self._pressed = 0, False
        self.adopt(limits)

    def adopt(self, limits: RunLimits) -> None:
        """Judge by these thresholds from now on."""
        self._limits = limits
        share = min(1.0, 0.5 * limits.reading_s / ANSWER_FILTER_S)
        self.rise_n = ANSWER_SIGMAS * limits.noise_n * math.sqrt(share)

    def rest(self, target_m: float, smooth_n: float, phase: int) -> None:
        """Update in a tick outside a load step; the force of a hold and a dwell is averaged."""
        self._dwelt = self._dwelt + 1 if phase == _DWELL else 0
        weight = self._alpha if phase == _HOLD and self._pressed else 1.0
        weight /= max(1, self._dwelt)
        self._mean_n += weight * (smooth_n - self._mean_n)
        self.answer_n = self._risen_n = self._mean_n
        self.answer_m = self._risen_m = self._mean_m = target_m
        self._taut_s = 0.0
        self._pressed = phase in (_LOAD, _HOLD)

    def leash_n(self) -> float:
        """The force in N that travel over the whole leash would add on a rigid payload."""
        limits = self._limits
        room_n = limits.force_limit_n - self.answer_n - 6.0 * limits.noise_n
        return limits.leash_proved * room_n

    def load(self, target_m: float, smooth_n: float, speed_m_s: float) -> Breach | None:
        """Judge a tick of a load step."""
        limits = self._limits
        self._pressed = True
        self._mean_n = mean_n = self._mean_n + self._alpha * (smooth_n - self._mean_n)
        self._mean_m = mean_m = self._mean_m + self._alpha * (target_m - self._mean_m)
        leash_n = self.leash_n()
        gone_m = mean_m - self._risen_m
        least_n = limits.answer_at(self._risen_n) * gone_m
        if mean_n > self._risen_n + max(self.rise_n, least_n):
            last_n, self._risen_n = self._risen_n, mean_n
            if gone_m * limits.stiffness_n_per_m > STANDS_SHARE * leash_n:
                self.answer_n, self.answer_m = last_n, self._risen_m
                self._risen_m, self._taut_s = mean_m, 0.0
                return None
        travel_m = target_m - self.answer_m
        travel_n = travel_m * limits.stiffness_n_per_m
        from_n = waits_from(speed_m_s > 0.0) * leash_n
        if travel_n < from_n:
            return None
        self._taut_s += limits.period_s
        if self._taut_s <= limits.leash_time_s:
            return None
        return self._found(
            "R6", travel_m, from_n / limits.stiffness_n_per_m, "m",
            f"{travel_m * 1e6:.1f} um of travel and no answer in force",
        )  # fmt: skip
