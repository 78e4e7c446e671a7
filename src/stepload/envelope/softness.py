"""Where a sound but soft payload would end a run, or make it slow; warnings, for it may go well.

What would help against them is tried by `advice` before it is told.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from stepload.contact.elastic import law_for
from stepload.contact.power_law import ContactLaw
from stepload.envelope.bounds import step_patience_s
from stepload.envelope.press import NOISE_MULTIPLE
from stepload.envelope.pressing import Pressing, pressing_for
from stepload.envelope.reason import Reason, Severity
from stepload.envelope.theory import Theory
from stepload.errors import RefusedError
from stepload.plan.model import Plan
from stepload.units import format_quantity

SOFTER = 3.0
"""A payload may be this much softer than its material is stated to be."""
LEASH_PULL_S = 0.1
"""Time to prove one length of the leash by force; 0.06 s to 0.09 s in simulated runs."""


def slowest_step(plan: Plan, pressing: Pressing, law: ContactLaw) -> float:
    """Longest time in s that the leash makes a load step last: its force by the leash's answer."""
    rig, procedure = pressing.rig, plan.procedure
    longest_s, below_n = 0.0, procedure.touch_force_n
    for level_n in procedure.levels_n:
        room_n = pressing.forces.limit_n - level_n - NOISE_MULTIPLE * rig.noise_n
        answer_n = room_n * law.tangent(below_n) / rig.stiffness_n_per_m
        longest_s = max(longest_s, LEASH_PULL_S * (level_n - below_n) / answer_n)
        below_n = level_n
    return longest_s


def softness(plan: Plan, pressing: Pressing, theory: Theory) -> Iterator[Reason]:
    """Warnings about R6 (no answer in force), R8 (search) and steps that are given up."""
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
    patience_s = step_patience_s(procedure)
    step_s = slowest_step(plan, pressing, law)
    if 2.0 * step_s > patience_s:
        yield Reason(
            "slow_steps", Severity.WARN,
            f"the payload is so soft that a load step may last"
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
    """How many times softer the payload may be, at most `SOFTER`; a range says it by itself."""
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
