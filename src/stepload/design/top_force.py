"""The largest top force for a payload on a rig, and what limits it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

from stepload.errors import BadInputError, RefusedError
from stepload.feasibility.draft_plan import DEFAULT, Order, plan_of
from stepload.feasibility.map_grid import most_push
from stepload.feasibility.preflight import Preflight, derive
from stepload.feasibility.pressing import largest_top_force
from stepload.plan.model import Plan
from stepload.report.conditions import planned
from stepload.units import format_quantity

TRIES = 3
"""Iterations for the safe force. It falls by a hundredth of the rise of the requested force, since
the allowed drift grows with that: three are exact to a millionth."""
ANY_N = 1e6
"""A force beyond that of any rig."""


@dataclass(frozen=True, slots=True)
class Ceiling:
    """The largest top force to be tried.

    Attributes:
        rig, payload: their names.
        top_n: the force.
        why: what limits it, as a whole sentence.
    """

    rig: str
    payload: str
    top_n: float
    why: str


def ceiling(rig: str, payload: Path, order: Order = DEFAULT) -> Ceiling:
    """The largest force that arm and sensor can press, is safe, and is covered by the table.

    Args:
        rig: a profile that comes with stepload, or a rig file.
        payload: a payload file.
        order: the order with the largest steps: larger ones need more room below F_c.

    Raises:
        BadInputError: no such rig or payload.
        PlanError: one of their files is invalid.
        RefusedError: the payload's elastic limit is not known, or no force is safe.
        DomainError: a number outside the domain of contact theory.
    """
    name, most_n = most_push(rig)
    why = f"{name} can press with {format_quantity(most_n, 'N')} at most"
    plan = plan_of(rig, payload, most_n, order)
    preflight = derive(plan)
    # The safe force is not computed from a top force far beyond F_c: its steps leave no room.
    top_n = min(most_n, preflight.theory.counted.lower_n)
    for _ in range(TRIES):
        if top_n < most_n:
            try:
                plan = plan_of(rig, payload, top_n, order)
            except BadInputError as error:
                raise _no_force(preflight) from error
            preflight = derive(plan)
        safe_n = preflight.largest_safe_force_n
        if not safe_n > 0.0:
            raise _no_force(preflight)
        if safe_n < most_n:
            top_n, why = safe_n, _unsafe(plan, preflight)
    table = planned(preflight).sources.deflection()
    last_n = math.inf if table is None else table.force_n[-1]
    if last_n < top_n:
        last, safe = format_quantity(last_n, "N"), format_quantity(top_n, "N")
        why = (
            f"the table of the rig's deflection ends at {last}, and nothing beyond it is "
            f"IDENTIFIED; {safe} would be safe, so calibrate up to there to use it"
        )
    return Ceiling(name, plan.payload.name, min(top_n, last_n), why)


def _no_force(preflight: Preflight) -> RefusedError:
    plan = preflight.plan
    return RefusedError(
        f"{plan.payload.name} must not be pressed on {plan.rig.name}: {_limit(preflight)}, and no "
        "top force that this rig resolves is safe",
        hint="stepload preflight PLAN says how the force budget is spent",
    )


def _limit(preflight: Preflight) -> str:
    theory = preflight.theory
    limit, counted = (
        format_quantity(force, "N") for force in (theory.elastic_limit_n, theory.counted.lower_n)
    )
    return f"its elastic limit F_c is {limit}; F_c used: {counted}"


def _unsafe(plan: Plan, preflight: Preflight) -> str:
    """Why the largest safe force is not larger: because of the payload, or of the rig."""
    safe_n, rig = preflight.largest_safe_force_n, plan.rig
    stronger = replace(
        rig,
        arm=replace(rig.arm, max_push_n=ANY_N),
        force=replace(rig.force, range_n=ANY_N),
    )
    free_n = largest_top_force(replace(plan, rig=stronger), preflight.theory.counted.lower_n)
    safe = format_quantity(safe_n, "N")
    if free_n > safe_n:
        return f"more than {safe} leaves too little room below what {rig.name} can press with"
    return f"more than {safe} is not safe: {_limit(preflight)}"
