"""The declaration of the simulated rig: how the truth of a dry run differs from the plan."""

from typing import Annotated

from pydantic.dataclasses import dataclass

from stepload.plan.mounting import Mounting
from stepload.plan.quantities import (
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
from stepload.plan.sections import SECTION, key

_Factor = Annotated[float, number(0.01, 100.0)]
_Bend = Annotated[float, Quantity("%", -0.1, 0.1)]


@dataclass(frozen=True, slots=True, config=SECTION)
class Simulation:
    """How the simulated rig differs from what the plan believes; only dry runs use it."""

    seed: Annotated[int, number(0, 2**31 - 1), key("Seed of everything random.")] = 1
    law: Annotated[
        str,
        Choice(("declared", "smooth", "rough", "elastic_plastic")),
        key(
            "Contact law of the simulated payload; declared: rough (10) where the payload states "
            "a roughness, plastic beyond theory's elastic limit (14)."
        ),
    ] = "declared"
    payload_factor: Annotated[_Factor, key("True payload stiffness K over believed K.")] = 1.0
    stiffness_factor: Annotated[_Factor, key("True system stiffness over believed K_s.")] = 1.0
    surface_error_m: Annotated[
        float,
        Quantity("m", -0.1, 0.1),
        key("True surface minus expected surface; negative: nearer."),
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
    kinematic_length_n: Annotated[Force, key("Force over which that error stays correlated.")] = (
        50.0
    )
    force_drift_n_per_s: Annotated[
        float, Quantity("N/s", -10.0, 10.0), key("True drift of the force zero.")
    ] = 0.0
    roughness_m: Annotated[
        LengthOrZero | None, key("True rms roughness σ_eq; none: the payload's.")
    ] = None
    micro_hardness_pa: Annotated[
        Pressure | None,
        key(
            "True micro-hardness; none: the payload's, or else five times the yield strength of "
            "the body that yields first."
        ),
    ] = None
    yield_force_n: Annotated[
        Force | None,
        key("True force beyond which a sphere flows plastically (14); none: as `law` says."),
    ] = None
    creep: Annotated[
        Share,
        key("Creep of the contact under constant force in the end, share of its deformation."),
    ] = 0.0
    creep_time_s: Annotated[Duration, key("Shortest time constant of the creep.")] = 5.0
    creep_decades: Annotated[
        int,
        number(0, 6),
        key("Decades of time over which creep is spread evenly, from `creep_time` on; 0: one."),
    ] = 0
    seating_m: Annotated[
        LengthOrZero,
        key("Travel by which the payload seats itself once and for all."),
    ] = 0.0
    seating_force_n: Annotated[Force, key("Force at which it has seated itself.")] = 100.0
    slip_m: Annotated[
        LengthOrZero,
        key("Lost motion behind the measured travel: after a reversal only that moves."),
    ] = 0.0
    drift_m_s: Annotated[
        float,
        Quantity("m/s", -1e-4, 1e-4),
        key("Speed at which the load path grows towards the plate, unseen by the arm."),
    ] = 0.0
    pad_stiffness_n_per_m: Annotated[
        Stiffness | None,
        key("Stiffness of a soft pad over the payload; none: no pad."),
    ] = None
    pad_depth_m: Annotated[LengthOrZero, key("Travel by which the pad can be compressed.")] = 0.0
    stop_depth_m: Annotated[
        Length | None,
        key("Deformation from which on a hidden stop carries too; none: no stop."),
    ] = None
    stop_stiffness_n_per_m: Annotated[Stiffness, key("Stiffness of that stop.")] = 1e9
    adhesion_n: Annotated[
        ForceOrZero, key("Force by which the contact sticks before it parts.")
    ] = 0.0
    adhesion_law: Annotated[
        str,
        Choice(("dmt", "jkr")),
        key("dmt: the force less `adhesion`; jkr: a soft smooth sphere that is drawn along."),
    ] = "dmt"
    softness: Annotated[
        float,
        Quantity("%", 0.0, 10.0),
        key("Compliance of the load path at zero force above that at high force, as a share."),
    ] = 0.0
    softness_force_n: Annotated[Force, key("Force over which that softness fades, by 1/e.")] = 100.0
    lateral: Annotated[
        ShareAcross,
        key("Force across the pressing axis, share of the force along it."),
    ] = 0.0
    lateral_coupling: Annotated[
        ShareAcross,
        key("Travel along the axis by which a lateral force moves the tip, over F/K_s."),
    ] = 0.3
    cross_talk: Annotated[
        float,
        Quantity("%", -1.0, 1.0),
        key("Share of the lateral force that the force sensor reads along the axis."),
    ] = 0.0
    sensor_quadratic: Annotated[
        _Bend,
        key("Error of the force sensor at full scale that grows as F², share of full scale."),
    ] = 0.0
    sensor_cubic: Annotated[
        _Bend,
        key("Error of the force sensor at full scale that grows as F³, share of full scale."),
    ] = 0.0
    mount: Annotated[
        Mounting | None,
        key("Six axes: tip that gives way sideways, friction, tilt; none: the pressing axis only."),
    ] = None
