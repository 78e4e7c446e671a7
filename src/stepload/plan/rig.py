"""The declaration of a rig: arm, sensors, system stiffness and the simulated rig."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Annotated

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import (
    Axis,
    Calendar,
    Choice,
    Compliance,
    ComplianceError,
    Correlation,
    Damping,
    Degrees,
    Delay,
    Duration,
    Expansion,
    FilePath,
    Force,
    ForceOrZero,
    Length,
    LengthOrZero,
    Name,
    PathText,
    Quantity,
    Rate,
    Relative,
    Remark,
    Share,
    ShareAcross,
    Stiffness,
    StiffnessSigma,
    Temperature,
    Torque,
    number,
    refused,
)
from stepload.declaration.sections import DERIVED, INTERNAL, SECTION, key, put
from stepload.plan.simulation import Simulation
from stepload.rig.samples import SixFloats

_Age = Annotated[float, Quantity("s", 0.002, 2.0)]
_Drift = Annotated[float, Quantity("N/s", 0.0, 100.0)]
_Misalignment = Annotated[float, Quantity("rad", 0.0, 0.175)]
_StuckRatio = Annotated[float, number(1.0, 100.0)]
_LoopDelay = Annotated[float, Quantity("s", 1e-5, 10.0)]
"""No loop is quicker than one sample of the fastest arm."""


class Provenance(StrEnum):
    """Where a rig's system stiffness comes from."""

    MEASURED = "measured"
    """From a calibration record of this rig."""
    DECLARED = "declared"
    """Written into the plan by a person who answers for it."""
    INDICATIVE = "indicative"
    """A figure for this class of machine; not good enough for a result."""


class Structure(StrEnum):
    """How what carries the tool gives way under a force along its axis."""

    ARM = "arm"
    """A serial arm: sideways too, so that friction at the contact changes how stiff it is."""
    MACHINE = "machine"
    """A guided axis: along itself only."""


class RecordPolicy(StrEnum):
    """What to do when the calibration record is missing, expired or for another pose."""

    WARN = "warn"
    REFUSE = "refuse"


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

    driver: Annotated[Name, key("Name of an installed driver; `stepload drivers` lists them.")]
    options: Annotated[
        Mapping[str, object],
        key("Options of the driver, on its page."),
    ] = Field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class ArmSpec(DeviceSpec):
    """The arm, or the driven axis of a testing machine."""

    rate_hz: Annotated[Rate, key("Samples per second.")]
    max_speed_m_s: Annotated[
        float,
        Quantity("m/s", 0.0, 2.0, above=True),
        key("Speed limit."),
    ]
    max_acceleration_m_s2: Annotated[
        float,
        Quantity("m/s^2", 0.0, 100.0, above=True),
        key("Deceleration that the arm reaches when it stops."),
    ]
    max_push_n: Annotated[Force, key("Largest force of the arm along the axis.")]
    effective_mass_kg: Annotated[
        float,
        Quantity("kg", 0.0, 1e4, above=True),
        key("Moving mass at the contact."),
    ]
    command_delay_s: Annotated[Delay, key("Time from a command to the start of motion.")]
    lag_s: Annotated[Delay, key("First-order lag of the servo.")]
    lost_motion_m: Annotated[LengthOrZero, key("Backlash and stiction, as travel.")] = 0.0
    position_resolution_m: Annotated[Length, key("Resolution δ_Δ of the measured travel (29).")]
    position_noise_m: Annotated[
        LengthOrZero, key("Standard deviation of the measured travel at rest.")
    ] = 0.0
    model_tolerance_m: Annotated[
        Length,
        key("Largest difference between measured and commanded position (rule R7)."),
    ] = 5e-5
    max_age_s: Annotated[
        _Age | None,
        key("Age of data that stops the run (rule R3); default: 12 ms, or four samples if longer."),
    ] = None
    pose: Annotated[Remark, key("Name of the pose; compared with the calibration record.")] = ""
    lateral_stiffness_n_per_m: Annotated[
        Stiffness | None,
        key(
            "Largest lateral stiffness, for alignment and nulling; none: three times the "
            "largest axial one."
        ),
    ] = None
    structure: Annotated[
        Structure,
        key("arm: a serial arm, which also gives way sideways; machine: a guided axis."),
    ] = Structure.ARM
    kinematics: Annotated[
        PathText | None,
        key("Arm or file of DH parameters for `stepload pose`; none: one axis."),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class ForceSpec(DeviceSpec):
    """The force sensor that the run is controlled and identified with."""

    profile: Annotated[
        Name | None,
        key("Data sheet of the sensor; `stepload profiles` lists them."),
    ] = None
    rate_hz: Annotated[Rate, key("Samples per second.")]
    axis: Annotated[
        Axis,
        key(
            "Force component along the press, positive when pressing; a push by hand on the tool "
            "shows it."
        ),
    ]
    range_n: Annotated[Force, key("Rated force.")]
    resolution_n: Annotated[Force, key("Smallest step of the reading.")]
    noise_n: Annotated[Force, key("Standard deviation of the reading at rest.")]
    delay_s: Annotated[Delay, key("Time from force to sample on the host.")]
    gain_uncertainty: Annotated[Share, key("Relative standard uncertainty of the gain.")] = 0.01
    nonlinearity: Annotated[
        Share | None,
        key("Largest deviation from a straight line, share of the largest force; default: 1.5 %."),
    ] = None
    drift_n_per_s: Annotated[
        _Drift,
        key("Largest drift rate of the zero; `stepload doctor` measures an upper bound."),
    ] = 0.0
    max_age_s: Annotated[
        _Age | None,
        key("Age of data that stops the run (rule R3); default: 12 ms, or four samples if longer."),
    ] = None
    components: Annotated[
        str,
        Choice(("six", "one")),
        key("six: three forces and three torques; one: a load cell."),
    ] = "six"
    rated_force_n: Annotated[
        tuple[Force, ...],
        key("Rated forces fx, fy, fz of the sensor; none: not checked."),
    ] = ()
    rated_torque_n_m: Annotated[
        tuple[Torque, ...],
        key("Rated torques tx, ty, tz of the sensor; none: not checked."),
    ] = ()
    lever_m: Annotated[
        Length | None,
        key(
            "Distance from the sensor's origin to the contact; with torques it locates the contact."
        ),
    ] = None
    misalignment_rad: Annotated[
        _Misalignment | None,
        key("Largest angle between sensor axis and press; none: 2 deg (arm), 0 (machine)."),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class DisplacementSpec(DeviceSpec):
    """A gauge across the contact: takes the system stiffness out of the chain."""

    rate_hz: Annotated[Rate, key("Samples per second.")]
    resolution_m: Annotated[Length, key("Smallest step of the reading.")]
    noise_m: Annotated[LengthOrZero, key("Standard deviation of the reading at rest.")] = 0.0
    offset_m: Annotated[
        LengthOrZero | None,
        key("Lateral distance of the gauge from the contact; none: 20 mm (arm), 0 (machine)."),
    ] = None


@dataclass(frozen=True, slots=True, config=SECTION)
class SecondForce:
    """The second force channel and how far it may differ (rule R5).

    R5 allows |F − F2| ≤ tolerance_n + tolerance_relative · F, and more for `time_s` at the most.
    """

    source: Annotated[
        SecondForceSource,
        key("none, the arm's own estimate, or a second force sensor."),
    ] = SecondForceSource.NONE
    tolerance_n: Annotated[
        ForceOrZero,
        key("Allowed difference, absolute part; raised where drift and second zero need more."),
    ] = 0.0
    tolerance_relative: Annotated[Share, key("Allowed difference, share of the force.")] = 0.0
    time_s: Annotated[Duration, key("Longest time that the difference may last.")] = 0.02
    noise_n: Annotated[
        ForceOrZero,
        key("Standard deviation of the second channel at rest; taken off F_allowed."),
    ] = 0.0
    sensor: Annotated[ForceSpec | None, key("The second sensor, for `source: sensor`.")] = None
    zero_error_n: Annotated[
        ForceOrZero | None,
        key(
            "Largest zero error of the second channel, taken off F_allowed; none: half of "
            "`tolerance`."
        ),
    ] = None


@dataclass(frozen=True, slots=True, config=SECTION)
class SystemStiffness:
    """System stiffness K_s of the whole load path (26): a value with its error, or a record.

    With a record, its values have replaced those of the plan, and `record` is the path of its file.
    `simulated` says whether it was made in a dry run, `joints_rad` and `tcp_offset` how the arm of
    the record stood (empty and None: not told), `validity_problem` why the stiffness may not
    be used as it stands ("" where it may).

    What is subtracted from the travel is the deflection at `at_share` and, where `across` is known,
    c·(F_across − at_share·F). With `at_share` of zero that is the plain c·F of three numbers.
    """

    stiffness_n_per_m: Annotated[Stiffness, key("K_s; with `sigma`.", alias="value")] = DERIVED
    sigma_n_per_m: Annotated[StiffnessSigma, key("Standard uncertainty of `value`.")] = DERIVED
    msde_m: Annotated[LengthOrZero, key("Rms deformation misfit of the linear fit (26).")] = 0.0
    damping_n_s_per_m: Annotated[Damping, key("Damping C_s, a lower bound.")] = 0.0
    provenance: Annotated[
        Provenance,
        key("Origin of `value`; indicative: typical of this class of machine."),
    ] = Provenance.DECLARED
    smooth_error_m: Annotated[
        LengthOrZero | None,
        key("Smooth position error behind this misfit; none: `msde` is used."),
    ] = None
    smooth_degrees: Annotated[
        Degrees | None,
        key("Degrees of freedom of `smooth_error`; none: it is exact."),
    ] = None
    smooth_length_n: Annotated[
        Force | None,
        key("Correlation length of that error in force; none: the worst of many lengths counts."),
    ] = None
    deflection_force_n: Annotated[
        tuple[Force, ...],
        key("Forces of a table of the deflection δ_s(F), rising; replaces F/K_s."),
    ] = ()
    deflection_m: Annotated[
        tuple[Length, ...],
        key("Deflection at each of these forces, rising, 0 at 0 N."),
    ] = ()
    deflection_sigma_m: Annotated[
        tuple[LengthOrZero, ...],
        key("Standard uncertainty of each deflection, correlated over `smooth_length`."),
    ] = ()
    deflection_common: Annotated[
        Share,
        key("Relative standard uncertainty common to all rows of the table."),
    ] = 0.0
    across_m_per_n: Annotated[
        tuple[Compliance, ...],
        key("Axial travel per newton of lateral force, for the two other sensor axes."),
    ] = ()
    across_sigma_m_per_n: Annotated[
        tuple[ComplianceError, ...], key("Standard uncertainty of each of the two.")
    ] = ()
    across_correlation: Annotated[Correlation, key("Correlation of their errors.")] = 0.0
    at_share: Annotated[
        tuple[ShareAcross, ...],
        key("Lateral over axial force during the measurement of `value`, for the same two axes."),
    ] = ()
    share_reach: Annotated[
        Share,
        key("Largest distance from `at_share` of the shares behind `across`."),
    ] = 0.0
    stuck_ratio: Annotated[
        _StuckRatio | None,
        key("Largest stiffness with a stuck contact over `value`; none: 3.8 (arm), 1 (machine)."),
    ] = None
    measured_on: Annotated[Calendar | None, key("Day of the measurement.")] = None
    valid_until: Annotated[Calendar | None, key("Last day on which it may be used.")] = None
    pose: Annotated[Remark, key("Pose of the measurement; empty: any.")] = ""
    direction: Annotated[
        str,
        Choice(("", "+fx", "-fx", "+fy", "-fy", "+fz", "-fz")),
        key("Force axis of the measurement; empty: any."),
    ] = ""
    temperature_c: Annotated[Temperature | None, key("Temperature of the measurement.")] = None
    record: Annotated[
        FilePath | None,
        key("Record of `stepload calibrate`; its values replace those above."),
    ] = None
    policy: Annotated[
        RecordPolicy,
        key("Reaction to a record that is missing, expired or for other conditions."),
    ] = RecordPolicy.WARN
    simulated: Annotated[bool, INTERNAL] = False
    joints_rad: Annotated[tuple[float, ...], INTERNAL] = ()
    tcp_offset: Annotated[SixFloats | None, INTERNAL] = None
    validity_problem: Annotated[str, INTERNAL] = ""

    @model_validator(mode="after")
    def _of_the_value(self) -> "SystemStiffness":
        """Make of a σ that is written as a share one in the unit of the value."""
        if isinstance(self.sigma_n_per_m, Relative):
            if self.stiffness_n_per_m is DERIVED:
                message = "`sigma` is a share of a value that is not stated"
                raise refused(message, "give `value`, or `sigma` in its unit")
            put(self, "sigma_n_per_m", self.stiffness_n_per_m * self.sigma_n_per_m)
        return self


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Rig:
    """The rig. A profile's name, a path, or a mapping; `profile` with overrides is a mapping."""

    profile: Annotated[Name | None, key("Profile that gives every key not written here.")] = None
    name: Annotated[Name, key("Name of the rig in records.")]
    arm: Annotated[ArmSpec, key("The arm.")]
    force: Annotated[ForceSpec, key("The force sensor.")]
    displacement: Annotated[DisplacementSpec | None, key("A displacement gauge.")] = None
    second_force: Annotated[SecondForce, key("The second force channel.")] = Field(
        default_factory=SecondForce
    )
    system_stiffness: Annotated[SystemStiffness, key("Stiffness of the load path.")]
    loop_delay_s: Annotated[
        _LoopDelay | None,
        key("Measured delay of the control loop; none: sum of its parts."),
    ] = None
    common_force_error: Annotated[
        float,
        Quantity("%", 0.0, 0.5),
        key("Share by which all force channels may read too low together; taken off F_allowed."),
    ] = 0.05
    mechanical_fuse_n: Annotated[
        Force | None, key("Force at which a mechanical fuse in the load path opens.")
    ] = None
    plate_tilt_rad: Annotated[
        _Misalignment | None,
        key(
            "Largest plate tilt, used where `procedure.alignment` does not measure it; none: 3 deg."
        ),
    ] = None
    load_path_m: Annotated[
        LengthOrZero,
        key("Length between the arm's position measurement and the plate, for thermal expansion."),
    ] = 0.0
    thermal_expansion_per_k: Annotated[
        Expansion, key("Coefficient of thermal expansion of the load path.")
    ] = 0.0
    hazards_read_by: Annotated[
        Remark,
        key("Who has read the hazards and answers for the rig; required to move real hardware."),
    ] = ""
    hazards_read_on: Annotated[Calendar | None, key("Day on which they were read.")] = None
    wiring_checked_on: Annotated[
        Calendar | None,
        key("Day on which force axis, its sign and the approach direction were checked."),
    ] = None
    simulation: Annotated[Simulation, key("The simulated rig.")] = Field(default_factory=Simulation)
