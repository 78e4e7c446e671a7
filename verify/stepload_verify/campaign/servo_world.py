"""A world of another physics than stepload's own: a stiff tip without mass on a servo with play.

The servo is one of second order: a speed loop below a position loop, both of limited power, so that
it overshoots. Play lies between servo and tip. Payload and load path are springs in series, and the
force is where both carry the same: each step solves that implicitly. Nothing oscillates, no damping
carries a force. Sensors and faults are those of stepload's own world.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Annotated, ClassVar

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import Setting, number
from stepload.declaration.sections import SECTION, key
from stepload.errors import BadInputError
from stepload.rig.world import SimulatedRig, WorldSpec
from stepload_drivers.sim.drive import Drive
from stepload_drivers.sim.faults import FAULTS
from stepload_drivers.sim.plant import Plant
from stepload_drivers.sim.simulation import World
from stepload_drivers.sim.world import virtual_rig

_SUB_STEPS = 8
_THERE_M = 1e-12
_BALANCED_N = 1e-6
_MOST = 200


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class ServoOptions:
    """Options of the world `servo`."""

    damping_ratio: Annotated[float, number(0.3, 2.0), key("damping ratio of the servo")] = 0.7
    play_m: Annotated[float, Setting("m", 0.0, 1e-3), key("play beyond the plan's lost motion")] = (
        0.0
    )


class Servo(Drive):
    """ẍ = ω² (target − x) − 2 ζ ω ẋ with a limited speed and acceleration; ω = 2 ζ/lag.

    With that ω a ramp is followed with the same lag as by a servo of first order.
    """

    def __init__(self, spec: WorldSpec, step_s: float, options: ServoOptions) -> None:
        super().__init__(spec, step_s)
        self._half_lost += 0.5 * options.play_m
        self._sub_s = step_s / _SUB_STEPS
        self._position_gain = 1.0 / max(spec.lag_s, step_s)
        omega = 2.0 * options.damping_ratio * self._position_gain
        self._speed_part = -math.expm1(-2.0 * options.damping_ratio * omega * self._sub_s)

    def advance(self, push_n: float) -> float:
        """One step towards the target while it pushes with `push_n`; returns the tip's speed."""
        h, most, brake = self._sub_s, self._max_speed, self._twice_accel
        change = self._accel_step / _SUB_STEPS
        here_m, speed = self.position_m, self.speed_m_s
        for _ in range(_SUB_STEPS):
            gap_m = self.target_m - self.follower_m
            if abs(gap_m) < _THERE_M and abs(speed * h) < _THERE_M:
                speed = 0.0
                break
            want = min(abs(gap_m) * self._position_gain, math.sqrt(brake * abs(gap_m)), most)
            step = self._speed_part * (math.copysign(want, gap_m) - speed)
            speed += max(-change, min(change, step))
            if push_n >= self._max_push and speed > 0.0:
                speed = 0.0
            self.follower_m += speed * h
        self.speed_m_s = speed
        half_m = self._half_lost
        self.position_m = min(max(here_m, self.follower_m - half_m), self.follower_m + half_m)
        return (self.position_m - here_m) / self._step_s


class ServoPlant(Plant):
    """The mechanics: servo, play, and the balance of load path and payload."""

    def __init__(self, spec: WorldSpec, *, step_s: float, options: ServoOptions) -> None:
        super().__init__(spec, step_s=step_s)
        self._axis: Servo = Servo(spec, step_s, options)

    def step(self) -> None:
        """Go on by `step_s`."""
        if self._slow:
            self._go_slowly()
        drive_m = self.advance_drive()
        self.surface_m -= self._moving_m
        self._moving_m = 0.0
        self.finish(*self._balanced(drive_m))

    def _balanced(self, drive_m: float) -> tuple[float, float]:
        """Where K_s (drive − tip) is the payload's force, and that; Newton within a bracket."""
        low_m, high_m = self.surface_m + self._law.residual_m, drive_m
        if high_m <= low_m:
            return drive_m, 0.0
        tip_m = min(max(self.tip_m, low_m), high_m)
        for _ in range(_MOST):
            force_n, tangent = self._evaluate(tip_m - self.surface_m)
            excess_n = force_n - self._stiffness * (drive_m - tip_m)
            if excess_n > 0.0:
                high_m = tip_m
            else:
                low_m = tip_m
            if abs(excess_n) < _BALANCED_N or high_m - low_m < 1e-15:
                break
            tip_m -= excess_n / (self._stiffness + max(0.0, tangent))
            if not low_m < tip_m < high_m:
                tip_m = 0.5 * (low_m + high_m)
        self._law.remember(tip_m - self.surface_m)
        return tip_m, force_n


class _ServoWorld:
    """A servo with play and a contact in series with K_s, in virtual time."""

    OPTIONS: ClassVar[type] = ServoOptions
    faults = FAULTS

    def __call__(self, spec: WorldSpec, **options: object) -> SimulatedRig:
        if spec.mount is not None:
            raise BadInputError(
                "the world servo has one axis", hint="leave rig.simulation.mount out"
            )
        told = ServoOptions(**options)  # type: ignore[arg-type]
        return virtual_rig(World(spec, partial(ServoPlant, options=told)))


servo = _ServoWorld()
