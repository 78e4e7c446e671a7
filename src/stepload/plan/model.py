"""A plan, checked and in SI units: what the rest of stepload sees of the YAML text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from enum import StrEnum
from pathlib import Path

from stepload.contact.materials import Geometry, Material


@dataclass(frozen=True, slots=True)
class Payload:
    """What is pressed.

    `material` is the payload's, `plate` the counter body's. `roughness_m` is the equivalent rms
    roughness σ_eq, None for smooth. `declared_force_limit_n` stands where theory has none, and
    wins where it is lower than theory's F_c.
    """

    name: str
    geometry: Geometry
    material: Material
    plate: Material
    roughness_m: float | None
    micro_hardness_pa: float | None
    declared_force_limit_n: float | None


class Provenance(StrEnum):
    """Where a rig's system stiffness comes from."""

    MEASURED = "measured"
    """From a calibration record of this rig."""
    DECLARED = "declared"
    """Written into the plan by a person who answers for it."""
    INDICATIVE = "indicative"
    """A figure for this class of machine; not good enough for a result."""


class RecordPolicy(StrEnum):
    """What to do when the calibration record is missing, expired or for another pose."""

    WARN = "warn"
    REFUSE = "refuse"


@dataclass(frozen=True, slots=True)
class SystemStiffness:
    """K_s of the whole load path with the numbers that say how far to trust it (26).

    `sigma_n_per_m` is its standard uncertainty; `msde_m` the rms deformation misfit of the linear
    fit; `smooth_error_m` the smooth position error that leaves it (None: not known, `msde_m` has to
    stand in), estimated with `smooth_degrees` degrees of freedom (None: its size is taken as
    known); `damping_n_s_per_m` a lower bound. `record` is the calibration record it was read from,
    `simulated` whether that was made in a dry run. `validity_problem` says why the record may not
    be used as it stands ("" when it may).
    """

    stiffness_n_per_m: float
    sigma_n_per_m: float
    msde_m: float
    damping_n_s_per_m: float
    provenance: Provenance
    smooth_error_m: float | None = None
    smooth_degrees: float | None = None
    record: Path | None = None
    measured_on: date | None = None
    valid_until: date | None = None
    pose: str = ""
    direction: str = ""
    temperature_c: float | None = None
    simulated: bool = False
    policy: RecordPolicy = RecordPolicy.WARN
    validity_problem: str = ""


@dataclass(frozen=True, slots=True)
class DriverChoice:
    """A driver by entry-point name with its checked options (quantities in SI)."""

    name: str
    options: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class ArmSpec:
    """The arm and what the force budget needs to know of it.

    `max_push_n` is the largest force the arm can exert along the axis, `effective_mass_kg` the
    moving mass felt at the contact, `command_delay_s` from command to start of motion, `lag_s` the
    first-order lag of the servo, `lost_motion_m` backlash and stiction as travel,
    `position_resolution_m` the δ_Δ of the method. `model_tolerance_m` is R7's position band,
    `max_age_s` R3's age limit (None: the supervisor's own).
    """

    driver: DriverChoice
    rate_hz: float
    max_speed_m_s: float
    max_acceleration_m_s2: float
    max_push_n: float
    effective_mass_kg: float
    command_delay_s: float
    lag_s: float
    lost_motion_m: float
    position_resolution_m: float
    position_noise_m: float
    model_tolerance_m: float
    pose: str
    max_age_s: float | None = None


@dataclass(frozen=True, slots=True)
class ForceSpec:
    """The force sensor that the run is controlled and identified with.

    `axis` is "+fx" … "-fz": the wrench component, with its sign, that is positive when pressing.
    `gain_uncertainty` is relative (standard), `delay_s` from force to sample on the host,
    `max_age_s` R3's age limit (None: the supervisor's own).
    """

    driver: DriverChoice
    axis: str
    rate_hz: float
    range_n: float
    resolution_n: float
    noise_n: float
    delay_s: float
    gain_uncertainty: float
    drift_n_per_s: float
    max_age_s: float | None = None


@dataclass(frozen=True, slots=True)
class DisplacementSpec:
    """A gauge across the contact: takes K_s out of the chain."""

    driver: DriverChoice
    rate_hz: float
    resolution_m: float
    noise_m: float


class SecondForceSource(StrEnum):
    """What checks the force sensor."""

    NONE = "none"
    ARM = "arm"
    """The arm's own estimate (`ArmSample.force_n`)."""
    SENSOR = "sensor"
    """A second force sensor of its own."""


@dataclass(frozen=True, slots=True)
class SecondForce:
    """The cross-check R5: |F − F2| ≤ tolerance_n + tolerance_relative · F, kept for `time_s`."""

    source: SecondForceSource
    tolerance_n: float
    tolerance_relative: float
    time_s: float
    noise_n: float
    sensor: ForceSpec | None = None


@dataclass(frozen=True, slots=True)
class Simulation:
    """How the simulated rig differs from what the plan believes; hidden from the runner.

    `law` is "smooth", "rough" or "elastic_plastic". The factors multiply the believed payload K and
    K_s. `surface_error_m` moves the surface towards the arm when negative. `kinematic_error_m` is
    the sd of the smooth position error, `kinematic_length_n` its correlation in force.
    """

    seed: int
    law: str
    payload_factor: float
    stiffness_factor: float
    surface_error_m: float
    hysteresis: float
    kinematic_error_m: float
    kinematic_length_n: float
    force_drift_n_per_s: float


@dataclass(frozen=True, slots=True)
class Rig:
    """The whole rig. `loop_delay_s` is the measured upper bound T; None: sum of the parts.

    `mechanical_fuse_n` is the force at which a declared mechanical fuse opens.
    """

    name: str
    arm: ArmSpec
    force: ForceSpec
    displacement: DisplacementSpec | None
    second_force: SecondForce
    system_stiffness: SystemStiffness
    loop_delay_s: float | None
    mechanical_fuse_n: float | None
    simulation: Simulation


@dataclass(frozen=True, slots=True)
class Procedure:
    """The steps.

    The surface is expected `surface_distance_m` of travel from the start pose, known to
    ± `surface_uncertainty_m`; the search ends `search_distance_m` beyond the near edge of that
    band. `retract_m` is measured from the contact.
    `levels_n` are the load steps in rising order, the last is `top_force_n`.
    Force rises and falls at `load_rate_n_per_s` at the most, so that lag and damping stay small.
    `lift_off` says whether cycles part the contact (seating) or unload to `unload_fraction` of the
    top force (shakedown, run-in).
    """

    step_n: float
    top_force_n: float
    levels_n: tuple[float, ...]
    load_rate_n_per_s: float
    hold_s: float
    unload: bool
    cycles: int
    lift_off: bool
    unload_fraction: float
    touch_force_n: float
    touches: int
    surface_distance_m: float
    surface_uncertainty_m: float
    search_distance_m: float
    retract_m: float
    tare_s: float
    warm_up_s: float
    max_drift_n: float
    settle_timeout_s: float


@dataclass(frozen=True, slots=True)
class IdentifyPlan:
    """How data become a result. p, s, t are those of (29)–(32)."""

    kind: str
    secant_force_n: float
    resolution_multiple_p: float
    compensation_quality_s: float
    accuracy_t: float
    accept_unidentifiable: str
    temperature_c: float | None


@dataclass(frozen=True, slots=True)
class RecordPlan:
    """Where the record goes: `directory` is below the working directory unless absolute."""

    directory: Path
    notes: str
    operator: str


@dataclass(frozen=True, slots=True)
class SourceFile:
    """One file the plan was made from; goes into the record."""

    name: str
    text: str
    sha256: str


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything about one experiment, complete and checked; `sources[0]` is the plan itself."""

    name: str
    path: Path
    payload: Payload
    rig: Rig
    procedure: Procedure
    identify: IdentifyPlan
    record: RecordPlan
    sources: tuple[SourceFile, ...]
