"""The declaration of a rig: arm, sensors, system stiffness and the simulated rig."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Annotated

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from stepload.plan.quantities import (
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
from stepload.plan.sections import DERIVED, INTERNAL, SECTION, key, put
from stepload.plan.simulation import Simulation
from stepload.rig.samples import SixFloats

_Age = Annotated[float, Quantity("s", 0.002, 2.0)]
_Drift = Annotated[float, Quantity("N/s", 0.0, 100.0)]
_Misalignment = Annotated[float, Quantity("rad", 0.0, 0.175)]
_StuckRatio = Annotated[float, number(1.0, 100.0)]
_AXIS = (
    "Wrench component, with the sign that is positive when pressing. A push by hand on the tool, "
    "as the plate will push, tells it."
)
_LoopDelay = Annotated[float, Quantity("s", 1e-5, 10.0)]
"""No loop is quicker than one sample of the fastest arm."""
_CROOKED = (
    "Largest departure of the reading from a straight line, as a share of the largest force "
    "pressed; a data sheet states it of the full scale; default: 1.5 % is assumed."
)
_OLDER = "Older data stop the run (rule R3); default: 12 ms, or four samples if longer."


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
        key("Options of the driver, checked against what the driver declares."),
    ] = Field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class ArmSpec(DeviceSpec):
    """The arm, or the driven axis of a testing machine."""

    rate_hz: Annotated[Rate, key("Samples per second.")]
    max_speed_m_s: Annotated[
        float,
        Quantity("m/s", 0.0, 2.0, above=True),
        key("Speed never to be exceeded."),
    ]
    max_acceleration_m_s2: Annotated[
        float,
        Quantity("m/s^2", 0.0, 100.0, above=True),
        key("Deceleration that the arm reaches when it stops."),
    ]
    max_push_n: Annotated[Force, key("Largest force the arm can exert along the axis.")]
    effective_mass_kg: Annotated[
        float,
        Quantity("kg", 0.0, 1e4, above=True),
        key("Moving mass felt at the contact."),
    ]
    command_delay_s: Annotated[Delay, key("From a command to the start of motion.")]
    lag_s: Annotated[Delay, key("First-order lag of the servo.")]
    lost_motion_m: Annotated[LengthOrZero, key("Backlash and stiction, as travel.")] = 0.0
    position_resolution_m: Annotated[Length, key("Resolution δ_Δ of the measured travel (29).")]
    position_noise_m: Annotated[
        LengthOrZero, key("Standard deviation of the measured travel at rest.")
    ] = 0.0
    model_tolerance_m: Annotated[
        Length,
        key(
            "How far the arm may be from where its commands put it (rule R7), and before the first"
            " command from where its controller holds it (`held`)."
        ),
    ] = 5e-5
    max_age_s: Annotated[_Age | None, key(_OLDER)] = None
    pose: Annotated[Remark, key("Name of the pose; compared with the calibration record.")] = ""
    lateral_stiffness_n_per_m: Annotated[
        Stiffness | None,
        key(
            "Largest stiffness across the approach that is believed possible, for touches on a "
            "circle and for nulling; none: three times the largest along it."
        ),
    ] = None
    structure: Annotated[
        Structure,
        key(
            "arm: a serial arm, which gives way sideways when it is pressed; machine: a guided "
            "axis. Of an arm friction at the contact changes the system stiffness."
        ),
    ] = Structure.ARM
    kinematics: Annotated[
        PathText | None,
        key(
            "How its joints follow each other, for `stepload pose`: an arm that comes with "
            "stepload, or a file of its DH parameters; none: a machine of one axis."
        ),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class ForceSpec(DeviceSpec):
    """The force sensor that the run is controlled and identified with."""

    profile: Annotated[
        Name | None,
        key(
            "Data sheet of the sensor, `stepload profiles` lists them: driver and figures, to "
            "which `axis` and the address in `options` are added."
        ),
    ] = None
    rate_hz: Annotated[Rate, key("Samples per second.")]
    axis: Annotated[Axis, key(_AXIS)]
    range_n: Annotated[Force, key("Rated force.")]
    resolution_n: Annotated[Force, key("Smallest step of the reading.")]
    noise_n: Annotated[Force, key("Standard deviation of the reading at rest.")]
    delay_s: Annotated[Delay, key("From force to sample on the host.")]
    gain_uncertainty: Annotated[Share, key("Relative standard uncertainty of the gain.")] = 0.01
    nonlinearity: Annotated[Share | None, key(_CROOKED)] = None
    drift_n_per_s: Annotated[
        _Drift,
        key(
            "Largest rate at which the zero moves; `stepload doctor` measures an upper bound. With "
            "one force channel this times the longest time under load, and up to the touch force "
            "for the approach, is taken off the force that is allowed, where it is more than "
            "`max_drift`."
        ),
    ] = 0.0
    max_age_s: Annotated[_Age | None, key(_OLDER)] = None
    components: Annotated[
        str,
        Choice(("six", "one")),
        key(
            "six: three forces and three torques; one: a load cell. On a serial arm a load cell "
            "does not see a payload being dragged sideways, which then counts in F_allowed."
        ),
    ] = "six"
    rated_force_n: Annotated[
        tuple[Force, ...],
        key("Rated force of each axis of the sensor, three: fx, fy, fz; none: not watched."),
    ] = ()
    rated_torque_n_m: Annotated[
        tuple[Torque, ...],
        key("Rated torque about each axis of the sensor, three: tx, ty, tz; none: not watched."),
    ] = ()
    lever_m: Annotated[
        Length | None,
        key(
            "From the sensor's origin to the contact, along the pressing axis. With it the torques "
            "tell where the plate is touched."
        ),
    ] = None
    misalignment_rad: Annotated[
        _Misalignment | None,
        key(
            "Largest angle between the sensor's pressing axis and the direction of the press; "
            "none: 2 deg for an arm, 0 for a machine."
        ),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class DisplacementSpec(DeviceSpec):
    """A gauge across the contact: takes the system stiffness out of the chain."""

    rate_hz: Annotated[Rate, key("Samples per second.")]
    resolution_m: Annotated[Length, key("Smallest step of the reading.")]
    noise_m: Annotated[LengthOrZero, key("Standard deviation of the reading at rest.")] = 0.0
    offset_m: Annotated[
        LengthOrZero | None,
        key(
            "How far beside the contact it measures; an arm turns when it is pressed, and a gauge "
            "off the axis reads that too. None: 20 mm for an arm; a machine does not turn."
        ),
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
        key(
            "Allowed difference, absolute part; more where the second zero and what the stated "
            "drift may come to in a cycle are more."
        ),
    ] = 0.0
    tolerance_relative: Annotated[Share, key("Allowed difference, share of the force.")] = 0.0
    time_s: Annotated[Duration, key("How long the difference may last.")] = 0.02
    noise_n: Annotated[
        ForceOrZero,
        key(
            "Standard deviation of the second channel at rest. What it hides of a difference is "
            "taken off F_allowed; where the tare finds half as much again, that counts."
        ),
    ] = 0.0
    sensor: Annotated[ForceSpec | None, key("The second sensor, for source sensor.")] = None
    zero_error_n: Annotated[
        ForceOrZero | None,
        key(
            "How far the zero of a sound second channel may be off while the payload is pressed. "
            "Taken off F_allowed. None: half of `tolerance`, as much as a look at its zero accepts."
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
        key("Where `value` comes from; indicative: a figure for this class of machine."),
    ] = Provenance.DECLARED
    smooth_error_m: Annotated[
        LengthOrZero | None,
        key(
            "Smooth position error that leaves this misfit, with the part that the line absorbs; "
            "none: `msde` stands in."
        ),
    ] = None
    smooth_degrees: Annotated[
        Degrees | None,
        key("Degrees of freedom `smooth_error` was estimated with; none: it is taken as known."),
    ] = None
    smooth_length_n: Annotated[
        Force | None,
        key(
            "Force over which that error stays correlated; none: every length from a twelfth to "
            "two thirds of the peak force is carried through, and the worst counts."
        ),
    ] = None
    deflection_force_n: Annotated[
        tuple[Force, ...],
        key(
            "Forces of a table of the system's deflection δ_s(F), rising. Subtracted in place of "
            "F/K_s."
        ),
    ] = ()
    deflection_m: Annotated[
        tuple[Length, ...],
        key("Deflection at each of these forces, rising, 0 at 0 N."),
    ] = ()
    deflection_sigma_m: Annotated[
        tuple[LengthOrZero, ...],
        key("Standard uncertainty of each; neighbours err alike, as far apart as `smooth_length`."),
    ] = ()
    deflection_common: Annotated[
        Share,
        key("Relative standard uncertainty that all rows of the table have in common."),
    ] = 0.0
    across_m_per_n: Annotated[
        tuple[Compliance, ...],
        key(
            "Travel along the axis per newton across it, for the sensor's two other axes in the "
            "order x, y, z: two numbers; the travel is corrected by them."
        ),
    ] = ()
    across_sigma_m_per_n: Annotated[
        tuple[ComplianceError, ...], key("Standard uncertainty of each of the two.")
    ] = ()
    across_correlation: Annotated[Correlation, key("How the errors of the two correlate.")] = 0.0
    at_share: Annotated[
        tuple[ShareAcross, ...],
        key(
            "Force across over force along the axis (positive when pressing) at which `value` and "
            "the table were measured, for the same two axes, with sign: two numbers."
        ),
    ] = ()
    share_reach: Annotated[
        Share,
        key("How far from `at_share` the shares went from which `across` was measured."),
    ] = 0.0
    stuck_ratio: Annotated[
        _StuckRatio | None,
        key(
            "Largest stiffness while friction holds the tip sideways, over `value`: what bounds "
            "force counts with it; none: 1 for a machine, 3.8 for an arm."
        ),
    ] = None
    measured_on: Annotated[Calendar | None, key("Day of the measurement.")] = None
    valid_until: Annotated[Calendar | None, key("Last day on which it may be used.")] = None
    pose: Annotated[Remark, key("Pose it was measured in; empty: any.")] = ""
    direction: Annotated[
        str,
        Choice(("", "+fx", "-fx", "+fy", "-fy", "+fz", "-fz")),
        key("Force axis it was measured along; empty: any."),
    ] = ""
    temperature_c: Annotated[Temperature | None, key("Temperature it was measured at.")] = None
    record: Annotated[
        FilePath | None,
        key(
            "Calibration record written by `stepload calibrate`; its values replace the ones "
            "above, which then only stand in while it is missing."
        ),
    ] = None
    policy: Annotated[
        RecordPolicy,
        key(
            "What to do when the record is missing, expired, or for another rig, pose, direction "
            "or temperature."
        ),
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

    profile: Annotated[
        Name | None, key("Profile that gives every key which is not written here.")
    ] = None
    name: Annotated[Name, key("What the rig is called in records.")]
    arm: Annotated[ArmSpec, key("The arm.")]
    force: Annotated[ForceSpec, key("The force sensor.")]
    displacement: Annotated[DisplacementSpec | None, key("A displacement gauge.")] = None
    second_force: Annotated[SecondForce, key("The second force channel.")] = Field(
        default_factory=SecondForce
    )
    system_stiffness: Annotated[SystemStiffness, key("Stiffness of the load path.")]
    loop_delay_s: Annotated[
        _LoopDelay | None,
        key("Measured delay of the whole control loop; none: sum of its parts."),
    ] = None
    common_force_error: Annotated[
        float,
        Quantity("%", 0.0, 0.5),
        key(
            "Share by which all force channels may read too little together, for no check sees it:"
            " one calibration weight, one lever arm, tilt, temperature. Taken off F_allowed."
        ),
    ] = 0.05
    mechanical_fuse_n: Annotated[
        Force | None, key("Force at which a mechanical fuse in the load path opens.")
    ] = None
    plate_tilt_rad: Annotated[
        _Misalignment | None,
        key(
            "Largest angle by which the plate may be tilted against the press, where no"
            " `procedure.alignment` measures it; none: 3 deg."
        ),
    ] = None
    load_path_m: Annotated[
        LengthOrZero,
        key("Length between where the arm measures its travel and the plate; grows when heated."),
    ] = 0.0
    thermal_expansion_per_k: Annotated[
        Expansion, key("Coefficient of thermal expansion of the load path.")
    ] = 0.0
    hazards_read_by: Annotated[
        Remark,
        key(
            "Who has read the hazards (docs/risk-assessment.md) and answers for the rig; without"
            " it, and its day, nothing moves outside a dry run."
        ),
    ] = ""
    hazards_read_on: Annotated[Calendar | None, key("Day on which they were read.")] = None
    wiring_checked_on: Annotated[
        Calendar | None,
        key(
            "Day on which axis and sign of the force, and the direction of the approach, were"
            " checked; `run` asks once per rig."
        ),
    ] = None
    simulation: Annotated[Simulation, key("The simulated rig.")] = Field(default_factory=Simulation)
