"""Plant and channels of one simulated rig, and their advance in time."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from stepload.errors import DomainError
from stepload.rig.world import WorldSpec
from stepload_drivers.sim.channels import ArmChannel, Channel, GaugeChannel
from stepload_drivers.sim.faults import ARM, Schedule, check_kinds
from stepload_drivers.sim.force_channels import (
    ForceChannel,
    SensorLoad,
    SensorTruth,
    WrenchChannel,
    main_sensor,
    second_sensor,
)
from stepload_drivers.sim.plant import Plant
from stepload_drivers.sim.six_plant import Mechanics, SixPlant

_EARLY_S = 1e-9
_LONGEST_STEP_S = 1e-3
_GAUGE_ZERO_M = 20e-6
SENSED = (
    "faults", "gauge_rate_hz", "second_force_rate_hz", "lost_motion_m", "kinematic_error_m",
    "force_drift_n_per_s", "slip_m", "lateral", "cross_talk", "sensor_quadratic", "sensor_cubic",
)  # fmt: skip
"""`stepload.rig.world.EFFECTS` that drive and channels have, whatever the mechanics."""
_POSITIVE = (
    "arm_rate_hz",
    "force_rate_hz",
    "force_range_n",
    "system_stiffness_n_per_m",
    "effective_mass_kg",
    "max_speed_m_s",
    "max_acceleration_m_s2",
    "max_push_n",
)


class World:
    """Plant and channels of one `WorldSpec`; world time begins at 0 with the arm at travel 0.

    Base steps divide the arm's period and are at most 1 ms long.

    Args:
        spec: the truth.
        one_axis: makes the mechanics of a rig with one axis, given spec and `step_s`.

    Raises:
        BadInputError: an unknown fault.
        DomainError: a number that no rig or payload has.
    """

    def __init__(self, spec: WorldSpec, one_axis: Callable[..., Plant] = Plant) -> None:
        check_kinds(spec.faults)
        for name in _POSITIVE:
            value = getattr(spec, name)
            if not 0.0 < value < math.inf:
                raise DomainError(f"simulated rig: {name} = {value:g} must be positive and finite")
        self.spec = spec
        period_s = 1.0 / spec.arm_rate_hz
        parts = math.ceil(period_s / _LONGEST_STEP_S - 1e-6)
        step_s = period_s / parts
        self.plant: Mechanics
        if spec.mount is not None:
            self.plant = SixPlant(spec, spec.mount, step_s=step_s)
        else:
            self.plant = one_axis(spec, step_s=step_s)
        chance = np.random.default_rng([spec.seed, 0])
        arm_offset_n = float(chance.normal()) * spec.arm_force_noise_n
        gauge_zero_m = float(chance.uniform(-_GAUGE_ZERO_M, _GAUGE_ZERO_M))
        second_offset_n = float(chance.normal()) * 3.0 * spec.second_force_noise_n
        self.arm = ArmChannel(
            self.plant, spec, force_offset_n=arm_offset_n, faults=Schedule(spec.faults, kinds=ARM)
        )
        self.force = self._sensor(main_sensor(spec))
        self.second_force: Channel | None = None
        if spec.second_force_rate_hz > 0.0:
            self.second_force = self._sensor(second_sensor(spec, second_offset_n), second=True)
        self.channels: list[Channel] = [self.arm, self.force]
        if self.second_force is not None:
            self.channels.append(self.second_force)
        self.gauge: GaugeChannel | None = None
        if spec.gauge_rate_hz > 0.0:
            faults = Schedule(spec.faults, prefix="gauge_")
            self.gauge = GaugeChannel(
                self.plant, spec, offset_m=gauge_zero_m, stream=40, faults=faults
            )
            self.channels.append(self.gauge)
        self._next_s = 0.0
        """No channel has a sample before this world time."""

    def _sensor(self, truth: SensorTruth, *, second: bool = False) -> Channel:
        """A force sensor; only the main one is bent."""
        spec, plant = self.spec, self.plant
        if isinstance(plant, Plant):
            return ForceChannel(plant, spec, truth, bent=not second)
        mount = plant.mount.second_sensor if second else plant.mount.sensor
        bend = (0.0, 0.0) if second else (spec.sensor_quadratic, spec.sensor_cubic)
        return WrenchChannel(SensorLoad(plant, mount, truth.axis), mount, truth, bend=bend)

    @property
    def time_s(self) -> float:
        """World time that has been simulated."""
        return self.plant.time_s

    @property
    def true_peak_force_n(self) -> float:
        return self.plant.peak_n

    @property
    def true_peak_equivalent_n(self) -> float:
        return self.plant.peak_equivalent_n

    @property
    def true_force_n(self) -> float:
        return self.plant.force_n

    def advance(self, to_s: float) -> None:
        """Advance the world to `to_s` (whole base steps); nothing happens if that is past."""
        plant, h, channels = self.plant, self.plant.step_s, self.channels
        step, next_s = plant.step, self._next_s
        limit = to_s + _EARLY_S - h
        while plant.time_s <= limit:
            step()
            now_s = plant.time_s
            due_s = now_s + _EARLY_S
            if next_s > due_s:
                continue
            next_s = math.inf
            for channel in channels:
                sample_s = channel.next_s
                while sample_s <= due_s:
                    early_s = now_s - sample_s
                    channel.sample(sample_s, early_s / h if early_s > _EARLY_S else 0.0)
                    channel.samples = samples = channel.samples + 1
                    channel.next_s = sample_s = (samples + 1) * channel.period_s
                if sample_s < next_s:
                    next_s = sample_s
        self._next_s = next_s
