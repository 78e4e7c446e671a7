"""May this plan run, and can it succeed: every reason at once, before anything moves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from stepload.contact.elastic import law_for
from stepload.contact.limit import elastic_limit, no_limit_reason
from stepload.contact.power_law import ContactLaw
from stepload.contact.press import Term
from stepload.errors import DomainError, RefusedError
from stepload.feasibility.hazards import hazards
from stepload.feasibility.identifiability import (
    Identifiability,
    gauge_resolution_for,
    identifiability,
    top_force_for,
)
from stepload.feasibility.schedule import Stage, schedule
from stepload.feasibility.softness import softness
from stepload.feasibility.verdict import Reason, Severity, Verdict, verdict_of
from stepload.plan.model import Payload, Plan, Provenance, SecondForceSource
from stepload.plan.pressing import (
    AGE_S,
    Pressing,
    largest_top_force,
    pressing_for,
    retract_speed_m_s,
    step_rate_per_s,
)
from stepload.units import format_quantity

ALMOST = 0.999


@dataclass(frozen=True, slots=True)
class Theory:
    """What contact theory and the plan say of a payload.

    `limit_equation` says where `elastic_limit_n` comes from.
    """

    law: ContactLaw
    elastic_limit_n: float
    limit_equation: str


@dataclass(frozen=True, slots=True)
class Preflight:
    """The whole answer.

    Where the top force is refused, speeds and budget are those at the largest safe force; where no
    force is safe, the speeds are 0 and the budget is empty.
    """

    verdict: Verdict
    reasons: tuple[Reason, ...]
    theory: Theory
    top_force_n: float
    largest_safe_force_n: float
    force_limit_n: float
    deformation_m: float
    secant_n_per_m: float
    secant_force_n: float
    secant_at_top_n_per_m: float
    identifiability: Identifiability | None
    guarded_speed_m_s: float
    fast_speed_m_s: float
    force_budget: tuple[Term, ...]
    stages: tuple[Stage, ...]

    @property
    def duration_s(self) -> float:
        """Expected duration of the whole run; 0 where it may not start."""
        return sum(stage.total_s for stage in self.stages)


def theory_of(payload: Payload) -> Theory:
    """Law and elastic limit of a payload; a declared limit wins where it is lower.

    Raises:
        RefusedError: neither theory nor the plan gives a limit.
    """
    law = law_for(payload.geometry, payload.material, payload.plate)
    limit = elastic_limit(payload.geometry, payload.material, payload.plate)
    declared_n = payload.declared_force_limit_n
    if declared_n is not None and (limit is None or declared_n < limit.force_n):
        return Theory(law, declared_n, "declared in the plan")
    if limit is None:
        raise RefusedError(
            no_limit_reason(payload.geometry, payload.material, payload.plate),
            hint="declare the payload's force_limit in the plan",
        )
    return Theory(law, limit.force_n, f"{limit.equation} elastic-plastic sphere")


def _with_top(plan: Plan, top_n: float) -> Plan:
    step_n = min(plan.procedure.step_n, top_n)
    procedure = replace(plan.procedure, top_force_n=top_n, step_n=step_n, levels_n=(top_n,))
    return replace(plan, procedure=procedure)


def _press(
    plan: Plan, elastic_limit_n: float, safe_n: float
) -> tuple[Pressing | None, RefusedError | None]:
    """How this plan may press, and why not as planned (None when it may)."""
    try:
        return pressing_for(plan, elastic_limit_n=elastic_limit_n), None
    except RefusedError as refusal:
        why = refusal
    try:
        lower = _with_top(plan, min(plan.procedure.top_force_n, ALMOST * safe_n))
        return pressing_for(lower, elastic_limit_n=elastic_limit_n), why
    except (RefusedError, DomainError):
        return None, why


def _force_reasons(plan: Plan, safe_n: float, refusal: RefusedError | None) -> Iterator[Reason]:
    top_n = plan.procedure.top_force_n
    if refusal:
        useful = safe_n > 3.0 * plan.procedure.touch_force_n
        yield Reason(
            "top_force_above_safe_limit" if top_n > safe_n else "no_safe_way_to_press",
            Severity.REFUSE,
            f"{refusal.message}. This cannot be overridden",
            f"reduce top_force to {math.floor(safe_n * 10.0) / 10.0:g} N"
            if useful and top_n > safe_n
            else refusal.hint,
            top_n,
            safe_n,
            "N",
        )
    push_n = plan.rig.arm.max_push_n
    if top_n > push_n:
        yield Reason(
            "arm_too_weak",
            Severity.REFUSE,
            f"the arm pushes at most {format_quantity(push_n, 'N')}, top force is "
            f"{format_quantity(top_n, 'N')}",
            f"reduce top_force to {format_quantity(0.9 * push_n, 'N')} or use a stronger arm",
            top_n,
            push_n,
            "N",
        )
    range_n = plan.rig.force.range_n
    if top_n > range_n:
        yield Reason(
            "sensor_range",
            Severity.REFUSE,
            f"top force {format_quantity(top_n, 'N')} is beyond the force sensor's range "
            f"{format_quantity(range_n, 'N')}",
            "reduce top_force or use a sensor with a larger range",
            top_n,
            range_n,
            "N",
        )


def _identifiability_of(plan: Plan) -> Identifiability:
    gauge = plan.rig.displacement
    return identifiability(
        plan.procedure.top_force_n,
        gauge.resolution_m if gauge else plan.rig.arm.position_resolution_m,
        None if gauge else plan.rig.system_stiffness.stiffness_n_per_m,
        p=plan.identify.resolution_multiple_p,
        s=plan.identify.compensation_quality_s,
        t=plan.identify.accuracy_t,
    )


def _way_out(plan: Plan, secant_n_per_m: float) -> str:
    """What would make a payload of this secant identifiable."""
    top_n = plan.procedure.top_force_n
    p, t = plan.identify.resolution_multiple_p, plan.identify.accuracy_t
    gauge_m = gauge_resolution_for(secant_n_per_m, top_n, p=p, t=t)
    ways = [
        f"a displacement gauge of {format_quantity(gauge_m, 'm')} across the contact raises "
        f"K_max to {format_quantity(secant_n_per_m, 'N/m')}"
    ]
    if plan.rig.displacement is None:
        force_n = top_force_for(
            secant_n_per_m,
            plan.rig.arm.position_resolution_m,
            plan.rig.system_stiffness.stiffness_n_per_m,
            p=p,
            s=plan.identify.compensation_quality_s,
            t=t,
        )
        if force_n is None:
            ways.append("no top force would: the system stiffness rules")
        else:
            ways.append(f"so would a top force of {format_quantity(force_n, 'N')}")
    return "; ".join(ways)


def _identifiable_reasons(
    plan: Plan, secant_n_per_m: float, found: Identifiability
) -> Iterator[Reason]:
    k_max = found.k_max_n_per_m
    if math.isnan(secant_n_per_m) or secant_n_per_m <= 0.8 * k_max:
        return
    figures = (
        f"predicted secant {format_quantity(secant_n_per_m, 'N/m')} is "
        f"{secant_n_per_m / k_max:.2g} of K_max {format_quantity(k_max, 'N/m')} (34); "
        f"{found.binding} binds"
    )
    if secant_n_per_m <= k_max:
        yield Reason(
            "close_to_k_max", Severity.WARN, figures, _way_out(plan, secant_n_per_m),
            secant_n_per_m, k_max, "N/m",
        )  # fmt: skip
    elif plan.identify.accept_unidentifiable:
        yield Reason(
            "unidentifiable_accepted", Severity.WARN,
            f"not identifiable on this rig: {figures}; accepted in the plan: "
            f"“{plan.identify.accept_unidentifiable}”",
            _way_out(plan, secant_n_per_m), secant_n_per_m, k_max, "N/m",
        )  # fmt: skip
    else:
        yield Reason(
            "unidentifiable", Severity.REFUSE, f"not identifiable on this rig: {figures}",
            _way_out(plan, secant_n_per_m)
            + "; or accept it in writing with identify.accept_unidentifiable",
            secant_n_per_m, k_max, "N/m",
        )  # fmt: skip


def _rig_reasons(plan: Plan) -> Iterator[Reason]:
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
            "declare a second force channel (the arm's own, or a second sensor)",
        )


def _age_reasons(plan: Plan) -> Iterator[Reason]:
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


def preflight(plan: Plan) -> Preflight:
    """Judge a plan; every reason at once.

    Raises:
        RefusedError: no elastic limit is known, so nothing can be judged.
    """
    procedure = plan.procedure
    theory = theory_of(plan.payload)
    safe_n = largest_top_force(plan, elastic_limit_n=theory.elastic_limit_n)
    pressing, refusal = _press(plan, theory.elastic_limit_n, safe_n)
    secant_at_top = theory.law.secant(procedure.top_force_n)
    found = None if plan.identify.kind == "system" else _identifiability_of(plan)
    reasons = [*_force_reasons(plan, safe_n, refusal), *_rig_reasons(plan), *_age_reasons(plan)]
    if found is not None:
        reasons += _identifiable_reasons(plan, secant_at_top, found)
    if pressing is not None:
        reasons += hazards(plan, pressing)
        if not refusal:
            reasons += softness(plan, pressing, theory.law, theory.elastic_limit_n)
    return Preflight(
        verdict=verdict_of(reasons),
        reasons=tuple(reasons),
        theory=theory,
        top_force_n=procedure.top_force_n,
        largest_safe_force_n=safe_n,
        force_limit_n=pressing.forces.limit_n if pressing else 0.0,
        deformation_m=procedure.top_force_n / secant_at_top,
        secant_n_per_m=theory.law.secant(plan.identify.secant_force_n),
        secant_force_n=plan.identify.secant_force_n,
        secant_at_top_n_per_m=secant_at_top,
        identifiability=found,
        guarded_speed_m_s=pressing.guarded_speed_m_s if pressing else 0.0,
        fast_speed_m_s=pressing.fast_speed_m_s if pressing else 0.0,
        force_budget=pressing.guarded_budget(procedure.touch_force_n) if pressing else (),
        stages=()
        if pressing is None
        else schedule(
            procedure,
            fast_speed_m_s=pressing.fast_speed_m_s,
            guarded_speed_m_s=pressing.guarded_speed_m_s,
            retract_speed_m_s=retract_speed_m_s(plan.rig),
            step_rate_per_s=step_rate_per_s(pressing.rig.loop_s),
        ),
    )
