"""Couples the emulated UR controller to the simulated contact world, in real time."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any

from stepload_drivers.sim.live import DEFAULT_SPEC, LiveWorld
from stepload_verify.emulators.ur_axis import AxisState


class LiveAxis:
    """A `LiveWorld` as the emulator's axis; sensors' emulators may share the same world.

    The world keeps its own time (monotonic); the controller's starts when it first lets time pass,
    at a sample time of the world's arm.
    """

    def __init__(self, world: LiveWorld) -> None:
        self.world = world
        self._origin_s: float | None = None
        self._state = world.state()

    def command(self, position_m: float) -> None:
        self.world.command(position_m)

    def advance_to(self, time_s: float) -> None:
        if self._origin_s is None:
            period_s = self.world.world.arm.period_s
            age_s = time.monotonic() - time_s - self.world.origin_s
            self._origin_s = self.world.origin_s + math.floor(age_s / period_s) * period_s
        self._state = self.world.at(self._origin_s + time_s)

    def state(self) -> AxisState:
        state = self._state
        force_n = state.arm_force_n
        return AxisState(
            state.position_m,
            state.force_n if math.isnan(force_n) else force_n,
            state.force_n,
            state.peak_force_n,
        )


def axis_in_world(**truth: Any) -> LiveAxis:
    """An axis in the default world with some of its truth replaced (fields of `WorldSpec`)."""
    return LiveAxis(LiveWorld(replace(DEFAULT_SPEC, **truth)))
