"""Hazards that host software cannot prevent on this rig, each with its physical bound.

They need an independent layer: a mechanical fuse or stop, the machine's own force trip.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from stepload.envelope.aligning import can_shift
from stepload.envelope.bounds import common_error
from stepload.envelope.catch_up import catch_up_force
from stepload.envelope.dragged import (
    UNMEASURED_TILT_RAD,
    believed_tilt_rad,
    dragged_left,
    steeper,
)
from stepload.envelope.pressing import (
    GUARDED_SHARE,
    HARD_STOP_N_PER_M,
    Pressing,
    rigid_coefficient,
)
from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import Plan, SecondForceSource, Structure
from stepload.units import format_quantity

UR_FORCE_LIMIT_REACTION_S = 0.25
"""Reaction time of a UR safety force limit; its tolerance is 25 N."""
HEAVIER = 10.0
"""Factor by which a moving arm is assumed to be heavier than stated."""
BOUNCING = 4.0
"""Factor on v sqrt(m k) of such an arm, which bounces and hits again before the next sample."""
LARGEST_UNSTATED_S = 0.1
"""Largest delay in s that a plan may have left out (filter, USB adapter, network) unnoticed."""


def hazards(plan: Plan, pressing: Pressing) -> Iterator[Reason]:
    """The named hazards that apply to this plan."""
    reaction_time_s = pressing.rig.reaction_s
    arm = plan.rig.arm
    stiffness = pressing.rig.stiffness_n_per_m
    largest = f"K = {format_quantity(stiffness, 'N/m')}, the load path's largest stiffness"
    fuse_n = plan.rig.mechanical_fuse_n
    layer = (
        f"the declared mechanical fuse opens at {format_quantity(fuse_n, 'N')}"
        if fuse_n is not None
        else "only an independent layer helps: a mechanical fuse or stop, or the machine's own trip"
    )
    runaway_n = stiffness * arm.max_speed_m_s * reaction_time_s
    yield Reason(
        "drive_runaway", Severity.NOTE,
        f"a drive that runs away at its full speed adds up to K·v·t ="
        f" {format_quantity(runaway_n, 'N')} within the reaction time of"
        f" {reaction_time_s * 1e3:.0f} ms"
        f" ({format_quantity(stiffness * arm.max_speed_m_s * UR_FORCE_LIMIT_REACTION_S, 'N')}"
        f" before a robot's own force limit acts); {largest}",
        layer, runaway_n, math.nan, "N",
    )  # fmt: skip
    impact_n = catch_up_force(pressing.rig, pressing.ahead_m, HARD_STOP_N_PER_M)
    if impact_n > pressing.forces.allowed_n:
        yield Reason(
            "held_back_commands", Severity.NOTE,
            "if the link holds commands back and delivers them at once, just before something"
            " rigid that the plan does not know of, or where friction holds the tip sideways more"
            f" than the plan says, the arm hits it with up to {format_quantity(impact_n, 'N')}"
            " before any reaction",
            "keep the way free; a quiet network; finer arm positions show it sooner",
            impact_n, pressing.forces.allowed_n, "N",
        )  # fmt: skip
    heavy_n = heavier_force(pressing)
    if heavy_n > pressing.forces.elastic_limit_n:
        yield Reason(
            "heavier_arm", Severity.NOTE,
            f"something rigid that the plan does not know of is hit with about"
            f" {format_quantity(heavy_n, 'N')}, and more where it bounces, by an arm"
            f" {HEAVIER:g} times as heavy as rig.arm.effective_mass says"
            f" ({format_quantity(arm.effective_mass_kg, 'kg')})",
            "state the mass of all that moves with the tool, links and tool together",
            heavy_n, pressing.forces.elastic_limit_n, "N",
        )  # fmt: skip
    late_s = unstated_delay_s(plan, pressing)
    if 0.0 < late_s < LARGEST_UNSTATED_S:
        yield Reason(
            "unstated_delays", Severity.NOTE,
            f"readings and commands that together come more than {late_s * 1e3:.3g} ms later than"
            " the plan says can pass F_c before it is seen",
            "state every filter and link (delay, command_delay), or take a lower load_rate",
            late_s, LARGEST_UNSTATED_S, "s",
        )  # fmt: skip
    top_n = plan.procedure.top_force_n
    # F_allowed and the largest K_s: true force and stiffness may be higher than they read.
    moved_m = max(0.0, pressing.forces.allowed_n - top_n) / stiffness
    yield Reason(
        "plate_moves", Severity.NOTE,
        "whatever moves the plate or the arm's base while they press adds up to K times its way:"
        f" more than {format_quantity(moved_m, 'm')} towards each other at"
        f" {format_quantity(top_n, 'N')} can pass F_c before any reaction, a jolt less than that;"
        f" {largest}",
        "bolt plate and arm down, touch neither while it presses; a softer mount makes more room",
        moved_m, math.nan, "m",
    )  # fmt: skip
    yield from _tilted(plan)
    if plan.rig.second_force.source is not SecondForceSource.NONE:
        common, source = common_error(plan.rig)
        yield Reason(
            "both_channels_alike", Severity.NOTE,
            "both force channels wrong in the same way cannot be seen: up to"
            f" {100.0 * common:.3g} % too little together are allowed for ({source})", layer,
            common, math.nan, "",
        )  # fmt: skip


def _tilted(plan: Plan) -> Iterator[Reason]:
    """Reasons on a plate that is not square to the press."""
    tilt_rad = believed_tilt_rad(plan)
    if plan.rig.force.components == "one" and tilt_rad > UNMEASURED_TILT_RAD:
        yield Reason(
            "plate_tilted", Severity.NOTE,
            f"a plate that is tilted by {math.degrees(tilt_rad):.3g} deg drags the payload"
            " sideways, and a force sensor of one component does not show it:"
            f" {dragged_left(plan):.1%} of F_c are counted on, and beyond that tilt less is left",
            "level the plate, or use a six-axis force sensor",
            tilt_rad, math.nan, "rad",
        )  # fmt: skip
    if plan.rig.force.components == "six" and plan.procedure.alignment is None:
        left = 1.0 - steeper(plan)
        taken = f"; {left:.1%} of F_c are counted on for it" if left < 1.0 else ""
        measure = (
            "let three touches on a circle measure it (procedure.alignment), "
            if can_shift(plan.rig)
            else ""
        )
        unsaid = plan.rig.plate_tilt_rad is None and plan.rig.arm.structure is Structure.ARM
        yield Reason(
            "plate_tilted", Severity.WARN if unsaid else Severity.NOTE,
            "nothing measures how the plate is tilted against the press: beyond"
            f" {math.degrees(tilt_rad):.3g} deg the payload is dragged sideways more than"
            f" the force sensor shows, and more than R12 counts on{taken}",
            f"{measure}level the plate, or state by how much it may be tilted at most"
            " (rig.plate_tilt)",
            tilt_rad, math.nan, "rad",
        )  # fmt: skip


def heavier_force(pressing: Pressing) -> float:
    """Estimate in N of the force on something rigid of an arm that is `HEAVIER` than stated.

    F_lim + C v, C with that mass and some room for bounces, v the largest speed that the stated
    mass allows. It is no bound: 1 of 928 simulated runs drawn at random went 4 % beyond it.
    """
    rig, limit_n = pressing.rig, pressing.forces.limit_n
    heavy = replace(rig, mass_kg=HEAVIER * rig.mass_kg)
    speed_m_s = max(
        pressing.guarded_speed_m_s, pressing.fast_speed_m_s, limit_n / pressing.contact_n_s_per_m
    )
    return limit_n + rigid_coefficient(heavy, limit_n, BOUNCING) * speed_m_s


def unstated_delay_s(plan: Plan, pressing: Pressing) -> float:
    """The total delay in s of readings and commands within which the force could reach F_c.

    A load step rises at its rate from the top force, an approach at K_s v from what it may reach.
    """
    forces, procedure = pressing.forces, plan.procedure
    load_s = (forces.elastic_limit_n - procedure.top_force_n) / procedure.load_rate_n_per_s
    met_n = max(GUARDED_SHARE * forces.limit_n, procedure.touch_force_n)
    rise_n_per_s = pressing.rig.stiffness_n_per_m * pressing.fast_speed_m_s
    return min(load_s, (forces.elastic_limit_n - met_n) / rise_n_per_s)
