"""What host software cannot survive on this rig, each with its physics bound; notes, not verdicts.

They ask for a layer of its own: a mechanical fuse or stop, the machine's own force trip.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from stepload.feasibility.verdict import Reason, Severity
from stepload.plan.model import Plan, SecondForceSource
from stepload.units import format_quantity

UR_FORCE_LIMIT_REACTION_S = 0.25
"""Reaction time of a UR safety force limit; its tolerance is 25 N."""


def hazards(plan: Plan, reaction_time_s: float, fast_speed_m_s: float) -> Iterator[Reason]:
    """The named hazards that apply to this plan.

    Args:
        reaction_time_s: T_react from force to first unloading motion.
        fast_speed_m_s: speed of the fast approach.
    """
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
    impact_n = fast_speed_m_s * math.sqrt(arm.effective_mass_kg * k_s)
    yield Reason(
        "contact_at_fast_speed", Severity.NOTE,
        "if something stands in the way of the fast approach, v·√(m K_s) ="
        f" {format_quantity(impact_n, 'N')} is there before any reaction",
        "keep the way free; state surface_distance and surface_uncertainty honestly",
        impact_n, math.nan, "N",
    )  # fmt: skip
    if plan.rig.second_force.source is not SecondForceSource.NONE:
        yield Reason(
            "both_channels_alike", Severity.NOTE,
            "both force channels wrong in the same way cannot be seen", layer,
        )  # fmt: skip
