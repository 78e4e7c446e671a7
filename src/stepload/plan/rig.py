"""The declaration of a rig: arm, sensors and the simulated rig."""

from collections.abc import Iterator, Mapping
from enum import StrEnum
from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from stepload.declaration import quantities as q
from stepload.declaration.sections import (
    CHECKED,
    SECTION,
    Contradiction,
)
from stepload.plan.simulation import Simulation
from stepload.plan.system_stiffness import SystemStiffness

_Age = Annotated[float, q.Quantity("s", 0.002, 2.0)]
_Drift = Annotated[float, q.Quantity("N/s", 0.0, 100.0)]
_Misalignment = Annotated[float, q.Quantity("rad", 0.0, 0.175)]
_LoopDelay = Annotated[float, q.Quantity("s", 1e-5, 10.0)]
"""No loop is quicker than one sample of the fastest arm."""


class Structure(StrEnum):
    """How what carries the tool gives way under a force along its axis."""

    ARM = "arm"
    """A serial arm: sideways too, so that friction at the contact changes how stiff it is."""
    MACHINE = "machine"
    """A guided axis: along itself only."""


class SecondForceSource(StrEnum):
    """What checks the force sensor."""

    NONE = "none"
    ARM = "arm"
    """The arm's own estimate (`ArmSample.force_n`)."""
    SENSOR = "sensor"
    """A second force sensor of its own."""


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class DeviceSpec:
    """A driver by entry-point name with its checked options (quantities in SI)."""

    driver: q.Name
    """Name of an installed driver; `stepload drivers` lists them."""
    options: Mapping[str, object] = Field(default_factory=dict)
    """Options of the driver, on its page."""


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class ArmSpec(DeviceSpec):
    """The arm, or the driven axis of a testing machine."""

    rate_hz: q.Rate
    """Samples per second."""
    max_speed_m_s: Annotated[float, q.Quantity("m/s", 0.0, 2.0, above=True)]
    """Speed limit."""
    max_acceleration_m_s2: Annotated[float, q.Quantity("m/s^2", 0.0, 100.0, above=True)]
    """Deceleration that the arm reaches when it stops."""
    max_push_n: q.Force
    """Largest force of the arm along the axis."""
    effective_mass_kg: Annotated[float, q.Quantity("kg", 0.0, 1e4, above=True)]
    """Moving mass at the contact."""
    command_delay_s: q.Delay
    """Time from a command to the start of motion."""
    lag_s: q.Delay
    """First-order lag of the servo."""
    lost_motion_m: q.LengthOrZero = 0.0
    """Backlash and stiction, as travel."""
    position_resolution_m: q.Length
    """Resolution δ_Δ of the measured travel (29)."""
    position_noise_m: q.LengthOrZero = 0.0
    """Standard deviation of the measured travel at rest."""
    model_tolerance_m: q.Length = 5e-5
    """Largest difference between measured and commanded position (rule R7)."""
    max_age_s: _Age | None = None
    """Age of data that stops the run (rule R3); default: 12 ms, or four samples if longer."""
    pose: q.Remark = ""
    """Name of the pose; compared with the calibration record."""
    lateral_stiffness_n_per_m: q.Stiffness | None = None
    """Largest lateral stiffness, for alignment; none: three times the largest axial one."""
    structure: Structure = Structure.ARM
    """arm: a serial arm, which also gives way sideways; machine: a guided axis."""
    kinematics: q.PathText | None = None
    """Arm or file of DH parameters for `stepload pose`; none: one axis."""


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class ForceSpec(DeviceSpec):
    """The force sensor that the run is controlled and identified with."""

    profile: q.Name | None = None
    """Data sheet of the sensor; `stepload profiles` lists them."""
    rate_hz: q.Rate
    """Samples per second."""
    axis: q.Axis
    """Force component along the press, positive when pressing; a push by hand on the tool shows it.
    """
    range_n: q.Force
    """Rated force."""
    resolution_n: q.Force
    """Smallest step of the reading."""
    noise_n: q.Force
    """Standard deviation of the reading at rest."""
    delay_s: q.Delay
    """Time from force to sample on the host."""
    gain_uncertainty: q.Share = 0.01
    """Relative standard uncertainty of the gain."""
    nonlinearity: q.Share | None = None
    """Largest deviation from a straight line, share of the largest force; default: 1.5 %."""
    drift_n_per_s: _Drift = 0.0
    """Largest drift rate of the zero; `stepload doctor` measures an upper bound."""
    max_age_s: _Age | None = None
    """Age of data that stops the run (rule R3); default: 12 ms, or four samples if longer."""
    components: Annotated[str, q.Choice(("six", "one"))] = "six"
    """six: three forces and three torques; one: a load cell."""
    rated_force_n: tuple[q.Force, ...] = ()
    """Rated forces fx, fy, fz of the sensor; none: not checked."""
    rated_torque_n_m: tuple[q.Torque, ...] = ()
    """Rated torques tx, ty, tz of the sensor; none: not checked."""
    lever_m: q.Length | None = None
    """Distance from the sensor's origin to the contact; with torques it locates the contact."""
    misalignment_rad: _Misalignment | None = None
    """Largest angle between sensor axis and press; none: 2 deg (arm), 0 (machine)."""

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        for key, part_n in (("resolution", self.resolution_n), ("noise", self.noise_n)):
            if part_n >= 0.1 * self.range_n:
                yield (
                    key,
                    f"{key} {q.newton(part_n)} is more than a tenth of the range "
                    f"{q.newton(self.range_n)}",
                    "such a sensor cannot measure",
                )
        rated_n = self.rated_force_n
        for key, rated in (("rated_force", rated_n), ("rated_torque", self.rated_torque_n_m)):
            if len(rated) not in (0, 3):
                message = f"{len(rated)} ratings, a sensor has three axes"
                yield key, message, "give all three: x, y, z"
        along_n = rated_n["xyz".index(self.axis[-1])] if len(rated_n) == 3 else self.range_n
        if self.range_n > along_n:
            yield (
                "range",
                f"the range {q.newton(self.range_n)} is above the rated force "
                f"{q.newton(along_n)} of {self.axis[1:]}",
                "state the rated force of the pressing axis as range",
            )


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class DisplacementSpec(DeviceSpec):
    """A gauge across the contact: takes the system stiffness out of the chain."""

    rate_hz: q.Rate
    """Samples per second."""
    resolution_m: q.Length
    """Smallest step of the reading."""
    noise_m: q.LengthOrZero = 0.0
    """Standard deviation of the reading at rest."""
    offset_m: q.LengthOrZero | None = None
    """Lateral distance of the gauge from the contact; none: 20 mm (arm), 0 (machine)."""


@dataclass(frozen=True, slots=True, config=SECTION)
class SecondForce:
    """The second force channel and how far it may differ (rule R5).

    R5 allows |F − F2| ≤ tolerance_n + tolerance_relative · F, and more for `time_s` at the most.
    """

    source: SecondForceSource = SecondForceSource.NONE
    """none, the arm's own estimate, or a second force sensor."""
    tolerance_n: q.ForceOrZero = 0.0
    """Allowed difference, absolute part; raised where drift and second zero need more."""
    tolerance_relative: q.Share = 0.0
    """Allowed difference, share of the force."""
    time_s: q.Duration = 0.02
    """Longest time that the difference may last."""
    noise_n: q.ForceOrZero = 0.0
    """Standard deviation of the second channel at rest; taken off F_allowed."""
    sensor: ForceSpec | None = None
    """The second sensor, for `source: sensor`."""
    zero_error_n: q.ForceOrZero | None = None
    """Largest zero error of the second channel, taken off F_allowed; none: half of `tolerance`."""

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        source, sensor = self.source, self.sensor
        if source is SecondForceSource.SENSOR and sensor is None:
            yield "", "source is sensor, but there is no `sensor`", "describe it there"
        elif source is not SecondForceSource.SENSOR and sensor is not None:
            hint = "write source: sensor, or remove it"
            yield "sensor", f"a sensor, but source is {source}", hint
        elif source is not SecondForceSource.NONE and self.tolerance_n == 0.0:
            yield (
                "tolerance",
                "a second channel with a tolerance of 0 N would stop every run",
                "give the difference that its noise and gain error explain",
            )


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Rig:
    """The rig. A profile's name, a path, or a mapping; `profile` with overrides is a mapping."""

    profile: q.Name | None = None
    """Profile that gives every key not written here."""
    name: q.Name
    """Name of the rig in records."""
    arm: ArmSpec
    """The arm."""
    force: ForceSpec
    """The force sensor."""
    displacement: DisplacementSpec | None = None
    """A displacement gauge."""
    second_force: SecondForce = Field(default_factory=SecondForce)
    """The second force channel."""
    system_stiffness: SystemStiffness
    """Stiffness of the load path."""
    loop_delay_s: _LoopDelay | None = None
    """Measured delay of the control loop; none: sum of its parts."""
    common_force_error: Annotated[float, q.Quantity("%", 0.0, 0.5)] = 0.05
    """Share by which all force channels may read too low together; taken off F_allowed."""
    mechanical_fuse_n: q.Force | None = None
    """Force at which a mechanical fuse in the load path opens."""
    plate_tilt_rad: _Misalignment | None = None
    """Largest plate tilt, used where `procedure.alignment` does not measure it; none: 3 deg."""
    load_path_m: q.LengthOrZero = 0.0
    """Length between the arm's position measurement and the plate, for thermal expansion."""
    thermal_expansion_per_k: q.Expansion = 0.0
    """Coefficient of thermal expansion of the load path."""
    hazards_read_by: q.Remark = ""
    """Who has read the hazards and answers for the rig; required to move real hardware."""
    hazards_read_on: q.Calendar | None = None
    """Day on which they were read."""
    wiring_checked_on: q.Calendar | None = None
    """Day on which force axis, its sign and the approach direction were checked."""
    simulation: Simulation = Field(default_factory=Simulation)
    """The simulated rig."""

    @property
    def devices(self) -> dict[str, ArmSpec | ForceSpec | DisplacementSpec]:
        """The devices that the rig has, by their key in it."""
        found = {
            "force": self.force, "arm": self.arm, "second_force.sensor": self.second_force.sensor,
            "displacement": self.displacement,
        }  # fmt: skip
        return {name: spec for name, spec in found.items() if spec is not None}
