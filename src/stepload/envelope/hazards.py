"""What host software cannot survive on this rig, each with its physics bound; notes, not verdicts.

They ask for a layer of its own: a mechanical fuse or stop, the machine's own force trip.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from stepload.envelope.catch_up import catch_up_force
from stepload.envelope.pressing import HARD_STOP_N_PER_M, Pressing
from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import Plan, SecondForceSource
from stepload.units import format_quantity

UR_FORCE_LIMIT_REACTION_S = 0.25
"""Reaction time of a UR safety force limit; its tolerance is 25 N."""


def hazards(plan: Plan, pressing: Pressing) -> Iterator[Reason]:
    """The named hazards that apply to this plan."""
    reaction_time_s = pressing.rig.reaction_s
    arm = plan.rig.arm
    k_s = plan.rig.system_stiffness.stiffness_n_per_m
    fuse_n = plan.rig.mechanical_fuse_n
    layer = (
        f"the declared mechanical fuse opens at {format_quantity(fuse_n, 'N')}"
        if fuse_n is not None
        else "only an independent layer helps: a mechanical fuse or stop, or the machine's own trip"
    )
    runaway_n = k_s * arm.max_speed_m_s * reaction_time_s
    yield Reason(
        "drive_runaway", Severity.NOTE,
        f"a drive that runs away at its full speed adds K_s·v·t = {format_quantity(runaway_n, 'N')}"
        f" within the reaction time of {reaction_time_s * 1e3:.0f} ms"
        f" ({format_quantity(k_s * arm.max_speed_m_s * UR_FORCE_LIMIT_REACTION_S, 'N')} before a"
        " robot's own force limit acts)",
        layer, runaway_n, math.nan, "N",
    )  # fmt: skip
    impact_n = catch_up_force(pressing.rig, pressing.ahead_m, HARD_STOP_N_PER_M)
    if impact_n > pressing.forces.allowed_n:
        yield Reason(
            "held_back_commands", Severity.NOTE,
            "if the link holds commands back and delivers them at once, just before something"
            f" rigid that the plan does not know of, the arm hits it with up to"
            f" {format_quantity(impact_n, 'N')} before any reaction",
            "keep the way free; a quiet network; finer arm positions show it sooner",
            impact_n, pressing.forces.allowed_n, "N",
        )  # fmt: skip
    top_n = plan.procedure.top_force_n
    # F_allowed and the largest K_s: both may be worse than they read.
    moved_m = max(0.0, pressing.forces.allowed_n - top_n) / pressing.rig.stiffness_n_per_m
    yield Reason(
        "plate_moves", Severity.NOTE,
        "whatever moves the plate or the arm's base while they press adds up to K_s times its way:"
        f" more than {format_quantity(moved_m, 'm')} towards each other at"
        f" {format_quantity(top_n, 'N')} can pass F_c before any reaction, a jolt less than that",
        "bolt plate and arm down, touch neither while it presses; a softer mount makes more room",
        moved_m, math.nan, "m",
    )  # fmt: skip
    if plan.rig.second_force.source is not SecondForceSource.NONE:
        common = 100.0 * plan.rig.common_force_error
        yield Reason(
            "both_channels_alike", Severity.NOTE,
            "both force channels wrong in the same way cannot be seen: up to"
            f" {common:.3g} % too little together are allowed for (rig.common_force_error)", layer,
            plan.rig.common_force_error, math.nan, "",
        )  # fmt: skip
