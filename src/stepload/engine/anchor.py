"""What force and position have proved of the contact so far: where the leash is tied to.

A channel that dies while the force rises still shows its last rise in every mean that reaches back
to it, and noise may show it once more. So a mean of the force is paired with a position from before
it, and such an answer proves not itself but the one before: a dead channel does not rise above it,
unless its reading rises by itself. A payload's answer comes with the motion; a dead reading rises
where the arm stands as well, and what has risen no faster than there is no answer. One that gives
answers on the way, or that jumps, passes for a payload (`dead_drift`).
"""

from __future__ import annotations

import math

from stepload.envelope.leash import (
    ANCHOR_WINDOW_S,
    ANSWER_SIGMAS,
    DRIFT_SHARE,
    DRIFT_SIGMAS,
    END_WINDOW_S,
)
from stepload.envelope.limits import RunLimits


class Anchor:
    """The last answer of the payload, and the last one that a later answer has proved.

    `answer_n` and `answer_m` are force and position of the former, `proved_n` and `proved_m` of the
    latter; `mean_n` is the mean force over `ANCHOR_WINDOW_S`, `rise_n` how far it must rise to be
    an answer.
    """

    __slots__ = (
        "_alpha", "_at", "_before_m", "_end_count", "_end_m", "_end_n", "_forces_n", "_half_ticks",
        "_halves_n", "_least_n_per_m", "_limits", "_next_n", "_positions_m", "_short", "_stops",
        "_sum_n", "_ticks", "_variance", "answer_m", "answer_n", "mean_n", "proved_m", "proved_n",
        "rise_n",
    )  # fmt: skip

    def __init__(self, limits: RunLimits) -> None:
        count = max(1, round(ANCHOR_WINDOW_S / limits.period_s))
        self._limits = limits
        self._alpha = min(1.0, 2.0 * limits.period_s / ANCHOR_WINDOW_S)
        self._forces_n, self._positions_m = [0.0] * count, [0.0] * count
        self._short = self._variance = self._variance_of(count)
        self._half_ticks = max(1, round(0.5 * END_WINDOW_S / limits.period_s))
        self._halves_n: list[float] = []
        self._least_n_per_m = limits.answer_n_per_m
        self._stops = limits.leash_share < limits.leash_proved
        self.rise_n = self._next_n = self._told_n(2.0 * self._short)
        self._sum_n = self.mean_n = self.answer_n = self.proved_n = 0.0
        self._before_m = self.answer_m = self.proved_m = 0.0
        self._at = self._end_count = self._ticks = 0
        self._end_n = self._end_m = 0.0

    def begin(self, position_m: float, force_n: float, *, same: bool) -> None:
        """At rest; `same` where nothing was proved since the last time.

        What the force has risen by at rest is no answer then.
        """
        if same:
            risen_n = max(0.0, force_n - self.answer_n)
            self.answer_n += risen_n
            self._next_n += risen_n
        else:
            self._answer(force_n, position_m, self._short)
            self.proved_n, self.proved_m = force_n, position_m
        count = len(self._forces_n)
        self._forces_n, self._positions_m = [force_n] * count, [position_m] * count
        self.mean_n, self._sum_n = force_n, force_n * count
        self._before_m = position_m
        self._at = 0
        self._stand()

    def add(self, position_m: float, force_n: float) -> None:
        """Take in a pair of the same moment.

        Where the arm stops for a payload that answers little, no answer is taken on the way: its
        noise would have the next one take longer. Nor is one where the arm has stood for a while.
        """
        self._ticks += 1
        forces_n, positions_m, at = self._forces_n, self._positions_m, self._at
        self._sum_n = sum_n = self._sum_n + force_n - forces_n[at]
        self._before_m = before_m = self._before_m + self._alpha * (
            positions_m[at] - self._before_m
        )
        forces_n[at], positions_m[at] = force_n, position_m
        self._at = at + 1 if at + 1 < len(forces_n) else 0
        self.mean_n = mean_n = sum_n / len(forces_n)
        if mean_n > self._next_n and len(self._halves_n) < 2 and self._worth(mean_n, before_m):
            self._answer(mean_n, before_m, self._short)

    def add_at_end(self, position_m: float, force_n: float) -> bool:
        """The same at the end of the leash, where a soft payload answers in a longer mean only.

        True where the arm has stood for long enough that it was looked for.
        """
        self._end_count = n = self._end_count + 1
        self._end_n += force_n
        self._end_m += position_m
        if n % self._half_ticks:
            return False
        self._halves_n.append(self._end_n)
        half, odd = divmod(len(self._halves_n), 2)
        if odd:
            return False
        mean_n, mean_m = self._end_n / n, self._end_m / n
        variance = self._variance_of(n)
        told_n = self._told_n(variance + max(variance, self._variance))
        if (
            mean_n > self.answer_n + told_n
            and self._drifted(mean_n - 2.0 * self._halves_n[half - 1] / n, n)
            < DRIFT_SHARE * (mean_n - self.answer_n)
            and self._worth(mean_n, mean_m)
        ):
            self._answer(mean_n, mean_m, variance)
        return True

    def _drifted(self, risen_n: float, ticks: int) -> float:
        """What the force may have drifted by since the last answer, in N.

        Args:
            risen_n: of the mean of a stand, over that of its first half.
            ticks: of the stand; between the two means lies a quarter of it.
        """
        noise_n = self._limits.noise_n * math.sqrt(0.5 * self._variance_of(ticks // 2))
        since = self._ticks - 0.5 * ticks
        return (risen_n + DRIFT_SIGMAS * noise_n) * since / (0.25 * ticks)

    def _answer(self, force_n: float, position_m: float, variance: float) -> None:
        """Take this for an answer; the last one is proved."""
        self.proved_n, self.proved_m = self.answer_n, self.answer_m
        self.answer_n, self.answer_m, self._variance = force_n, position_m, variance
        self._next_n = force_n + (math.inf if self._stops else self._told_n(self._short + variance))
        self._least_n_per_m = self._limits.answer_at(force_n)
        self._ticks = 0
        self._stand()

    def _stand(self) -> None:
        """Count the time at the end of the leash from the beginning."""
        self._end_count = 0
        self._end_n = self._end_m = 0.0
        self._halves_n.clear()

    def _worth(self, force_n: float, position_m: float) -> bool:
        """Whether the force has risen by what even the softest payload answers to the travel."""
        return force_n - self.answer_n > self._least_n_per_m * (position_m - self.answer_m)

    def _told_n(self, variance: float) -> float:
        """A difference of means that noise does not make; its variance is that of one reading."""
        return ANSWER_SIGMAS * self._limits.noise_n * math.sqrt(variance)

    def _variance_of(self, ticks: int) -> float:
        """Of the mean over so many ticks, as a share of that of one reading."""
        limits = self._limits
        return min(1.0, limits.reading_s / (ticks * limits.period_s))
