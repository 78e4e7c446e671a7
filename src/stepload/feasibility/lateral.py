"""Lateral force: what it leaves of F_c, and what payload, force sensor and R12 to R14 may bear."""

from __future__ import annotations

import math
from collections.abc import Iterator

from stepload.contact.lateral import SHARES, left_of_limit, weakening
from stepload.contact.limit import softer_body
from stepload.contact.material_range import is_range
from stepload.contact.materials import Material
from stepload.feasibility.conditions import ARM_MISALIGNMENT_RAD
from stepload.feasibility.reason import Reason, Severity
from stepload.plan.model import ForceSpec, Payload, Plan, Structure
from stepload.units import format_quantity, percent

UNMEASURED_TILT_RAD = math.radians(3.0)
"""Assumed largest tilt of a plate where none is stated."""
CROSS_TALK = 0.01
"""Cross-talk: share of the axial force that a six-axis sensor may show across its axis."""
RATED_SHARE = 0.8
"""Share of its rating that a component of the sensor may read."""
LEAST_N = 5.0
"""Below this force the lateral share says little about the contact, and is not judged where
friction cannot make it too large there."""
SIGMAS = 8.0
OFF_CENTRE_M = 2e-3
"""A contact is rarely nearer to the pressing axis than this."""
_COMPONENTS = ("fx_n", "fy_n", "fz_n", "tx_n_m", "ty_n_m", "tz_n_m")
OVERLOADS = tuple(f"overload_{name}" for name in _COMPONENTS)
SECOND_OVERLOADS = tuple(f"second_overload_{name}" for name in _COMPONENTS)
COMPONENTS = 2
"""Lateral components; each may err by what R5 allows the axial one to err by."""


def counted_left(plan: Plan, *, one_axis: bool = False) -> float:
    """The part of F_c from which F_allowed is derived; `one_axis` as in `dragged_left`."""
    return min(dragged_left(plan, one_axis=one_axis), back_left(plan))


def expected_tilt_rad(plan: Plan) -> float:
    """Largest tilt of the plate in rad that is expected: checked in the run, stated, or assumed."""
    if plan.procedure.alignment is not None:
        return plan.procedure.alignment.max_tilt_rad
    stated = plan.rig.plate_tilt_rad
    return UNMEASURED_TILT_RAD if stated is None else stated


def misaligned_share(plan: Plan) -> float:
    """By how much the share in the plane of the plate may exceed the one that the sensor shows.

    Causes are the tilt of the plate, the misalignment of the sensor, and its cross-talk.
    """
    return _misaligned_share(plan, expected_tilt_rad(plan))


def _misaligned_share(plan: Plan, tilt_rad: float) -> float:
    stated = plan.rig.force.misalignment_rad  # a guided axis holds its sensor no better
    mounted_rad = ARM_MISALIGNMENT_RAD if stated is None else stated
    return math.tan(tilt_rad + mounted_rad) + CROSS_TALK


def worst_weakening(plan: Plan) -> float:
    """The a for which 1 - a t² is no more than g(t) at every share t that R12 lets pass."""
    largest = plan.procedure.max_lateral_share + misaligned_share(plan)
    return max(weakening(nu, largest) for nu in yielding_ratios(plan.payload))


def steeper(plan: Plan) -> float:
    """The part of F_c that is lost where the plate is tilted by more than the assumed tilt.

    The loss by the assumed tilt itself, 2 to 3 %, is contained in `rig.common_force_error`.
    """
    more = misaligned_share(plan) ** 2 - _misaligned_share(plan, UNMEASURED_TILT_RAD) ** 2
    return worst_weakening(plan) * more if more > 0.0 else 0.0


def dragged_left(plan: Plan, *, one_axis: bool = False) -> float:
    """The part of F_c left at the largest lateral share that the plan allows.

    1 where a guided axis does not drag the payload; `steeper` alone counts where six components
    show the share (R12). Where the share is not measured it may also be as large as a stated
    friction, and the resultant larger than the axial force accordingly. A low friction never
    increases the result. A plate stated to be tilted by more than is assumed adds to the share.

    Args:
        one_axis: the run has found that its sensor shows one component, whatever the plan says.
    """
    if plan.rig.force.components == "six" and not one_axis:
        return 1.0 - steeper(plan)
    serial = plan.rig.arm.structure is Structure.ARM
    share = plan.procedure.max_lateral_share if serial else 0.0
    tilt_rad = max(expected_tilt_rad(plan), UNMEASURED_TILT_RAD)
    left = left_at(plan.payload, share + math.tan(tilt_rad) - math.tan(UNMEASURED_TILT_RAD))
    friction = plan.payload.friction
    if friction is None or not serial:
        return left
    return min(left, left_at(plan.payload, friction) / math.hypot(1.0, friction))


def back_left(plan: Plan) -> float:
    """g at the friction that the plan states; 1 where it states none, or the axis is guided.

    The share in the plane of the plate never exceeds the friction, whatever the tilt of the plate,
    and however the tip sticks and swings while a serial arm retracts: a resultant of up to g(µ) F_c
    stays below g(t) F_c at any time.
    """
    if plan.payload.friction is None or plan.rig.arm.structure is not Structure.ARM:
        return 1.0
    return left_at(plan.payload, plan.payload.friction)


def friction_left(payload: Payload) -> float:
    """g at the highest friction possible: the stated one, else the end of the table."""
    return left_at(payload, SHARES[-1] if payload.friction is None else payload.friction)


def left_at(payload: Payload, share: float) -> float:
    """g at this lateral share, of the body for which it is smallest."""
    return min(left_of_limit(nu, share) for nu in yielding_ratios(payload))


def yielding_ratios(payload: Payload) -> tuple[float, ...]:
    """Poisson's ratios of the bodies that may yield first; of a range, both ends."""
    softer = softer_body(payload.material, payload.plate)
    bodies = (payload.material, payload.plate) if softer is None else (softer,)
    return tuple(nu for body in bodies for nu in _ratios(body))


def _ratios(body: Material) -> tuple[float, ...]:
    if is_range(body) and body.poisson_ratio_ends is not None:
        return body.poisson_ratio_ends
    return (body.poisson_ratio,)


def lateral_limits(plan: Plan, noise_n: float, allowed_n: float) -> dict[str, float]:
    """The thresholds of R12 to R14 by name; 0 where one is off.

    Args:
        noise_n: of one reading of the force sensor.
        allowed_n: F_allowed.
    """
    rig, procedure = plan.rig, plan.procedure
    share, lever_m = procedure.max_lateral_share, rig.force.lever_m
    return {
        "lateral_share": share,
        "lateral_askew": misaligned_share(plan),
        "lateral_weakening": weakening_left(plan),
        "lateral_from_n": share_from_n(plan, noise_n, allowed_n),
        **dict(zip(OVERLOADS, _overloads(rig.force), strict=True)),
        **dict(zip(SECOND_OVERLOADS, _overloads(rig.second_force.sensor), strict=True)),
        "lever_m": lever_m or 0.0,
        "eccentricity_m": procedure.max_eccentricity_m if lever_m else 0.0,
        "dragged_left": dragged_left(plan, one_axis=True),
    }


def weakening_left(plan: Plan) -> float:
    """The a for which F_allowed (1 - a u) allows for the weakening of F_c by a lateral share.

    u = s (s + 2 e), s the share that the sensor shows, e what may be hidden of it. What F_allowed
    subtracts from F_c already is not subtracted again: the least a' for which
    left (1 - a' u) <= 1 - steeper - a u at every s up to the largest, with a of `worst_weakening`.
    """
    share, left, whole = plan.procedure.max_lateral_share, counted_left(plan), worst_weakening(plan)
    largest = share * (share + 2.0 * misaligned_share(plan))
    return max(0.0, whole / left - ((1.0 - steeper(plan)) / left - 1.0) / largest)


def share_from_n(plan: Plan, noise_n: float, allowed_n: float) -> float:
    """The whole force in N from which on R12 judges.

    Below it the share says little; but every force is judged that friction may make too large.
    Below eight sigma of noise no share can be determined at all.
    """
    told_n = max(LEAST_N, 2.0 * plan.procedure.touch_force_n)
    return max(min(told_n, borne_at_any_share_n(plan, allowed_n)), SIGMAS * noise_n)


def borne_at_any_share_n(plan: Plan, allowed_n: float) -> float:
    """The force in N up to which no share that friction makes is too large: g(µ) of what F_allowed
    is when all of F_c is counted on, and never more than F_allowed."""
    return allowed_n * min(1.0, friction_left(plan.payload) / counted_left(plan))


def _overloads(sensor: ForceSpec | None) -> list[float]:
    """80 % of the rating of each component; 0 where none is stated."""
    none = (0.0,) * 3
    forces_n = none if sensor is None else sensor.rated_force_n or none
    torques_n_m = none if sensor is None else sensor.rated_torque_n_m or none
    return [RATED_SHARE * rated for rated in (*forces_n, *torques_n_m)]


def share_reasons(plan: Plan, from_n: float, allowed_n: float) -> Iterator[Reason]:
    """Whether the force sensor's noise hides a share that friction may make too large.

    Args:
        from_n: the force from which on R12 judges.
        allowed_n: F_allowed.
    """
    borne_n = borne_at_any_share_n(plan, allowed_n)
    seen = plan.rig.arm.structure is Structure.ARM and plan.rig.force.components == "six"
    if not seen or from_n <= borne_n:
        return
    yield Reason(
        "share_in_the_noise", Severity.WARN,
        f"R12 judges lateral force from {format_quantity(from_n, 'N')} on, by noise; friction"
        f" matters from {format_quantity(borne_n, 'N')} on.",
        "state payload.friction, the highest possible",
        from_n, borne_n, "N", 0.5 * (from_n - borne_n) / plan.procedure.top_force_n,
        "payload.friction",
    )  # fmt: skip


def lateral_reasons(plan: Plan) -> Iterator[Reason]:
    """Whether the sensor's rated torques allow the lateral force that the plan allows."""
    force, top_n = plan.rig.force, plan.procedure.top_force_n
    if not (force.rated_torque_n_m and force.lever_m):
        return
    across = [i for i in range(3) if i != "xyz".index(force.axis[-1])]
    allowed = RATED_SHARE * min(force.rated_torque_n_m[i] for i in across)
    centred = top_n * OFF_CENTRE_M
    share = max(0.0, allowed / top_n - OFF_CENTRE_M) / force.lever_m
    if share >= plan.procedure.max_lateral_share:
        return
    refused = allowed <= centred
    yield Reason(
        "sensor_moment", Severity.REFUSE if refused else Severity.WARN,
        f"At the top force the sensor's rated torque allows a lateral force of {percent(share, 2)}"
        f" (R13), with a lever of {format_quantity(force.lever_m, 'm')}.",
        "a shorter tool, or a lower top_force",
        share, plan.procedure.max_lateral_share, "",
        1.0 - share / plan.procedure.max_lateral_share, "procedure.top_force",
    )  # fmt: skip


def arm_error_n(tolerance_n: float, tolerance_relative: float, along_n: float) -> float:
    """Largest error in N of the lateral force by the wrench of a sound arm.

    Args:
        tolerance_n, tolerance_relative: of the second channel, as R5 has them.
        along_n: force along the press.
    """
    return math.sqrt(COMPONENTS) * (tolerance_n + tolerance_relative * abs(along_n))
