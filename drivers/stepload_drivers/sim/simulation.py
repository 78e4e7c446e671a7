"""Plant and channels of one simulated rig, and their advance in time."""

from __future__ import annotations

import math

import numpy as np

from stepload.errors import DomainError
from stepload.rig.world import WorldSpec
from stepload_drivers.sim.channels import ArmChannel, Channel, ForceChannel, GaugeChannel
from stepload_drivers.sim.contact import contact_of
from stepload_drivers.sim.faults import ARM, Schedule, check_kinds
from stepload_drivers.sim.mechanics import Pressed
from stepload_drivers.sim.noise import normal_source
from stepload_drivers.sim.sensor_errors import Bent, sideways
from stepload_drivers.sim.sensor_truth import SensorTruth, main_sensor, second_sensor
from stepload_drivers.sim.six_plant import SixPlant
from stepload_drivers.sim.six_world import SixArmChannel, mechanics_of, sensor_of

_EARLY_S = 1e-9
_LONGEST_STEP_S = 1e-3
_GAUGE_ZERO_M = 20e-6
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

    Raises:
        BadInputError: an unknown fault.
        DomainError: a number that no rig or payload has.
    """

    def __init__(self, spec: WorldSpec) -> None:
        check_kinds(spec.faults)
        for name in _POSITIVE:
            value = getattr(spec, name)
            if not 0.0 < value < math.inf:
                raise DomainError(f"simulated rig: {name} = {value:g} must be positive and finite")
        self.spec = spec
        period_s = 1.0 / spec.arm_rate_hz
        parts = math.ceil(period_s / _LONGEST_STEP_S - 1e-6)
        self.plant = mechanics_of(spec, contact_of(spec), step_s=period_s / parts)
        self._step_s = self.plant.step_s
        chance = np.random.default_rng([spec.seed, 0])
        arm_offset_n = float(chance.normal()) * spec.arm_force_noise_n
        gauge_zero_m = float(chance.uniform(-_GAUGE_ZERO_M, _GAUGE_ZERO_M))
        second_offset_n = float(chance.normal()) * 3.0 * spec.second_force_noise_n
        arm_faults = Schedule(spec.faults, kinds=ARM)
        self.arm: ArmChannel
        self.force: Channel
        self.second_force: Channel | None = None
        if isinstance(self.plant, SixPlant):
            six = self.plant
            self.arm = SixArmChannel(six, spec, force_offset_n=arm_offset_n, faults=arm_faults)
            bend = spec.sensor_quadratic, spec.sensor_cubic
            self.force = sensor_of(six, six.mount.sensor, main_sensor(spec), bend)
            if spec.second_force_rate_hz > 0.0:
                truth = second_sensor(spec, second_offset_n)
                self.second_force = sensor_of(six, six.mount.second_sensor, truth)
        else:
            self.arm, self.force, self.second_force = self._one_axis(
                spec, arm_offset_n, second_offset_n, arm_faults
            )
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

    def _one_axis(
        self, spec: WorldSpec, arm_offset_n: float, second_offset_n: float, arm_faults: Schedule
    ) -> tuple[ArmChannel, Channel, Channel | None]:
        """Arm and force sensors of a rig with the pressing axis alone."""
        arm = ArmChannel(self.plant, spec, force_offset_n=arm_offset_n, faults=arm_faults)
        bent = spec.lateral * spec.cross_talk or spec.sensor_quadratic or spec.sensor_cubic
        force = self._sensor(main_sensor(spec), Bent(self.plant, spec) if bent else self.plant)
        second: Channel | None = None
        if spec.second_force_rate_hz > 0.0:
            second = self._sensor(second_sensor(spec, second_offset_n), self.plant)
        return arm, force, second

    def _sensor(self, truth: SensorTruth, pressed: Pressed) -> ForceChannel:
        """A force sensor of such a rig."""
        spec = self.spec
        across = normal_source(truth.seed, truth.stream + 1, truth.noise_n)
        wrench = sideways(
            self.plant, truth.axis, share=spec.lateral, noise=across, six=spec.six_components
        )
        return ForceChannel(pressed, truth, wrench=wrench)

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
        plant = self.plant
        h = self._step_s
        limit = to_s + _EARLY_S - h
        while plant.time_s <= limit:
            plant.step()
            now_s = plant.time_s
            due_s = now_s + _EARLY_S
            for channel in self.channels:
                while channel.next_s <= due_s:
                    early_s = now_s - channel.next_s
                    channel.sample(channel.next_s, early_s / h if early_s > _EARLY_S else 0.0)
                    channel.samples += 1
                    channel.next_s = (channel.samples + 1) * channel.period_s
