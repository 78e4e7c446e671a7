"""What of F_c may be counted on of a payload that is dragged sideways, pressed and drawn back."""

from __future__ import annotations

import math

from stepload.contact.lateral import SHARES, left_of_limit
from stepload.contact.limit import softer_body
from stepload.contact.materials import Material
from stepload.contact.unknown import is_range
from stepload.plan.model import Payload, Plan, Structure


def counted_left(plan: Plan, *, one_axis: bool = False) -> float:
    """The part of F_c that F_allowed is made of; `one_axis` as in `dragged_left`."""
    return min(dragged_left(plan, one_axis=one_axis), back_left(plan))


def dragged_left(plan: Plan, *, one_axis: bool = False) -> float:
    """The part of F_c left at the largest share across the axis that the plan allows; 1 where a
    guided axis does not drag the payload, or six components show it (R12).

    Where nobody sees the share it may also be as large as a stated friction, and the whole force by
    as much larger than that along the axis. A low friction allows no more: it only ever takes away.

    Args:
        one_axis: the run has found that its sensor shows one component, whatever the plan says.
    """
    seen = plan.rig.force.components == "six" and not one_axis
    if seen or plan.rig.arm.structure is not Structure.ARM:
        return 1.0
    left = left_at(plan.payload, plan.procedure.max_lateral_share)
    friction = plan.payload.friction
    if friction is None:
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
