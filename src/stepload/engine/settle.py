"""Has the force come to rest? An equivalence test on blocks of the last second; and ringing."""

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
    """(|slope| + 2 se) · T_hold < eps over 1 s, kept for 0.1 s.

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
