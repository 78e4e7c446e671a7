"""Healthy devices of a simulated rig in virtual time, with what the contract needs to try them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from stepload.rig.contract import Trial
from stepload.rig.device import Device
from stepload.rig.mount import Mount, SensorMount
from stepload.rig.world import DEFAULT_SPEC, SimulatedRig, WorldFault, WorldSpec
from stepload_drivers.sim.faults import ARM, Schedule
from stepload_drivers.sim.world import open_world

SPEC = replace(DEFAULT_SPEC, gauge_rate_hz=100.0)
SIX_AXES = replace(
    SPEC,
    mount=Mount(
        compliance_m_per_n=((2e-7, 0.0, 8e-8), (0.0, 2e-7, 0.0), (8e-8, 0.0, 1.0 / 3.49e6)),
        friction_static=0.3,
        friction_kinetic=0.25,
        plate_tilt_rad=(0.02, -0.03),
        sensor=SensorMount((0.02, -0.03, 0.1), torque_noise_nm=0.01, torque_quantum_nm=0.005),
    ),
)
LOST = {"arm": "arm_lost", "force": "lost", "displacement": "lost"}
PRESS_M = 30e-6


class Virtual:
    """One virtual world at a time, a new one for each device that is made.

    Args:
        which: "arm", "force" or "displacement".
        breaks: makes a broken class of the healthy one.
        spec: the world.
    """

    def __init__(
        self,
        which: str,
        breaks: Callable[[type], type] = lambda healthy: healthy,
        spec: WorldSpec = SPEC,
    ) -> None:
        self.which, self._breaks, self._spec = which, breaks, spec
        self.rig: SimulatedRig | None = None

    def make(self, more: Mapping[str, object] | None = None) -> Device:
        self.rig = open_world(self._spec)
        device = getattr(self.rig, self.which)
        return self._breaks(type(device))(device._place, **(more or {}))

    def now_s(self) -> float:
        return self.rig.clock.now_s()

    def wait(self, seconds: float) -> None:
        self.rig.clock.sleep_until(self.now_s() + seconds)

    def silence(self) -> None:
        """No more samples, for good; the arm still takes commands."""
        fault = WorldFault(LOST[self.which], self.now_s(), math.inf, 0.0)
        world = self.rig.world
        if self.which == "arm":
            world.arm._faults = Schedule([fault], kinds=ARM)
        else:
            channel = world.force if self.which == "force" else world.gauge
            channel._faults = Schedule([fault])

    def load(self) -> float:
        """Press; returns the true force, or the true way of the gauge."""
        plant = self.rig.world.plant
        tip_m = plant.tip_m
        plant.command(self.now_s(), SPEC.surface_m + PRESS_M)
        self.wait(1.0)
        return plant.force_n if self.which == "force" else plant.tip_m - tip_m

    def trial(self) -> Trial:
        return Trial(
            make=self.make,
            make_with=self.make,
            wait=self.wait,
            now_s=self.now_s,
            silence=self.silence,
            stale_s=1.0,
            load=None if self.which == "arm" else self.load,
            noise=SPEC.force_noise_n if self.which == "force" else None,
            resolution=SPEC.force_quantum_n if self.which == "force" else 0.0,
            move_m=1e-3,
            leak_grace_s=0.1,
        )
