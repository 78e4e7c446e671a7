"""The declaration of the simulated rig: how the truth of a dry run differs from the plan."""

from typing import Annotated

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import (
    Choice,
    Duration,
    Force,
    ForceOrZero,
    Length,
    LengthOrZero,
    Pressure,
    Quantity,
    Share,
    ShareAcross,
    Stiffness,
    number,
)
from stepload.declaration.sections import SECTION, key
from stepload.plan.mounting import Mounting

_Factor = Annotated[float, number(0.01, 100.0)]
_Bend = Annotated[float, Quantity("%", -0.1, 0.1)]


@dataclass(frozen=True, slots=True, config=SECTION)
class Simulation:
    """How the simulated rig differs from what the plan believes; only dry runs use it."""

    seed: Annotated[int, number(0, 2**31 - 1), key("Seed of all random numbers.")] = 1
    law: Annotated[
        str,
        Choice(("declared", "smooth", "rough", "elastic_plastic")),
        key("Contact law; declared: rough or plastic where the payload's data say so."),
    ] = "declared"
    payload_factor: Annotated[_Factor, key("True payload stiffness over the planned one.")] = 1.0
    stiffness_factor: Annotated[_Factor, key("True system stiffness over K_s.")] = 1.0
    surface_error_m: Annotated[
        float,
        Quantity("m", -0.1, 0.1),
        key("True minus expected surface; negative: nearer."),
    ] = 0.0
    hysteresis: Annotated[
        float,
        Quantity("%", 0.0, 0.9),
        key("Share of the loading work lost in a cycle."),
    ] = 0.0
    kinematic_error_m: Annotated[
        LengthOrZero,
        key("Standard deviation of the smooth error of the measured travel."),
    ] = 0.0
    kinematic_length_n: Annotated[Force, key("Correlation length of that error in force.")] = 50.0
    force_drift_n_per_s: Annotated[
        float, Quantity("N/s", -10.0, 10.0), key("True drift of the force zero.")
    ] = 0.0
    roughness_m: Annotated[
        LengthOrZero | None, key("True rms roughness σ_eq; none: the payload's.")
    ] = None
    micro_hardness_pa: Annotated[
        Pressure | None,
        key("True micro-hardness; none: the payload's, or five times the lower yield strength."),
    ] = None
    yield_force_n: Annotated[
        Force | None,
        key("True elastic limit of a sphere (14); none: as `law` says."),
    ] = None
    creep: Annotated[
        Share,
        key("Final creep at constant force, share of the deformation."),
    ] = 0.0
    creep_time_s: Annotated[Duration, key("Shortest time constant of the creep.")] = 5.0
    creep_decades: Annotated[
        int,
        number(0, 6),
        key("Decades of time constants above `creep_time`; 0: one time constant."),
    ] = 0
    seating_m: Annotated[
        LengthOrZero,
        key("Travel of the payload's one-time seating."),
    ] = 0.0
    seating_force_n: Annotated[Force, key("Force at which seating is complete.")] = 100.0
    slip_m: Annotated[
        LengthOrZero,
        key("Lost motion behind the measured travel after a reversal."),
    ] = 0.0
    drift_m_s: Annotated[
        float,
        Quantity("m/s", -1e-4, 1e-4),
        key("Growth of the load path towards the plate, not measured by the arm."),
    ] = 0.0
    pad_stiffness_n_per_m: Annotated[
        Stiffness | None,
        key("Stiffness of a soft pad over the payload; none: no pad."),
    ] = None
    pad_depth_m: Annotated[LengthOrZero, key("Largest compression of the pad.")] = 0.0
    stop_depth_m: Annotated[
        Length | None,
        key("Deformation at which a hidden stop begins to carry; none: no stop."),
    ] = None
    stop_stiffness_n_per_m: Annotated[Stiffness, key("Stiffness of that stop.")] = 1e9
    adhesion_n: Annotated[ForceOrZero, key("Adhesive force of the contact.")] = 0.0
    adhesion_law: Annotated[
        str,
        Choice(("dmt", "jkr")),
        key("dmt: the force less `adhesion`; jkr: a soft smooth sphere."),
    ] = "dmt"
    softness: Annotated[
        float,
        Quantity("%", 0.0, 10.0),
        key("Extra compliance of the load path at zero force, as a share."),
    ] = 0.0
    softness_force_n: Annotated[Force, key("Force over which that share falls by 1/e.")] = 100.0
    lateral: Annotated[
        ShareAcross,
        key("Lateral force, share of the axial force."),
    ] = 0.0
    lateral_coupling: Annotated[
        ShareAcross,
        key("Axial travel of the tip under lateral force, over F/K_s."),
    ] = 0.3
    cross_talk: Annotated[
        float,
        Quantity("%", -1.0, 1.0),
        key("Share of the lateral force in the axial reading."),
    ] = 0.0
    sensor_quadratic: Annotated[
        _Bend,
        key("Sensor error that grows as F², share of full scale."),
    ] = 0.0
    sensor_cubic: Annotated[
        _Bend,
        key("Sensor error that grows as F³, share of full scale."),
    ] = 0.0
    mount: Annotated[
        Mounting | None,
        key("Six axes: lateral compliance, friction, tilt; none: the axial motion only."),
    ] = None
