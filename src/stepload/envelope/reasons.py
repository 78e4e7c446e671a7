"""Reasons for and against a plan, each with its numbers.

Remedies that change a plan's forces or devices are left to `advice`, which tries them first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from stepload.envelope.bounds import AGE_S
from stepload.envelope.limit_reasons import counted_on
from stepload.envelope.reason import Reason, Severity
from stepload.envelope.theory import CountedLimit
from stepload.errors import DomainError, RefusedError
from stepload.estimators.identifiability import Identifiability
from stepload.evidence.gates import UNLOADED
from stepload.plan.model import Plan, Provenance, SecondForceSource
from stepload.units import format_quantity

WHOLE = 2
"""A first loading and one more of the same contact: the least that reveals set and drift."""


def force_reasons(
    plan: Plan,
    safe_n: float,
    refusal: RefusedError | DomainError | None,
    counted: CountedLimit,
) -> Iterator[Reason]:
    """Why the forces asked for may not be pressed."""
    top_n = plan.procedure.top_force_n
    if refusal:
        why = f". {counted_on(counted)}" if counted.sigma_ln > 0.0 and top_n > safe_n else ""
        yield _too_much(
            "top_force_above_safe_limit" if top_n > safe_n else "no_safe_way_to_press",
            f"{refusal.message}{why}. This cannot be overridden",
            top_n,
            safe_n,
        )
    push_n = plan.rig.arm.max_push_n
    if top_n > push_n:
        message = (
            f"the arm pushes at most {format_quantity(push_n, 'N')}, top force is "
            f"{format_quantity(top_n, 'N')}"
        )
        yield _too_much("arm_too_weak", message, top_n, push_n)
    range_n = plan.rig.force.range_n
    if top_n > range_n:
        message = (
            f"top force {format_quantity(top_n, 'N')} is beyond the force sensor's range "
            f"{format_quantity(range_n, 'N')}"
        )
        yield _too_much("sensor_range", message, top_n, range_n)


def _too_much(code: str, message: str, top_n: float, limit_n: float) -> Reason:
    """A refusal of the top force, whose remedies are tried later."""
    return Reason(code, Severity.REFUSE, message, "", top_n, limit_n, "N")


def identifiable_reasons(
    plan: Plan, secant_n_per_m: float, found: Identifiability
) -> Iterator[Reason]:
    """Why the payload cannot, or can hardly, be identified on this rig (34)."""
    k_max = found.k_max_n_per_m
    if math.isnan(secant_n_per_m) or secant_n_per_m <= 0.8 * k_max:
        return
    figures = (
        f"predicted secant {format_quantity(secant_n_per_m, 'N/m')} is "
        f"{secant_n_per_m / k_max:.3g} times K_max {format_quantity(k_max, 'N/m')} (34); "
        f"{found.binding} binds"
    )
    if secant_n_per_m <= k_max:
        yield Reason(
            "close_to_k_max", Severity.WARN, figures, "", secant_n_per_m, k_max, "N/m",
        )  # fmt: skip
    elif plan.identify.accept_unidentifiable:
        yield Reason(
            "unidentifiable_accepted", Severity.WARN,
            f"not identifiable on this rig: {figures}; accepted in the plan: "
            f"“{plan.identify.accept_unidentifiable}”",
            "", secant_n_per_m, k_max, "N/m",
        )  # fmt: skip
    else:
        yield Reason(
            "unidentifiable", Severity.REFUSE, f"not identifiable on this rig: {figures}", "",
            secant_n_per_m, k_max, "N/m",
        )  # fmt: skip


def rig_reasons(plan: Plan) -> Iterator[Reason]:
    """What is doubtful about the rig: its system stiffness, its only force channel."""
    stiffness = plan.rig.system_stiffness
    relative = stiffness.sigma_n_per_m / stiffness.stiffness_n_per_m
    quality = plan.identify.compensation_quality_s
    if plan.rig.displacement is None and plan.identify.kind != "system":
        if stiffness.provenance is Provenance.INDICATIVE:
            yield Reason(
                "stiffness_indicative",
                Severity.WARN,
                f"K_s = {format_quantity(stiffness.stiffness_n_per_m, 'N/m')} is an indicative "
                "figure for this class of arm, not a measurement",
                "run a system-stiffness calibration (stepload calibrate) in this pose",
            )
        elif relative * quality > 1.0:
            yield Reason(
                "stiffness_uncertain",
                Severity.WARN,
                f"K_s is known to {relative:.1%}, the compensation quality s = {quality:g} "
                f"asks for {1.0 / quality:.1%}",
                "calibrate K_s again, with force above 40 % of the range",
                relative,
                1.0 / quality,
            )
        if stiffness.validity_problem:
            yield Reason(
                "calibration_record",
                Severity.WARN,
                f"calibration record: {stiffness.validity_problem}",
                "calibrate again, or state the policy in rig.system_stiffness.policy",
            )
    if stiffness.simulated:
        yield Reason(
            "calibration_simulated",
            Severity.WARN,
            f"the calibration record {stiffness.record} was made in a dry run: good for dry runs "
            "only, a run on the rig will be refused",
            "measure K_s on the rig: stepload calibrate PLAN --record FILE",
        )
    if plan.rig.second_force.source is SecondForceSource.NONE:
        yield Reason(
            "one_force_channel",
            Severity.WARN,
            "one force channel: a wrong gain, a bias or a stuck mean under live noise cannot be "
            "seen, and would press on through F_c",
            "",
        )


def age_reasons(plan: Plan) -> Iterator[Reason]:
    """Streams whose data may be older than usual before R3 stops the run."""
    rig, second = plan.rig, plan.rig.second_force.sensor
    limits = {
        "arm": rig.arm.max_age_s,
        "force": rig.force.max_age_s,
        "second_force.sensor": second.max_age_s if second else None,
    }
    for name, limit_s in limits.items():
        if limit_s is None or limit_s <= AGE_S:
            continue
        yield Reason(
            "patient",
            Severity.WARN,
            f"rig.{name}.max_age lets a run go on for {limit_s * 1e3:.0f} ms without new data "
            f"({AGE_S * 1e3:.0f} ms otherwise): until then only the leash bounds the force",
            "for emulators on a busy machine; leave it out on a real rig",
            limit_s,
            AGE_S,
            "s",
        )


def cycle_reasons(plan: Plan) -> Iterator[Reason]:
    """What repeated loading would have shown and this plan does not; notes, no refusals."""
    procedure = plan.procedure
    if procedure.levels_n[0] > procedure.step_n * (1.0 + 1e-9):
        yield Reason(
            "levels_left_out", Severity.NOTE,
            f"levels up to the touch force {format_quantity(procedure.touch_force_n, 'N')} are left"
            f" out: the first is {format_quantity(procedure.levels_n[0], 'N')}",
            "", procedure.touch_force_n, procedure.step_n, "N",
        )  # fmt: skip
    if procedure.cycles < WHOLE:
        hint = "only the gap between loading and unloading hints at them"
        down = procedure.levels_n[0] / procedure.top_force_n
        if not procedure.unload:
            hint = "without stepped unloading nothing hints at them, and no figure is identified"
        elif down > UNLOADED:
            hint = (
                f"an unloading that ends at {down:.0%} of the top force shows little of them, and"
                f" no figure is identified (up to {UNLOADED:.0%} counts)"
            )
        yield Reason(
            "one_cycle", Severity.NOTE,
            f"one cycle: set, creep and drift cannot be told from the contact's law; {hint}",
            "plan `cycles: 2` with `unload: true`", procedure.cycles, WHOLE, "",
        )  # fmt: skip
    elif not procedure.unload:
        yield Reason(
            "no_unloading",
            Severity.NOTE,
            "no holds on the way down: the second loading shows set and drift, but creep cannot "
            "be told from them",
            "plan `unload: true`",
        )
