"""Plans of a UR-class arm with six axes above a tilted plate."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from run_plans import ur_plan

from stepload.plan.model import Alignment, Plan
from stepload.plan.mounting import Mounting

ALIGNMENT = Alignment()


def tilted_plan(
    tilt_x_deg: float = 0.0,
    tilt_y_deg: float = 0.0,
    *,
    friction: float = 0.1,
    alignment: Alignment | None = ALIGNMENT,
    **procedure: Any,
) -> Plan:
    """Up to 50 N in steps of 25 N, the plate 4 ± 1 mm away."""
    requested = {
        "surface_distance_m": 4e-3, "surface_uncertainty_m": 1e-3, "search_distance_m": 4e-3,
        "top_force_n": 50.0, "step_n": 25.0, "unload": False,
    }  # fmt: skip
    plan = ur_plan(**{**requested, **procedure}, alignment=alignment)
    rig = plan.rig
    mount = Mounting(
        friction=friction,
        tilt_x_rad=math.radians(tilt_x_deg),
        tilt_y_rad=math.radians(tilt_y_deg),
    )
    return replace(
        plan,
        rig=replace(
            rig,
            simulation=replace(rig.simulation, mount=mount),
            force=replace(rig.force, axis="+fz", rated_force_n=(1000.0,) * 3),
        ),
    )
