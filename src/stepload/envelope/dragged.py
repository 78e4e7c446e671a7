"""What of F_c may be counted on where nothing sees a payload being dragged sideways."""

from __future__ import annotations

from stepload.contact.lateral import left_of_limit
from stepload.contact.limit import softer_body
from stepload.contact.materials import Material
from stepload.contact.unknown import is_range
from stepload.plan.model import Payload, Plan, Structure


def dragged_left(plan: Plan, *, one_axis: bool = False) -> float:
    """The part of F_c left at the largest share across the axis that the plan allows; 1 where a
    guided axis does not drag the payload, or six components show it (R12).

    Args:
        one_axis: the run has found that its sensor shows one component, whatever the plan says.
    """
    seen = plan.rig.force.components == "six" and not one_axis
    if seen or plan.rig.arm.structure is not Structure.ARM:
        return 1.0
    share = plan.procedure.max_lateral_share
    return min(left_of_limit(nu, share) for nu in yielding_ratios(plan.payload))


def yielding_ratios(payload: Payload) -> tuple[float, ...]:
    """Poisson's ratios of the bodies that may yield first; of a range, both ends."""
    softer = softer_body(payload.material, payload.plate)
    bodies = (payload.material, payload.plate) if softer is None else (softer,)
    return tuple(nu for body in bodies for nu in _ratios(body))


def _ratios(body: Material) -> tuple[float, ...]:
    if is_range(body) and body.poisson_ratio_ends is not None:
        return body.poisson_ratio_ends
    return (body.poisson_ratio,)
