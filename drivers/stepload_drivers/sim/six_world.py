"""The parts of a world with six axes, made from its truth."""

from __future__ import annotations

from stepload.rig.mount import SensorMount
from stepload.rig.samples import ArmSample
from stepload.rig.world import WorldSpec
from stepload_drivers.sim.arm_lateral_force import ArmLateralForce
from stepload_drivers.sim.channels import ArmChannel
from stepload_drivers.sim.contact import Contact
from stepload_drivers.sim.drift_and_creep import plant_of
from stepload_drivers.sim.faults import Schedule
from stepload_drivers.sim.mechanics import Mechanics
from stepload_drivers.sim.sensor_load import SensorLoad
from stepload_drivers.sim.sensor_truth import SensorTruth
from stepload_drivers.sim.six_channels import WrenchChannel
from stepload_drivers.sim.six_plant import SixPlant


def mechanics_of(spec: WorldSpec, contact: Contact, *, step_s: float) -> Mechanics:
    """The mechanics of `spec`: with a mount six axes, without one the pressing axis alone."""
    if spec.mount is not None:
        return SixPlant(spec, spec.mount, contact, step_s=step_s)
    return plant_of(spec, contact, step_s=step_s)


def sensor_of(
    plant: SixPlant,
    sensor: SensorMount,
    truth: SensorTruth,
    bend: tuple[float, float] = (0.0, 0.0),
) -> WrenchChannel:
    """A force sensor where it sits."""
    felt = SensorLoad(plant, sensor, truth.axis)
    return WrenchChannel(felt, sensor, truth, bend=bend)


class SixArmChannel(ArmChannel):
    """An arm whose pose shows where its drives across the press are, and which estimates the force
    along all three axes where it estimates any.

    Like an arm with encoders on its motors it does not see what gives way behind them.
    """

    def __init__(
        self, plant: SixPlant, spec: WorldSpec, *, force_offset_n: float, faults: Schedule
    ) -> None:
        super().__init__(plant, spec, force_offset_n=force_offset_n, faults=faults)
        self._six = plant
        self._across = ArmLateralForce(plant, spec, faults) if spec.arm_has_force else None

    def sample(self, time_s: float, back: float) -> None:
        x_m, y_m = self._six.shift_m
        before = self.pending[-1] if self.pending else None
        super().sample(time_s, back)
        if self.pending and self.pending[-1] is not before:
            sample: ArmSample = self.pending.pop()
            if x_m or y_m:
                sample = sample._replace(pose=(-x_m, y_m, *sample.pose[2:]))
            if self._across is not None:
                active = self._faults.active(time_s) if self.disturbed else {}
                sample = sample._replace(wrench=self._across.wrench(sample.force_n, active))
            self.pending.append(sample)
