"""Has the arm met the surface? Two samples in a row above the touch force say so.

An arm that is heavy for its stiffness bounces off something rigid, and each hit is over before the
next sample. Going on between two hits makes every one of them harder. So the approach waits after a
hit, a sample well above the touch force; two hits are a touch and need not be in a row.
"""

from __future__ import annotations

import math

TOUCH_SAMPLES = 2
"""Samples in a row above the touch force that make a touch."""
SURE = 1.5
"""A sample above so many touch forces is a hit: the touch force is at least 4 sigma of noise."""
BOUNCE_S = 0.2
"""Time in s for which the approach waits after a hit for another one."""


class TouchTest:
    """Judges the samples of an approach.

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
