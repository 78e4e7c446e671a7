"""Warnings where a sound but soft payload may end a run, or make it slow.

Remedies are tried by `advice` before they are listed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from stepload.contact.elastic import law_for
from stepload.envelope.bounds import step_patience_s
from stepload.envelope.climb import climbs_of
from stepload.envelope.leash import SURE_SIGMAS, lead_m
from stepload.envelope.limits import RunLimits
from stepload.envelope.pressing import pressing_for
from stepload.envelope.reason import Reason, Severity
from stepload.envelope.theory import Theory
from stepload.errors import RefusedError
from stepload.plan.model import Plan
from stepload.units import format_quantity

SPARE = 1.5
"""Factor on the expected time of a step, which must then be below the time allowed for it."""
SOFTER = 3.0
"""A payload may be this much softer than its material is stated to be."""


def softness(plan: Plan, limits: RunLimits, theory: Theory) -> Iterator[Reason]:
    """Warnings about R6 (no answer), R7 (no progress), R8 (search) and steps that are given up."""
    law = theory.softest
    arm, procedure = plan.rig.arm, plan.procedure
    touch_n = procedure.touch_force_n
    stiffness = plan.rig.system_stiffness.stiffness_n_per_m
    pressed_m = law.deformation(touch_n) + touch_n / stiffness + arm.lost_motion_m
    needed_m = 2.0 * procedure.surface_uncertainty_m + pressed_m
    if needed_m > procedure.search_distance_m:
        yield Reason(
            "search_short", Severity.WARN,
            f"a surface at the far edge answers with the touch force after"
            f" {format_quantity(needed_m, 'm')}, the search ends after"
            f" {format_quantity(procedure.search_distance_m, 'm')} (R8)",
            "",
            needed_m, procedure.search_distance_m, "m",
        )  # fmt: skip
    lag_m = limits.guarded_speed_m_s * (arm.command_delay_s + arm.lag_s)
    ahead_m = lead_m(plan.rig, SURE_SIGMAS) + arm.lost_motion_m + lag_m
    if ahead_m > limits.leash_free_m:
        yield Reason(
            "approach_stalls", Severity.WARN,
            f"in the approach the target may go {format_quantity(limits.leash_free_m, 'm')} ahead"
            f" of the measured position, and a sound arm may be {format_quantity(ahead_m, 'm')}"
            " behind it, by its lag and the error of that position: it may stand still there,"
            " which ends the run (R7)",
            "",
            ahead_m, limits.leash_free_m, "m",
        )  # fmt: skip
    patience_s = step_patience_s(procedure)
    climbs = climbs_of(plan, limits, law)
    step_s = max(climbs.up_s)
    if climbs.missed_n:
        yield Reason(
            "level_out_of_reach", Severity.WARN,
            f"near {format_quantity(climbs.missed_n, 'N')} the arm may press on by"
            f" {format_quantity(climbs.leash_m, 'm')} at a time, and its measured position may"
            f" be {format_quantity(climbs.lead_m, 'm')} farther behind its target than is counted:"
            " it may stand still below this level, which is given up after"
            f" {format_quantity(patience_s, 's')}",
            "",
            climbs.lead_m, climbs.leash_m, "m",
        )  # fmt: skip
    elif SPARE * step_s > patience_s:
        yield Reason(
            "slow_steps", Severity.WARN,
            f"the arm may press so slowly here that a load step may last"
            f" {format_quantity(step_s, 's')}; steps are given up after"
            f" {format_quantity(patience_s, 's')}",
            "",
            step_s, patience_s, "s",
        )  # fmt: skip
    spare = _spare_softness(plan, theory)
    if spare < SOFTER:
        yield Reason(
            "barely_answers", Severity.WARN,
            f"a payload {spare:.2g} times softer than stated would not answer to what the leash"
            f" lets the arm press, and R6 would end the run; rubbers and plastics are known to"
            f" about {SOFTER:g} times",
            "",
            spare, SOFTER, "",
        )  # fmt: skip


def _spare_softness(plan: Plan, theory: Theory) -> float:
    """How many times softer the payload may be, at most `SOFTER`; a range counts as `SOFTER`."""
    if theory.is_range:
        return SOFTER
    material = plan.payload.material

    def serves(factor: float) -> bool:
        softer = replace(material, youngs_modulus_pa=material.youngs_modulus_pa / factor)
        law = law_for(plan.payload.geometry, softer, plan.payload.plate)
        try:
            pressing_for(plan, law, law, theory.counted.lower_n)
        except RefusedError:
            return False
        return True

    if serves(SOFTER):
        return SOFTER
    low, high = 1.0, SOFTER
    for _ in range(6):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if serves(middle) else (low, middle)
    return low
