"""What of F_c may be counted on of a payload that is dragged sideways, pressed and drawn back."""

from __future__ import annotations

import math

from stepload.contact.lateral import SHARES, left_of_limit, weakening
from stepload.contact.limit import softer_body
from stepload.contact.materials import Material
from stepload.contact.unknown import is_range
from stepload.envelope.conditions import ARM_MISALIGNMENT_RAD
from stepload.plan.model import Payload, Plan, Structure

UNMEASURED_TILT_RAD = math.radians(3.0)
"""A plate of which nobody says more is believed to be tilted by no more than this."""
CROSS_TALK = 0.01
"""Of the force along its axis, a six-axis sensor may show so much across it."""


def counted_left(plan: Plan, *, one_axis: bool = False) -> float:
    """The part of F_c that F_allowed is made of; `one_axis` as in `dragged_left`."""
    return min(dragged_left(plan, one_axis=one_axis), back_left(plan))


def believed_tilt_rad(plan: Plan) -> float:
    """Largest tilt of the plate that counts: measured in the run, stated, or believed."""
    if plan.procedure.alignment is not None:
        return plan.procedure.alignment.max_tilt_rad
    stated = plan.rig.plate_tilt_rad
    return UNMEASURED_TILT_RAD if stated is None else stated


def askew_of(plan: Plan) -> float:
    """By how much the share in the plane of the plate may be above the one that the sensor shows.

    The plate is tilted against the press, the sensor is mounted askew, and shows across its axis
    some of what is along it.
    """
    return _askew(plan, believed_tilt_rad(plan))


def _askew(plan: Plan, tilt_rad: float) -> float:
    stated = plan.rig.force.misalignment_rad  # a guided axis holds its sensor no better
    mounted_rad = ARM_MISALIGNMENT_RAD if stated is None else stated
    return math.tan(tilt_rad + mounted_rad) + CROSS_TALK


def worst_weakening(plan: Plan) -> float:
    """The a for which 1 - a t² is no more than g(t) at every share t that R12 lets pass."""
    largest = plan.procedure.max_lateral_share + askew_of(plan)
    return max(weakening(nu, largest) for nu in yielding_ratios(plan.payload))


def steeper(plan: Plan) -> float:
    """The part of F_c that a plate takes which is tilted by more than is believed of any plate.

    What the tilt believed of any takes, 2 to 3 %, stands in `rig.common_force_error`.
    """
    more = askew_of(plan) ** 2 - _askew(plan, UNMEASURED_TILT_RAD) ** 2
    return worst_weakening(plan) * more if more > 0.0 else 0.0


def dragged_left(plan: Plan, *, one_axis: bool = False) -> float:
    """The part of F_c left at the largest share across the axis that the plan allows; 1 where a
    guided axis does not drag the payload, or six components show it (R12).

    Where nobody sees the share it may also be as large as a stated friction, and the whole force by
    as much larger than that along the axis. A low friction allows no more: it only ever takes away.
    A plate that is stated to be tilted by more than is believed of any adds to the share.

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

    The share in the plane of the plate is never more than the friction, whatever the tilt of the
    plate, and however friction clings and the tip swings while a serial arm draws back: a whole
    force of g(µ) F_c keeps g(t) F_c at any time.
    """
    if plan.payload.friction is None or plan.rig.arm.structure is not Structure.ARM:
        return 1.0
    return left_at(plan.payload, plan.payload.friction)


def friction_left(payload: Payload) -> float:
    """g at the highest friction possible: the stated one, else the end of the table."""
    return left_at(payload, SHARES[-1] if payload.friction is None else payload.friction)


def left_at(payload: Payload, share: float) -> float:
    """g at this share across the axis, of the body that it leaves least of."""
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
