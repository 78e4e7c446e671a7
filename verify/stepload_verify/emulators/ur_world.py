"""Couples the emulated UR controller to the simulated contact world, in real time."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

from stepload.rig.mount import Mount, SensorMount
from stepload.rig.samples import SixFloats
from stepload.rig.world import DEFAULT_SPEC
from stepload_drivers.sim.live import LiveWorld


def mount_from(data: Mapping[str, Any]) -> Mount:
    """What `dataclasses.asdict` and JSON made of a `Mount`.

    Raises:
        TypeError: an unknown field, or no mapping where one belongs.
    """
    told = {name: _frozen(value) for name, value in data.items()}
    for name in ("sensor", "second_sensor"):
        if name in told:
            told[name] = SensorMount(**{k: _frozen(v) for k, v in dict(told[name]).items()})
    return Mount(**told)


def _frozen(value: Any) -> Any:
    """Lists as tuples, at every depth."""
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


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


class LiveAxis:
    """A `LiveWorld` as the emulator's axis; sensors' emulators may share the same world.

    The world keeps its own time (monotonic); the controller's starts when it first lets time pass,
    at a sample time of the world's arm.
    """

    def __init__(self, world: LiveWorld) -> None:
        self.world = world
        spec = world.world.spec
        self._mount = spec.mount
        self._random = random.Random(spec.seed)
        self._noise_n = spec.arm_force_noise_n
        self._origin_s: float | None = None
        self._state = world.state()
        self._beside = (0.0, 0.0)

    def command(self, position_m: float) -> None:
        self.world.command(position_m)

    def command_shift(self, x_m: float, y_m: float) -> None:
        self.world.command_shift(x_m, y_m)

    def advance_to(self, time_s: float) -> None:
        if self._origin_s is None:
            period_s = self.world.world.arm.period_s
            age_s = time.monotonic() - time_s - self.world.origin_s
            self._origin_s = self.world.origin_s + math.floor(age_s / period_s) * period_s
        self._state = self.world.at(self._origin_s + time_s)
        if self._mount is not None:
            self._beside = (
                self._random.gauss(0.0, self._noise_n),
                self._random.gauss(0.0, self._noise_n),
            )

    def state(self) -> AxisState:
        state = self._state
        force_n = state.force_n if math.isnan(state.arm_force_n) else state.arm_force_n
        told = AxisState(state.position_m, force_n, state.force_n, state.peak_force_n)
        if self._mount is None:
            return told
        x, y, z = state.load_n
        off_x, off_y, _ = self._mount.sensor.lever_m
        moment = (off_y * z, -off_x * z, off_x * y - off_y * x)
        noise_x, noise_y = self._beside
        return told._replace(
            wrench=(x + noise_x, y + noise_y, force_n, *moment), shift_m=state.shift_m
        )


def axis_in_world(**truth: Any) -> LiveAxis:
    """An axis in the default world with some of its truth replaced (fields of `WorldSpec`)."""
    if isinstance(truth.get("mount"), dict):
        truth["mount"] = mount_from(truth["mount"])
    return LiveAxis(LiveWorld(replace(DEFAULT_SPEC, **truth)))
