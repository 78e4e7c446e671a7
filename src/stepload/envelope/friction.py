"""Preflight reasons on friction at the contact of a serial arm: how well K_s will hold."""

from __future__ import annotations

import math
from collections.abc import Iterator

from stepload.envelope.bounds import LEAST_CLASS_RATIO, largest_stiffness
from stepload.envelope.conditions import across_of, gauge_offset_of
from stepload.envelope.reason import Reason, Severity
from stepload.envelope.theory import Theory
from stepload.estimators.smooth import NORMAL_95
from stepload.evidence.lateral import TURN_RAD_PER_N, UNKNOWN_FRICTION
from stepload.plan.model import Plan, Provenance, Structure
from stepload.units import format_quantity

SIX_AXES = "a gauge across the contact, or calibrate with a six-axis force sensor, dry and greased"
NO_ARM = "a gauge across the contact, or rig.arm.structure: machine if the axis is guided"


def friction_reasons(plan: Plan, theory: Theory) -> Iterator[Reason]:
    """Whether friction affects the result of an arm, and what would remove its effect."""
    stiffness, arm = plan.rig.system_stiffness, plan.rig.arm
    yield from _ratio_reasons(plan)
    yield from _gauge_reasons(plan, theory)
    if plan.rig.displacement is not None or plan.identify.kind == "system":
        return
    if arm.structure is not Structure.ARM:
        return
    known, k_s = across_of(stiffness), stiffness.stiffness_n_per_m
    if known.per_newton_m is not None or known.stated or known.at_share is not None:
        return
    share = theory.law.secant(plan.procedure.top_force_n) / k_s
    cost = NORMAL_95 * UNKNOWN_FRICTION * share
    yield Reason(
        "friction_unknown",
        Severity.WARN,
        f"Lateral force by unknown friction: ±{100.0 * cost:.2g} % of the result.",
        SIX_AXES if plan.rig.arm.kinematics else NO_ARM,
        cost, math.nan, "", cost,
    )  # fmt: skip


def _ratio_reasons(plan: Plan) -> Iterator[Reason]:
    """Whether a stuck ratio of one pose is combined with a K_s that is a guess for all poses."""
    stiffness, arm = plan.rig.system_stiffness, plan.rig.arm
    ratio = stiffness.stuck_ratio
    if arm.structure is not Structure.ARM or stiffness.provenance is not Provenance.INDICATIVE:
        return
    if ratio is None or ratio >= LEAST_CLASS_RATIO:
        return
    most = format_quantity(largest_stiffness(plan.rig), "N/m")
    yield Reason(
        "stuck_ratio_of_a_guess", Severity.WARN,
        f"stuck_ratio {ratio:.3g} is that of one pose, K_s that of a class: the K_s bound"
        f" {most} may be too low.",
        "stepload calibrate in this pose, or leave stuck_ratio to the profile",
        ratio, LEAST_CLASS_RATIO, "", 1.0, "rig.system_stiffness.stuck_ratio",
    )  # fmt: skip


def _gauge_reasons(plan: Plan, theory: Theory) -> Iterator[Reason]:
    """Whether it is stated how far beside the contact a gauge on an arm measures: the arm turns."""
    gauge, offset_m = plan.rig.displacement, gauge_offset_of(plan.rig)
    if gauge is None or gauge.offset_m is not None or offset_m == 0.0:
        return
    harm = offset_m * TURN_RAD_PER_N * theory.law.secant(plan.procedure.top_force_n)
    yield Reason(
        "gauge_offset", Severity.WARN,
        f"The gauge's offset from the contact is not stated; {format_quantity(offset_m, 'm')} "
        f"count, {harm:.1%} of the deformation.",
        "state rig.displacement.offset, or use two gauges on both sides",
        harm, math.nan, "", harm, "rig.displacement.offset",
    )  # fmt: skip
