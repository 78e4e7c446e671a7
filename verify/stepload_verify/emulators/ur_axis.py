"""Physics required by the emulated controller: one axis along the approach direction."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from stepload.rig.samples import SixFloats


class AxisState(NamedTuple):
    """Measured travel along the approach axis, and the force it presses with (positive).

    `contact_n` is the true contact force and `force_n` the arm's noisy estimate of it, `peak_n` its
    largest value so far. Of a rig with six axes also `wrench`, what the tip does to the plate, and
    `shift_m`, the measured travel across the approach direction; the frame is that of `ur_frames`.
    """

    position_m: float
    force_n: float
    contact_n: float = 0.0
    peak_n: float = 0.0
    wrench: SixFloats | None = None
    shift_m: tuple[float, float] | None = None


class Axis(Protocol):
    """A driven axis in continuous time."""

    def command(self, position_m: float) -> None:
        """Absolute target from now on."""
        ...

    def command_shift(self, x_m: float, y_m: float) -> None:
        """Likewise across; used only where `state` has a shift."""
        ...

    def advance_to(self, time_s: float) -> None:
        """Let time pass; `time_s` counts from 0 at the start and never goes back."""
        ...

    def state(self) -> AxisState:
        """Where the axis is at the time last advanced to."""
        ...


class FreeAirAxis:
    """An ideal first-order position servo with a speed limit, touching nothing."""

    def __init__(self, lag_s: float = 0.01, max_speed_m_s: float = 0.25) -> None:
        self._lag_s = lag_s
        self._max_speed_m_s = max_speed_m_s
        self._time_s = 0.0
        self._target_m = 0.0
        self._position_m = 0.0

    def command(self, position_m: float) -> None:
        self._target_m = position_m

    def command_shift(self, x_m: float, y_m: float) -> None:
        """It has one axis."""

    def advance_to(self, time_s: float) -> None:
        step_s = time_s - self._time_s
        self._time_s = time_s
        move_m = (self._target_m - self._position_m) * -math.expm1(-step_s / self._lag_s)
        limit_m = self._max_speed_m_s * step_s
        self._position_m += max(-limit_m, min(limit_m, move_m))

    def state(self) -> AxisState:
        return AxisState(self._position_m, 0.0)
