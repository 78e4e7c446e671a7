"""Lateral force as measured by the arm's own force/torque estimate."""

from __future__ import annotations

import math

from stepload.rig.samples import SixFloats


class ArmSide:
    """Filters the two lateral components; `across_n` is their magnitude, less that at `tare`.

    `told` is true once the arm has reported any.

    Args:
        alpha: share of a new reading in the smoothed force.
    """

    def __init__(self, alpha: float) -> None:
        self._alpha = alpha
        self.told = False
        self.across_n = self._x_n = self._y_n = self._zero_x_n = self._zero_y_n = 0.0

    def take(self, wrench: SixFloats) -> bool:
        """Filter the newest wrench; False if it is not finite although an earlier one was."""
        x_n, y_n = wrench[0], wrench[1]
        if not (x_n - x_n == 0.0 and y_n - y_n == 0.0):
            return not self.told
        if not self.told:
            self.told, self._x_n, self._y_n = True, x_n, y_n
        self._x_n += self._alpha * (x_n - self._x_n)
        self._y_n += self._alpha * (y_n - self._y_n)
        self.across_n = math.hypot(self._x_n - self._zero_x_n, self._y_n - self._zero_y_n)
        return True

    def tare(self) -> None:
        """Use the present filtered force as zero."""
        self._zero_x_n, self._zero_y_n = self._x_n, self._y_n
        self.across_n = 0.0
