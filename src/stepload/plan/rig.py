"""The declaration of a rig: arm, sensors, system stiffness and the simulated rig."""

from collections.abc import Iterator, Mapping, Sequence
from enum import StrEnum
from typing import Annotated

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from stepload.contact.lateral_checks import across_problem
from stepload.declaration import quantities as q
from stepload.declaration.sections import (
    CHECKED,
    DERIVED,
    INTERNAL,
    SECTION,
    Contradiction,
    put,
)
from stepload.estimators.deflection_rows import table_problem, upper_stiffness_n_per_m
from stepload.plan.simulation import Simulation
from stepload.rig.samples import SixFloats
from stepload.units import format_quantity

_Age = Annotated[float, q.Quantity("s", 0.002, 2.0)]
_Drift = Annotated[float, q.Quantity("N/s", 0.0, 100.0)]
_Misalignment = Annotated[float, q.Quantity("rad", 0.0, 0.175)]
_StuckRatio = Annotated[float, q.number(1.0, 100.0)]
_LoopDelay = Annotated[float, q.Quantity("s", 1e-5, 10.0)]
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
    """Largest lateral stiffness, for alignment and nulling; none: three times the largest axial
    one.
    """
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

    stiffness_n_per_m: Annotated[q.Stiffness, Field(alias="value")] = DERIVED
    """K_s; with `sigma`."""
    sigma_n_per_m: q.StiffnessSigma = DERIVED
    """Standard uncertainty of `value`."""
    msde_m: q.LengthOrZero = 0.0
    """Rms deformation misfit of the linear fit (26)."""
    damping_n_s_per_m: q.Damping = 0.0
    """Damping C_s, a lower bound."""
    provenance: Provenance = Provenance.DECLARED
    """Origin of `value`; indicative: typical of this class of machine."""
    smooth_error_m: q.LengthOrZero | None = None
    """Smooth position error behind this misfit; none: `msde` is used."""
    smooth_degrees: q.Degrees | None = None
    """Degrees of freedom of `smooth_error`; none: it is exact."""
    smooth_length_n: q.Force | None = None
    """Correlation length of that error in force; none: the worst of many lengths counts."""
    deflection_force_n: tuple[q.Force, ...] = ()
    """Forces of a table of the deflection δ_s(F), rising; replaces F/K_s."""
    deflection_m: tuple[q.Length, ...] = ()
    """Deflection at each of these forces, rising, 0 at 0 N."""
    deflection_sigma_m: tuple[q.LengthOrZero, ...] = ()
    """Standard uncertainty of each deflection, correlated over `smooth_length`."""
    deflection_common: q.Share = 0.0
    """Relative standard uncertainty common to all rows of the table."""
    across_m_per_n: tuple[q.Compliance, ...] = ()
    """Axial travel per newton of lateral force, for the two other sensor axes."""
    across_sigma_m_per_n: tuple[q.ComplianceError, ...] = ()
    """Standard uncertainty of each of the two."""
    across_correlation: q.Correlation = 0.0
    """Correlation of their errors."""
    at_share: tuple[q.ShareAcross, ...] = ()
    """Lateral over axial force during the measurement of `value`, for the same two axes."""
    share_reach: q.Share = 0.0
    """Largest distance from `at_share` of the shares behind `across`."""
    stuck_ratio: _StuckRatio | None = None
    """Largest stiffness with a stuck contact over `value`; none: 3.8 (arm), 1 (machine)."""
    measured_on: q.Calendar | None = None
    """Day of the measurement."""
    valid_until: q.Calendar | None = None
    """Last day on which it may be used."""
    pose: q.Remark = ""
    """Pose of the measurement; empty: any."""
    direction: Annotated[str, q.Choice(("", "+fx", "-fx", "+fy", "-fy", "+fz", "-fz"))] = ""
    """Force axis of the measurement; empty: any."""
    temperature_c: q.Temperature | None = None
    """Temperature of the measurement."""
    record: q.FilePath | None = None
    """Record of `stepload calibrate`; its values replace those above."""
    policy: RecordPolicy = RecordPolicy.WARN
    """Reaction to a record that is missing, expired or for other conditions."""
    simulated: Annotated[bool, INTERNAL] = False
    joints_rad: Annotated[tuple[float, ...], INTERNAL] = ()
    tcp_offset: Annotated[SixFloats | None, INTERNAL] = None
    validity_problem: Annotated[str, INTERNAL] = ""

    @model_validator(mode="after")
    def _of_the_value(self) -> "SystemStiffness":
        """Make of a σ that is written as a share one in the unit of the value."""
        if isinstance(self.sigma_n_per_m, q.Relative):
            if self.stiffness_n_per_m is DERIVED:
                message = "`sigma` is a share of a value that is not stated"
                raise q.refused(message, "give `value`, or `sigma` in its unit")
            put(self, "sigma_n_per_m", self.stiffness_n_per_m * self.sigma_n_per_m)
        return self

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        value, sigma = self.stiffness_n_per_m, self.sigma_n_per_m
        first, last = self.measured_on, self.valid_until
        rows = self.deflection_force_n, self.deflection_m, self.deflection_sigma_m
        if value is DERIVED and self.record is None:
            hint = "give value and sigma, or the record of a calibration"
            yield "", "neither `value` nor `record`", hint
        elif (value is DERIVED) != (sigma is DERIVED):
            hint = "a stiffness without its uncertainty cannot be compensated"
            yield "", "`value` and `sigma` belong together", hint
        elif value is not DERIVED and sigma >= value:
            yield (
                "sigma",
                f"uncertainty {format_quantity(sigma, 'N/m')} is not below the stiffness "
                f"{format_quantity(value, 'N/m')}",
                "a stiffness known so badly is not known: calibrate it",
            )
        elif value is not DERIVED and (problem := disagreement(value, sigma, *rows)):
            hint = "look for a wrong prefix (µm, mm), or give the table that belongs to this value"
            yield "deflection", problem, hint
        if first and last and last < first:
            yield "valid_until", f"{last} is before measured_on {first}", "check the two dates"
        if any(rows) and (problem := table_problem(*rows)):
            yield (
                "deflection_force",
                f"table of the deflection: {problem}",
                "give deflection_force, deflection and deflection_sigma of every row, rising",
            )
        if problem := across_problem(self.across_m_per_n, self.across_sigma_m_per_n, self.at_share):
            yield (
                "across",
                f"lateral force: {problem}",
                "two numbers each, for the sensor's two other axes in the order x, y, z; `stepload "
                "calibrate` measures them",
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


TABLE_AGREES = 0.1
"""Largest relative difference between the table of the deflection and the stiffness beside it."""
Numbers = Sequence[float]


def disagreement(
    stiffness_n_per_m: float, sigma_n_per_m: float, force_n: Numbers, deflection_m: Numbers,
    deflection_sigma_m: Numbers,
) -> str:  # fmt: skip
    """Why the stated K_s does not belong to this table, which must be sound; "" where it does."""
    if not any((force_n, deflection_m)) or table_problem(force_n, deflection_m, deflection_sigma_m):
        return ""
    slope = upper_stiffness_n_per_m(force_n, deflection_m)
    allowed = max(TABLE_AGREES, 3.0 * sigma_n_per_m / stiffness_n_per_m)
    if abs(slope / stiffness_n_per_m - 1.0) <= allowed:
        return ""
    return (
        f"the table has a stiffness of {format_quantity(slope, 'N/m')} above 40 % of its forces, "
        f"value is {format_quantity(stiffness_n_per_m, 'N/m')}"
    )
