"""How well the arm's own wrench tells a force across the press that the force sensor does not."""

from __future__ import annotations

import math

from stepload.plan.model import Plan, SecondForceSource
from stepload.rig.plugins import load_arm

COMPONENTS = 2
"""Across the press; each may err by what R5 allows the one along it to err by."""


def arm_error_n(tolerance_n: float, tolerance_relative: float, along_n: float) -> float:
    """Largest error in N of the force across the press by a sound arm's wrench.

    Args:
        tolerance_n, tolerance_relative: of the second channel, as R5 has them.
        along_n: force along the press.
    """
    return math.sqrt(COMPONENTS) * (tolerance_n + tolerance_relative * abs(along_n))


def arm_tells(plan: Plan) -> bool:
    """Whether the second channel is an arm that tells its force across the press too.

    Raises:
        BadInputError: the arm's driver is not installed.
    """
    source = plan.rig.second_force.source
    return source is SecondForceSource.ARM and load_arm(plan.rig.arm.driver.name).has_wrench


def surely_seen(plan: Plan) -> float:
    """The share across the press at the top force from which on R12 stops by the arm's wrench,
    whichever way the arm errs."""
    second, top_n = plan.rig.second_force, plan.procedure.top_force_n
    error_n = arm_error_n(second.tolerance_n, second.tolerance_relative, top_n)
    return plan.procedure.max_lateral_share + 2.0 * error_n / top_n
