"""What a force across the pressing axis may do: to the payload, and to the force sensor."""

from __future__ import annotations

import math
from collections.abc import Iterator

from stepload.contact.lateral import SHARES, left_of_limit, weakening
from stepload.envelope.arm_side import arm_tells, surely_seen
from stepload.envelope.dragged import dragged_left, yielding_ratios
from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import ForceSpec, Plan, Structure
from stepload.units import format_quantity

RATED_SHARE = 0.8
"""Of its rating, a component of the sensor may read so much."""
LEAST_N = 5.0
"""Below this force the share across the axis says little about the contact."""
SIGMAS = 8.0
OFF_CENTRE_M = 2e-3
"""A contact is rarely nearer to the pressing axis than this."""
_COMPONENTS = ("fx_n", "fy_n", "fz_n", "tx_n_m", "ty_n_m", "tz_n_m")
OVERLOADS = tuple(f"overload_{name}" for name in _COMPONENTS)
SECOND_OVERLOADS = tuple(f"second_overload_{name}" for name in _COMPONENTS)
SIDEWAYS = (
    "lateral_share", "lateral_weakening", "lateral_from_n", *OVERLOADS, *SECOND_OVERLOADS,
    "lever_m", "eccentricity_m", "dragged_left",
)  # fmt: skip
"""Thresholds that records of earlier versions do not have: their rules were off."""


def sideways_limits(plan: Plan, noise_n: float) -> dict[str, float]:
    """The thresholds of R12 to R14 by name; 0 where one is off.

    Args:
        noise_n: of one reading of the force sensor.
    """
    rig, procedure = plan.rig, plan.procedure
    share, lever_m = procedure.max_lateral_share, rig.force.lever_m
    return {
        "lateral_share": share,
        "lateral_weakening": max(weakening(nu, share) for nu in yielding_ratios(plan.payload)),
        "lateral_from_n": max(LEAST_N, 2.0 * procedure.touch_force_n, SIGMAS * noise_n),
        **dict(zip(OVERLOADS, _overloads(rig.force), strict=True)),
        **dict(zip(SECOND_OVERLOADS, _overloads(rig.second_force.sensor), strict=True)),
        "lever_m": lever_m or 0.0,
        "eccentricity_m": procedure.max_eccentricity_m if lever_m else 0.0,
        "dragged_left": dragged_left(plan, one_axis=True),
    }


def _overloads(sensor: ForceSpec | None) -> list[float]:
    """80 % of the rating of each component; 0 where none is stated."""
    none = (0.0,) * 3
    forces_n = none if sensor is None else sensor.rated_force_n or none
    torques_n_m = none if sensor is None else sensor.rated_torque_n_m or none
    return [RATED_SHARE * rated for rated in (*forces_n, *torques_n_m)]


def sideways_reasons(plan: Plan, counted_n: float) -> Iterator[Reason]:
    """Whether sideways force is seen, what it may do, and whether the sensor's torques allow it.

    Args:
        counted_n: what of F_c may be counted on.
    """
    if plan.rig.arm.structure is Structure.ARM:
        yield from _friction_on_the_way_back(plan, counted_n)
    force, top_n = plan.rig.force, plan.procedure.top_force_n
    if (left := dragged_left(plan)) < 1.0:
        share, told = plan.procedure.max_lateral_share, arm_tells(plan)
        beyond = (
            "the arm's own force, within its tolerance, shows it surely from"
            f" {surely_seen(plan):.0%} of the top force on (R12); between the two nothing"
            " need stop the run"
            if told
            else "beyond that nothing stops the run"
        )
        yield Reason(
            "sideways_by_arm" if told else "sideways_unseen", Severity.WARN,
            "an arm drags the payload sideways as it presses, and a force sensor of one component"
            f" does not see it: {left:.0%} of F_c are counted on, which holds up to {share:.0%} of"
            f" the force across the axis; {beyond}",
            "use a six-axis force sensor, a guided axis, or a pose that pushes little sideways"
            " (stepload pose)",
            share, math.nan, "",
        )  # fmt: skip
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
        f"at the top force the sensor's rated torque allows a force across the axis of {share:.0%}"
        f" of that along it, with a lever of {format_quantity(force.lever_m, 'm')} and the contact"
        f" {format_quantity(OFF_CENTRE_M, 'm')} off centre: R13 stops the run beyond that",
        "a shorter tool, a larger sensor, or a lower top force",
        share, plan.procedure.max_lateral_share, "",
    )  # fmt: skip


def _friction_on_the_way_back(plan: Plan, counted_n: float) -> Iterator[Reason]:
    """Friction lets go later than the force falls: on the way back its share grows up to µ.

    With the force across held at the share s that R12 allows at the top force F, the contact slides
    at µ, where the whole force s F sqrt(1 + µ²)/µ meets a limit of g(µ) F_c; a stop does the same.
    """
    share, top_n = plan.procedure.max_lateral_share, plan.procedure.top_force_n
    worst = max(
        share * math.hypot(1.0, mu) / (mu * left_of_limit(nu, mu))
        for mu in SHARES if mu > share
        for nu in yielding_ratios(plan.payload)
    )  # fmt: skip
    if top_n * worst <= counted_n:
        return
    yield Reason(
        "clings_on_the_way_back", Severity.WARN,
        f"friction may hold the payload sideways while the arm draws back: at the {share:.0%}"
        f" across that R12 allows and a friction of up to {SHARES[-1]:g} it may bear what"
        f" {format_quantity(top_n * worst, 'N')} would without, and"
        f" {format_quantity(counted_n, 'N')} of F_c are counted on. No stop prevents it",
        "lower procedure.max_lateral_share or the top force, grease the contact, or hold the arm in"
        " a pose that pushes little sideways (stepload pose)",
        top_n * worst, counted_n, "N",
    )  # fmt: skip
