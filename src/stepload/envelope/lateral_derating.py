"""The part of F_c that may be counted on for a payload dragged sideways, loading or retracting."""

from __future__ import annotations

import math

from stepload.contact.lateral import SHARES, left_of_limit, weakening
from stepload.contact.limit import softer_body
from stepload.contact.material_range import is_range
from stepload.contact.materials import Material
from stepload.envelope.conditions import ARM_MISALIGNMENT_RAD
from stepload.plan.model import Payload, Plan, Structure

UNMEASURED_TILT_RAD = math.radians(3.0)
"""Assumed largest tilt of a plate where none is stated."""
CROSS_TALK = 0.01
"""Cross-talk: share of the axial force that a six-axis sensor may show across its axis."""


def counted_left(plan: Plan, *, one_axis: bool = False) -> float:
    """The part of F_c from which F_allowed is derived; `one_axis` as in `dragged_left`."""
    return min(dragged_left(plan, one_axis=one_axis), back_left(plan))


def believed_tilt_rad(plan: Plan) -> float:
    """Largest tilt of the plate in rad that is expected: checked in the run, stated, or assumed."""
    if plan.procedure.alignment is not None:
        return plan.procedure.alignment.max_tilt_rad
    stated = plan.rig.plate_tilt_rad
    return UNMEASURED_TILT_RAD if stated is None else stated


def misaligned_share(plan: Plan) -> float:
    """By how much the share in the plane of the plate may exceed the one that the sensor shows.

    Causes are the tilt of the plate, the misalignment of the sensor, and its cross-talk.
    """
    return _misaligned_share(plan, believed_tilt_rad(plan))


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
    tilt_rad = max(believed_tilt_rad(plan), UNMEASURED_TILT_RAD)
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
