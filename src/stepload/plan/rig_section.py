"""The keys of a rig: arm, sensors, system stiffness, and what the simulated rig does otherwise."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from stepload.plan.fields import (
    Calendar,
    Choice,
    Damping,
    Delay,
    Duration,
    FilePath,
    Force,
    ForceOrZero,
    Length,
    LengthOrZero,
    Name,
    Number,
    Quantity,
    Rate,
    Remark,
    Share,
    Stiffness,
    StiffnessError,
    Temperature,
)
from stepload.plan.payload_section import Section

_Age = Annotated[float, Quantity("s", 0.002, 2.0)]
_Drift = Annotated[float, Quantity("N/s", 0.0, 100.0)]
_Factor = Annotated[float, Number(0.01, 100.0)]
Degrees = Annotated[float, Number(1.0, 1e6)]
Axis = Annotated[str, Choice(("+fx", "-fx", "+fy", "-fy", "+fz", "-fz"))]


class DriverSection(Section):
    """What every device of the rig has."""

    driver: Name = Field(description="Name of an installed driver; `stepload drivers` lists them.")
    options: dict[str, Any] = Field(
        default_factory=dict,
        description="Options of the driver, checked against what the driver declares.",
    )
    rate: Rate = Field(description="Samples per second.")


class ArmSection(DriverSection):
    """The arm, or the driven axis of a testing machine."""

    max_speed: Annotated[float, Quantity("m/s", 0.0, 2.0, above=True)] = Field(
        description="Speed never to be exceeded."
    )
    max_acceleration: Annotated[float, Quantity("m/s^2", 0.0, 100.0, above=True)] = Field(
        description="Deceleration that the arm reaches when it stops."
    )
    max_push: Force = Field(description="Largest force the arm can exert along the axis.")
    effective_mass: Annotated[float, Quantity("kg", 0.0, 1e4, above=True)] = Field(
        description="Moving mass felt at the contact."
    )
    command_delay: Delay = Field(description="From a command to the start of motion.")
    lag: Delay = Field(description="First-order lag of the servo.")
    lost_motion: LengthOrZero = Field(default=0.0, description="Backlash and stiction, as travel.")
    position_resolution: Length = Field(description="Resolution δ_Δ of the measured travel (29).")
    position_noise: LengthOrZero = Field(
        default=0.0, description="Standard deviation of the measured travel at rest."
    )
    model_tolerance: Length = Field(
        default=5e-5, description="How far the arm may be from where its commands put it (rule R7)."
    )
    max_age: _Age | None = Field(
        default=None,
        description="Older data stop the run (rule R3); default: 12 ms, or four samples if longer.",
    )
    pose: Remark = Field(
        default="", description="Name of the pose; compared with the calibration record."
    )


class ForceSection(DriverSection):
    """The force sensor that the run is controlled and identified with."""

    axis: Axis = Field(
        default="+fz", description="Wrench component, with the sign that is positive when pressing."
    )
    range: Force = Field(description="Rated force.")
    resolution: Force = Field(description="Smallest step of the reading.")
    noise: Force = Field(description="Standard deviation of the reading at rest.")
    delay: Delay = Field(description="From force to sample on the host.")
    gain_uncertainty: Share = Field(
        default=0.01, description="Relative standard uncertainty of the gain."
    )
    drift: _Drift = Field(default=0.0, description="Largest drift of the zero.")
    max_age: _Age | None = Field(
        default=None,
        description="Older data stop the run (rule R3); default: 12 ms, or four samples if longer.",
    )


class DisplacementSection(DriverSection):
    """A gauge across the contact: takes the system stiffness out of the chain."""

    resolution: Length = Field(description="Smallest step of the reading.")
    noise: LengthOrZero = Field(
        default=0.0, description="Standard deviation of the reading at rest."
    )


class SecondForceSection(Section):
    """The second force channel and how far it may differ (rule R5)."""

    source: Annotated[str, Choice(("none", "arm", "sensor"))] = Field(
        default="none", description="none, the arm's own estimate, or a second force sensor."
    )
    tolerance: ForceOrZero = Field(default=0.0, description="Allowed difference, absolute part.")
    tolerance_relative: Share = Field(
        default=0.0, description="Allowed difference, share of the force."
    )
    time: Duration = Field(default=0.02, description="How long the difference may last.")
    noise: ForceOrZero = Field(default=0.0, description="Standard deviation of the second channel.")
    sensor: ForceSection | None = Field(
        default=None, description="The second sensor, for source sensor."
    )


class StiffnessSection(Section):
    """System stiffness K_s of the whole load path (26): a value with its error, or a record."""

    value: Stiffness | None = Field(default=None, description="K_s; with `sigma`.")
    sigma: StiffnessError | None = Field(
        default=None, description="Standard uncertainty of `value`."
    )
    damping: Damping = Field(default=0.0, description="Damping C_s, a lower bound.")
    msde: LengthOrZero = Field(
        default=0.0, description="Rms deformation misfit of the linear fit (26)."
    )
    smooth_error: LengthOrZero | None = Field(
        default=None,
        description="Smooth position error that leaves this misfit, with the part that the line "
        "absorbs; none: `msde` stands in.",
    )
    smooth_degrees: Degrees | None = Field(
        default=None,
        description="Degrees of freedom `smooth_error` was estimated with; none: it is taken as "
        "known.",
    )
    provenance: Annotated[str, Choice(("measured", "declared", "indicative"))] = Field(
        default="declared",
        description="Where `value` comes from; indicative: a figure for this class of machine.",
    )
    measured_on: Calendar | None = Field(default=None, description="Day of the measurement.")
    valid_until: Calendar | None = Field(
        default=None, description="Last day on which it may be used."
    )
    pose: Remark = Field(default="", description="Pose it was measured in; empty: any.")
    direction: Annotated[str, Choice(("", "+fx", "-fx", "+fy", "-fy", "+fz", "-fz"))] = Field(
        default="", description="Force axis it was measured along; empty: any."
    )
    temperature: Temperature | None = Field(
        default=None, description="Temperature it was measured at."
    )
    record: FilePath | None = Field(
        default=None,
        description="Calibration record written by `stepload calibrate`; its values replace the "
        "ones above, which then only stand in while it is missing.",
    )
    policy: Annotated[str, Choice(("warn", "refuse"))] = Field(
        default="warn",
        description="What to do when the record is missing, expired, or for another rig, pose, "
        "direction or temperature.",
    )


class SimulationSection(Section):
    """How the simulated rig differs from what the plan believes; only dry runs use it."""

    seed: Annotated[int, Number(0, 2**31 - 1, integer=True)] = Field(
        default=1, description="Seed of everything random."
    )
    law: Annotated[str, Choice(("smooth", "rough", "elastic_plastic"))] = Field(
        default="smooth", description="Contact law of the simulated payload."
    )
    payload_factor: _Factor = Field(
        default=1.0, description="True payload stiffness K over believed K."
    )
    stiffness_factor: _Factor = Field(
        default=1.0, description="True system stiffness over believed K_s."
    )
    surface_error: Annotated[float, Quantity("m", -0.1, 0.1)] = Field(
        default=0.0, description="True surface minus expected surface; negative: nearer."
    )
    hysteresis: Annotated[float, Quantity("%", 0.0, 0.9)] = Field(
        default=0.0, description="Share of the loading work lost in a cycle."
    )
    kinematic_error: LengthOrZero = Field(
        default=0.0, description="Standard deviation of the smooth error of the measured travel."
    )
    kinematic_length: Force = Field(
        default=50.0, description="Force over which that error stays correlated."
    )
    force_drift: Annotated[float, Quantity("N/s", -10.0, 10.0)] = Field(
        default=0.0, description="True drift of the force zero."
    )


class RigSection(Section):
    """The rig. A profile's name, a path, or a mapping; `profile` with overrides is a mapping."""

    profile: Name | None = Field(
        default=None, description="Profile that gives every key which is not written here."
    )
    name: Name = Field(description="What the rig is called in records.")
    arm: ArmSection = Field(description="The arm.")
    force: ForceSection = Field(description="The force sensor.")
    displacement: DisplacementSection | None = Field(
        default=None, description="A displacement gauge."
    )
    second_force: SecondForceSection = Field(
        default_factory=SecondForceSection, description="The second force channel."
    )
    system_stiffness: StiffnessSection = Field(description="Stiffness of the load path.")
    loop_delay: Delay | None = Field(
        default=None,
        description="Measured delay of the whole control loop; none: sum of its parts.",
    )
    mechanical_fuse: Force | None = Field(
        default=None, description="Force at which a mechanical fuse in the load path opens."
    )
    simulation: SimulationSection = Field(
        default_factory=SimulationSection, description="The simulated rig."
    )
