"""Limits of lateral force: what the payload and the force sensor may bear."""

from __future__ import annotations

from collections.abc import Iterator

from stepload.envelope.lateral_derating import (
    counted_left,
    dragged_left,
    friction_left,
    misaligned_share,
    steeper,
    worst_weakening,
)
from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import ForceSpec, Plan, Structure
from stepload.units import format_quantity

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
SIDEWAYS = (
    "lateral_share", "lateral_askew", "lateral_weakening", "lateral_from_n",
    *OVERLOADS, *SECOND_OVERLOADS, "lever_m", "eccentricity_m", "dragged_left",
)  # fmt: skip
"""Thresholds that records of earlier versions do not have: their rules were off."""


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
        f"At the top force the sensor's rated torque allows a lateral force of {share:.0%}"
        f" (R13), with a lever of {format_quantity(force.lever_m, 'm')}.",
        "a shorter tool, or a lower top_force",
        share, plan.procedure.max_lateral_share, "",
        1.0 - share / plan.procedure.max_lateral_share, "procedure.top_force",
    )  # fmt: skip
