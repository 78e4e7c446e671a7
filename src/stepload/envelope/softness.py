"""Warnings where a sound but soft payload may end a run, or make it slow.

Remedies are tried by `advice` before they are listed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from stepload.envelope.bounds import step_patience_s
from stepload.envelope.limits import RunLimits
from stepload.envelope.load_times import load_times
from stepload.envelope.reason import Reason, Severity
from stepload.envelope.theory import Theory
from stepload.plan.model import Plan
from stepload.units import format_quantity

SPARE = 1.25
"""Factor on the expected time of a step, which must then be below the time allowed for it."""


def softness(plan: Plan, limits: RunLimits, theory: Theory) -> Iterator[Reason]:
    """Warnings about R8 (search), slow steps, and a soft payload with one force channel."""
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
    yield from _rigid_reason(limits, procedure.levels_n)
    patience_s = step_patience_s(procedure)
    climbs = load_times(plan, limits, law)
    step_s = max(climbs.up_s)
    if SPARE * step_s > patience_s:
        yield Reason(
            "slow_steps", Severity.WARN,
            f"the arm may press so slowly here that a load step may last"
            f" {format_quantity(step_s, 's')}; steps are given up after"
            f" {format_quantity(patience_s, 's')}",
            "",
            step_s, patience_s, "s",
        )  # fmt: skip


def _rigid_reason(limits: RunLimits, levels_n: Sequence[float]) -> Iterator[Reason]:
    """A warning where an only channel lets the arm press on further than a rigid stop allows."""
    if limits.cross_check:
        return
    stiffness, counted_n = limits.stiffness_n_per_m, limits.counted_limit_n
    most_n = max(level_n + stiffness * limits.travel_m(level_n) for level_n in levels_n)
    if most_n > counted_n:
        yield Reason(
            "one_channel_soft", Severity.WARN,
            "If the only force channel fails and the payload rests on something rigid, the force"
            f" may reach {format_quantity(most_n, 'N')}.",
            "Add a second force channel.",
            most_n, counted_n, "N",
        )  # fmt: skip
