"""Judges the force of a contact: settled, rung out, or the surface met."""

from __future__ import annotations

import math

BLOCK_S = 0.1
BLOCKS = 10
KEPT_BLOCKS = 2
"""Verdicts in a row, one block apart: settled must be kept for 0.1 s."""
RING_BLOCK_S = 0.025
RING_SIGMAS = 7.0

_CENTRED = [i - 0.5 * (BLOCKS - 1) for i in range(BLOCKS)]
_SPREAD = sum(c * c for c in _CENTRED)


class SettleTest:
    """Equivalence test on blocks of the last second: (|slope| + 2 se) · T_hold < eps, for 0.1 s.

    Not settled until shown: noise too high for `eps_n` never counts as rest.
    """

    def __init__(self) -> None:
        self.begin(0.0, 0.0, 0.0)

    def begin(self, start_s: float, hold_s: float, eps_n: float) -> None:
        """Look at the force from `start_s` on; over `hold_s` it may creep by less than `eps_n`."""
        self._means: list[float] = []
        self._eps_n, self._hold_s, self._end_s = eps_n, hold_s, start_s + BLOCK_S
        self._sum = 0.0
        self._n = self._kept = 0
        self.settled = False

    def add(self, now_s: float, force_n: float) -> None:
        """Take one reading in."""
        if now_s >= self._end_s:
            if self._n:
                self._means.append(self._sum / self._n)
                if len(self._means) > BLOCKS:
                    del self._means[0]
                self._judge()
            self._end_s += BLOCK_S
            self._sum = 0.0
            self._n = 0
        self._sum += force_n
        self._n += 1

    def _judge(self) -> None:
        means = self._means
        if len(means) < BLOCKS:
            return
        centre = sum(means) / BLOCKS
        slope = sum(c * m for c, m in zip(_CENTRED, means, strict=True)) / _SPREAD
        residual = sum((m - centre - slope * c) ** 2 for c, m in zip(_CENTRED, means, strict=True))
        error = math.sqrt(residual / (BLOCKS - 2) / _SPREAD)
        creep_n = (abs(slope) + 2.0 * error) / BLOCK_S * self._hold_s
        self._kept = self._kept + 1 if creep_n < self._eps_n else 0
        self.settled = self._kept >= KEPT_BLOCKS


class RingTest:
    """Ringing has died out when the force stays within 7 σ for two short blocks in a row."""

    def __init__(self, noise_n: float) -> None:
        self._width_n = RING_SIGMAS * noise_n
        self.begin(0.0, 0.0)

    def begin(self, start_s: float, force_n: float) -> None:
        """Look at the force from `start_s` on."""
        self._end_s = start_s + RING_BLOCK_S
        self._high = self._low = force_n
        self._quiet = 0
        self.quiet = False

    def add(self, now_s: float, force_n: float) -> None:
        """Take one reading in."""
        if now_s >= self._end_s:
            self._quiet = self._quiet + 1 if self._high - self._low < self._width_n else 0
            self.quiet = self._quiet >= 2
            self._end_s = now_s + RING_BLOCK_S
            self._high = self._low = force_n
        elif force_n > self._high:
            self._high = force_n
        elif force_n < self._low:
            self._low = force_n


TOUCH_SAMPLES = 2
"""Samples in a row above the touch force that make a touch."""
SURE = 1.5
"""A sample above so many touch forces is a hit: the touch force is at least 4 sigma of noise."""
BOUNCE_S = 0.2
"""Time in s for which the approach waits after a hit for another one."""


class TouchTest:
    """Two samples in a row above the touch force are a touch.

    An arm that is heavy for its stiffness bounces off something rigid, and each hit is over before
    the next sample. Going on between two hits makes each of them harder. So the approach waits
    after a hit, a sample well above the touch force; two hits need not be in a row.

    Args:
        touch_force_n: force above which a sample counts towards a touch.

    `touched` says whether there has been one.
    """

    def __init__(self, touch_force_n: float) -> None:
        self._touch_n = touch_force_n
        self._row = self._hits = 0
        self._hit_s = -math.inf
        self.touched = False

    def add(self, now_s: float, force_n: float) -> None:
        """Judge a fresh sample."""
        if force_n <= self._touch_n:
            self._row = 0
            return
        self._row += 1
        if force_n > SURE * self._touch_n:
            self._hits = self._hits + 1 if self.waits(now_s) else 1
            self._hit_s = now_s
        self.touched = max(self._row, self._hits) >= TOUCH_SAMPLES

    def waits(self, now_s: float) -> bool:
        """Whether the last hit is so recent that the approach has to wait."""
        return now_s - self._hit_s <= BOUNCE_S
