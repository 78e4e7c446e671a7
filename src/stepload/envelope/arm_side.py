"""Error of the lateral force by the arm's own wrench, where the force sensor measures none."""

from __future__ import annotations

import math

from stepload.plan.model import Plan, SecondForceSource
from stepload.rig.plugins import load_arm

COMPONENTS = 2
"""Lateral components; each may err by what R5 allows the axial one to err by."""


def arm_error_n(tolerance_n: float, tolerance_relative: float, along_n: float) -> float:
    """Largest error in N of the lateral force by the wrench of a sound arm.

    Args:
        tolerance_n, tolerance_relative: of the second channel, as R5 has them.
        along_n: force along the press.
    """
    return math.sqrt(COMPONENTS) * (tolerance_n + tolerance_relative * abs(along_n))


def arm_tells(plan: Plan) -> bool:
    """Whether the second channel is an arm that reports its lateral force too.

    Raises:
        BadInputError: the arm's driver is not installed.
    """
    source = plan.rig.second_force.source
    return source is SecondForceSource.ARM and load_arm(plan.rig.arm.driver.name).has_wrench


def surely_seen(plan: Plan) -> float:
    """Lateral share at the top force from which on R12 surely stops by the arm's wrench, whatever
    the sign of the arm's error."""
    second, top_n = plan.rig.second_force, plan.procedure.top_force_n
    error_n = arm_error_n(second.tolerance_n, second.tolerance_relative, top_n)
    return plan.procedure.max_lateral_share + 2.0 * error_n / top_n
