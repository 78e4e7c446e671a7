"""Whether the arm goes where its commands put it: rules R7 and R8, judged from positions alone."""

from __future__ import annotations

import math
from collections import deque

from stepload.engine.watch import Found, Trip
from stepload.feasibility.limits import RunLimits
from stepload.record.rows import Phase

SPEED_MEMORY_S = 0.15
"""How long a past speed excuses a position error or a force jump."""
LEAST_PROGRESS_M = 5e-6
PROGRESS_S = 1.5
PROGRESS_SHARE = 0.25
"""An approach at this share of the guarded speed still counts as progress; touches use half."""
REST_S = 0.1
"""Time in s for which a target must rest before the arm counts as at rest."""
STILL_SHARE = 0.25
"""Share of its commanded travel that an arm must be seen to move; less counts as standing."""
SEARCHING = (int(Phase.FAST_APPROACH), int(Phase.GUARDED_APPROACH))


class MotionWatch:
    """Compares the measured positions with a model of the arm that follows the targets.

    `target_m` is the target of the last tick and `model_m` the position that the model predicts,
    both NaN before the first command. `speed_m_s` is the speed of the target, `recent_m_s` its
    largest magnitude of late, which decays, and `steps` the number of periods since the last tick.

    Args:
        limits: the thresholds; `adopt` replaces them.
        found: makes the `Trip` of a rule; see `stepload.engine.watch`.
    """

    def __init__(self, limits: RunLimits, found: Found) -> None:
        self._limits = limits
        self._found = found
        period_s = limits.period_s
        self._model_alpha = period_s / (limits.arm_lag_s + period_s)
        self._delayed: deque[float] = deque(maxlen=max(1, round(limits.command_delay_s / period_s)))
        self.model_m = self.target_m = self._still_model_m = self._still_m = math.nan
        self._still_blur_m = 0.0
        self._rest, self._rest_steps = 0, math.ceil(REST_S / period_s)
        self._least_progress_m = max(3.0 * limits.position_resolution_m, LEAST_PROGRESS_M)
        slowest_m_s = PROGRESS_SHARE * limits.guarded_speed_m_s
        self._progress_time_s = max(PROGRESS_S, self._least_progress_m / slowest_m_s)
        self._progress_m = self._progress_s = math.nan
        self._speed_decay = math.exp(-period_s / SPEED_MEMORY_S)
        self._now_s = math.nan
        self.speed_m_s = self.recent_m_s = 0.0
        self.steps = 1

    def still_share(self, position_m: float) -> float:
        """How near R7 is to a frozen position, 1 where it trips; 0 while the arm follows."""
        moved_m, seen_m = self.model_m - self._still_model_m, position_m - self._still_m
        if moved_m == 0.0 or seen_m / moved_m >= STILL_SHARE:
            return 0.0
        limits = self._limits
        return abs(moved_m) / (limits.still_m + limits.model_lag_s * self.recent_m_s)

    def waited_share(self, now_s: float) -> float:
        """How long R7 has waited for progress in an approach, 1 where it trips; NaN elsewhere."""
        return (now_s - self._progress_s) / self._progress_time_s

    def adopt(self, limits: RunLimits) -> None:
        """Judge by these thresholds from now on."""
        self._limits = limits

    def judge(self, now_s: float, target_m: float, position_m: float, phase: int) -> Trip | None:
        """Follow one tick; the first rule that it breaks, or None.

        `target_m` is the target in force until now (NaN before the first), `position_m` the newest
        position of the arm.
        """
        step_s, self._now_s = now_s - self._now_s, now_s
        last_m, self.target_m = self.target_m, target_m
        if last_m != last_m:  # nothing was commanded before
            self.model_m = self._still_model_m = self._still_m = position_m
            self._delayed.extend([position_m] * (self._delayed.maxlen or 1))
            return None
        limits = self._limits
        period_s = limits.period_s
        self.speed_m_s = speed = (target_m - last_m) / (step_s if step_s > period_s else period_s)
        recent = self.recent_m_s * self._speed_decay
        if speed > recent:
            recent = speed
        elif -speed > recent:
            recent = -speed
        self.recent_m_s = recent
        delayed, alpha, model_m, steps = self._delayed, self._model_alpha, self.model_m, 1
        if not step_s < 1.5 * period_s:
            steps = min(round(step_s / period_s), 1000)
            for _ in range(steps - 1):
                model_m += alpha * (delayed[0] - model_m)
                delayed.append(target_m)
        self.model_m = model_m = model_m + alpha * (delayed[0] - model_m)
        delayed.append(target_m)
        self.steps = steps
        # R7: the arm is not where its commands put it, or does not move as far as they say.
        error_m, moved_m = position_m - model_m, model_m - self._still_model_m
        blur_m = limits.model_lag_s * recent
        tolerance_m, span_m = limits.model_tolerance_m + blur_m, limits.still_m + blur_m
        away = None
        if not -tolerance_m <= error_m <= tolerance_m:
            away = self._found(
                "R7", error_m, tolerance_m, "m",
                f"the arm is {error_m * 1e6:+.1f} um away from where its commands should put it",
            )  # fmt: skip
        else:
            self._rest = rest = 0 if speed else self._rest + steps
            if rest >= self._rest_steps and self._still_blur_m > limits.still_m:
                # A reference of fast motion is replaced at rest: the arm lagged behind then.
                self._still_model_m, self._still_m, self._still_blur_m = model_m, position_m, 0.0
            elif not -span_m <= moved_m <= span_m:
                away = self._judge_still(moved_m, position_m, blur_m)
        if phase in SEARCHING:
            return away or self._judge_search(now_s, position_m)
        self._progress_s = math.nan
        return away

    def _judge_still(self, moved_m: float, position_m: float, blur_m: float) -> Trip | None:
        """R7 where the commands have moved the arm by `moved_m`; a new reference is taken."""
        seen_m = position_m - self._still_m
        self._still_model_m, self._still_m, self._still_blur_m = self.model_m, position_m, blur_m
        if seen_m / moved_m >= STILL_SHARE:
            return None
        return self._found(
            "R7", seen_m, STILL_SHARE * moved_m, "m",
            f"the arm was told to move by {moved_m * 1e6:+.1f} um and moved by"
            f" {seen_m * 1e6:+.1f} um: its position is frozen, or it does not follow",
        )  # fmt: skip

    def _judge_search(self, now_s: float, position_m: float) -> Trip | None:
        """R8, and R7 where an approach makes no progress."""
        if position_m > self._limits.search_end_m:
            return self._found(
                "R8", position_m, self._limits.search_end_m, "m",
                "surface not found within the search distance",
            )  # fmt: skip
        if self._progress_s != self._progress_s or position_m > self._progress_m:
            self._progress_m = position_m + self._least_progress_m
            self._progress_s = now_s
        elif now_s - self._progress_s > self._progress_time_s:
            return self._found(
                "R7", now_s - self._progress_s, self._progress_time_s, "s",
                "no progress towards the surface: the arm does not follow, or the only force"
                " channel repeats the same reading",
            )  # fmt: skip
        return None
