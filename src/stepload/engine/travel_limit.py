"""The force and target proved by the payload's answers so far; the travel limit starts from there.

An answer is a rise of the mean force above its noise, while the target stands where no reading is
from before. A channel that dies while the force rises still shows its last rise, and noise may show
it once more. So an answer proves not itself but the one before. A payload answers to motion, while
a dead reading drifts at rest as well: a rise no faster than that at rest is no answer.
"""

from __future__ import annotations

import math

from stepload.feasibility.limits import RunLimits
from stepload.feasibility.press import (
    ANCHOR_WINDOW_S,
    ANSWER_SIGMAS,
    DRIFT_SHARE,
    DRIFT_SIGMAS,
    END_WINDOW_S,
)


class TravelLimit:
    """The payload's last answer, and the last answer that a later one has proved.

    `answer_n` and `answer_m` are force and target of the former, `proved_n` and `proved_m` of the
    latter; `mean_n` is the mean force over `ANCHOR_WINDOW_S`, `rise_n` how far it must rise to be
    an answer.
    """

    def __init__(self, limits: RunLimits) -> None:
        count = max(1, round(ANCHOR_WINDOW_S / limits.period_s))
        self._limits = limits
        self._forces_n = [0.0] * count
        self._short = self._variance = self._variance_of(count)
        self._half_ticks = max(1, round(0.5 * END_WINDOW_S / limits.period_s))
        self._halves_n: list[float] = []
        self._least_n_per_m = limits.answer_n_per_m
        self.rise_n = self._told_n(2.0 * self._short)
        self._sum_n = self.mean_n = self.answer_n = self.proved_n = 0.0
        self.answer_m = self.proved_m = 0.0
        self._at = self._end_count = self._ticks = 0
        self._end_n = 0.0

    def begin(self, target_m: float, force_n: float, *, same: bool) -> None:
        """Begin at rest; `same` where nothing was proved since the last time.

        With `same` a rise of the force at rest counts as no answer.
        """
        if same:
            risen_n = max(0.0, force_n - self.answer_n)
            self.answer_n += risen_n
        else:
            self._answer(force_n, target_m, self._short)
            self.proved_n, self.proved_m = force_n, target_m
        count = len(self._forces_n)
        self._forces_n = [force_n] * count
        self.mean_n, self._sum_n = force_n, force_n * count
        self._at = 0
        self._stand()

    def end_m(self) -> float:
        """Largest target: half of the travel past the last answer, all of it past the proved one.

        So the arm stands for two answers within the travel that a rigid surface allows.
        """
        limits = self._limits
        half_m = 0.5 * (limits.travel_m(self.answer_n) + limits.lost_motion_m)
        return min(self.proved_m + limits.travel_m(self.proved_n), self.answer_m + half_m)

    def add(self, force_n: float) -> None:
        """Add a force to the mean."""
        self._ticks += 1
        forces_n, at = self._forces_n, self._at
        self._sum_n = sum_n = self._sum_n + force_n - forces_n[at]
        forces_n[at] = force_n
        self._at = at + 1 if at + 1 < len(forces_n) else 0
        self.mean_n = sum_n / len(forces_n)

    def add_at_end(self, target_m: float, force_n: float) -> None:
        """Add a pair at the end of the travel, and look for an answer in the mean of all there."""
        self._end_count = n = self._end_count + 1
        self._end_n += force_n
        if n % self._half_ticks:
            return
        self._halves_n.append(self._end_n)
        half, odd = divmod(len(self._halves_n), 2)
        if odd:
            return
        mean_n = self._end_n / n
        variance = self._variance_of(n)
        told_n = self._told_n(variance + max(variance, self._variance))
        if (
            mean_n > self.answer_n + told_n
            and self._drifted(mean_n - 2.0 * self._halves_n[half - 1] / n, n)
            < DRIFT_SHARE * (mean_n - self.answer_n)
            and self._worth(mean_n, target_m)
        ):
            self._answer(mean_n, target_m, variance)

    def _drifted(self, risen_n: float, ticks: int) -> float:
        """Upper estimate of the force's drift since the last answer, in N.

        Args:
            risen_n: mean over the time at rest less the mean over its first half.
            ticks: length of that time; the centres of the two means are a quarter of it apart.
        """
        noise_n = self._limits.noise_n * math.sqrt(0.5 * self._variance_of(ticks // 2))
        since = self._ticks - 0.5 * ticks
        return (risen_n + DRIFT_SIGMAS * noise_n) * since / (0.25 * ticks)

    def _answer(self, force_n: float, target_m: float, variance: float) -> None:
        """Store a new answer; the previous one is proved by it."""
        self.proved_n, self.proved_m = self.answer_n, self.answer_m
        self.answer_n, self.answer_m, self._variance = force_n, target_m, variance
        self._least_n_per_m = self._limits.answer_at(force_n)
        self._ticks = 0
        self._stand()

    def _stand(self) -> None:
        """Restart the count of the time at the end of the travel."""
        self._end_count = 0
        self._end_n = 0.0
        self._halves_n.clear()

    def _worth(self, force_n: float, target_m: float) -> bool:
        """Whether the force rose by more than the softest payload's answer to the travel."""
        return force_n - self.answer_n > self._least_n_per_m * (target_m - self.answer_m)

    def _told_n(self, variance: float) -> float:
        """Least difference in N of two means that noise of this `variance` does not explain."""
        return ANSWER_SIGMAS * self._limits.noise_n * math.sqrt(variance)

    def _variance_of(self, ticks: int) -> float:
        """Variance of the mean over `ticks`, as a share of the variance of one reading."""
        limits = self._limits
        return min(1.0, limits.reading_s / (ticks * limits.period_s))
