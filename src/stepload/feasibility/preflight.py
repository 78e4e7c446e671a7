"""Everything that is known before motion, derived once from a plan and handed down.

Commands print a preflight, the run obeys it, the record keeps it and the report shows it. Only the
tare derives it again, with the measured noise and drift of the force sensor.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from stepload.errors import DomainError, RefusedError
from stepload.feasibility.advice import advised
from stepload.feasibility.aligning import Aligning, aligning_of, aligning_reasons
from stepload.feasibility.bounds import Measured, press_rig
from stepload.feasibility.conditions import expected_result
from stepload.feasibility.domains import domain_reasons
from stepload.feasibility.lateral import lateral_reasons, share_reasons
from stepload.feasibility.limits import RunLimits, limits_of
from stepload.feasibility.load_times import LoadTimes, load_times
from stepload.feasibility.press import PressRig, Term
from stepload.feasibility.pressing import Pressing, largest_top_force, pressing_for
from stepload.feasibility.reason import PlanVerdict, Reason, Severity, verdict_of
from stepload.feasibility.reasons import (
    age_reasons,
    cycle_reasons,
    force_reasons,
    friction_reasons,
    identifiable_reasons,
    one_channel_reasons,
    rig_reasons,
    softness,
)
from stepload.feasibility.schedule import Stage, align_s, schedule
from stepload.feasibility.stiffness import stiffness_reasons
from stepload.feasibility.theory import Theory, theory_of
from stepload.feasibility.until import Until, until_of, until_reasons
from stepload.feasibility.zero_drift import second_zero_n
from stepload.feasibility.zero_reasons import looked_after_s, zero_drift_reasons
from stepload.identification.identifiability import Identifiability, identifiability
from stepload.identification.quantity import ResultVerdict
from stepload.plan.checks import least_touch_force
from stepload.plan.derived import follows, rederived
from stepload.plan.model import Plan, SecondForceSource

ALMOST = 0.999
"""Share of the largest safe force at which the figures of a refused plan are shown."""


IN_THE_INTERVAL = (
    "stiffness_indicative", "stiffness_uncertain", "friction_unknown", "gauge_offset",
)  # fmt: skip
"""Codes of doubts that are bounded, and are part of the result's interval."""


LOWER = 0.85
"""Factor from one touch force to the next that is tried."""
SURE_OF_TOUCH = 1.02
"""Least touch force over the one that noise reaches."""
SPARE_DRIFT = 1.5
"""Room for the stated drift over the drift as planned: a softer payload takes longer, and with more
room the run is slower."""


@dataclass(frozen=True, slots=True)
class Preflight:
    """What follows from a plan: theory, forces, limits, speeds, schedule, and whether it may run.

    `limits` are the thresholds of the run; None where the plan may not be pressed as it stands,
    `refusal` says why. Speeds and force budget are then those at the largest safe force; where no
    force is safe the speeds are 0 and the budget is empty. `bounds` are the rig's delays and
    inertia, `until` the deformation needed at every level where the plan may end its loading early,
    `aligning` the parameters of motion across the approach. `secant_n_per_m`, at
    `identify.secant_force_n` of the plan, and the deformation are theory's.
    """

    plan: Plan
    verdict: PlanVerdict
    reasons: tuple[Reason, ...]
    theory: Theory
    bounds: PressRig
    limits: RunLimits | None
    refusal: RefusedError | DomainError | None
    largest_safe_force_n: float
    force_limit_n: float
    deformation_m: float
    secant_n_per_m: float
    identifiability: Identifiability | None
    guarded_speed_m_s: float
    fast_speed_m_s: float
    force_budget: tuple[Term, ...]
    stages: tuple[Stage, ...]
    loading_times: LoadTimes | None = None
    until: Until | None = None
    aligning: Aligning | None = None

    @property
    def duration_s(self) -> float:
        """Expected duration of the whole run; 0 where it may not start."""
        return sum(stage.total_s for stage in self.stages)

    @property
    def run_limits(self) -> RunLimits:
        """The thresholds of a plan that may be pressed.

        Raises:
            RefusedError: it may not.
        """
        if self.limits is None:
            assert self.refusal is not None
            raise RefusedError(self.refusal.message, hint=self.refusal.hint)
        return self.limits


def preflight_of(plan: Plan, measured: Measured | None = None) -> Preflight:
    """Derive everything that is known about a plan before it moves anything.

    Before the run the remedies are tried, each with a preflight of its own; not during a run.

    Args:
        measured: noise and drift that the run itself has found, where they are worse than planned.

    Raises:
        RefusedError: no elastic limit is known, so nothing can be judged.
        DomainError: a number outside the domain of contact theory.
    """
    preflight = derive(plan, measured)
    if measured is not None:
        return preflight
    told = advised(plan, preflight.reasons, lambda p: derive(p).reasons)
    if preflight.limits is not None:
        told = _by_result(preflight, told)
    until = None if preflight.limits is None else until_of(plan, preflight.theory)
    if until is not None:
        told = (*told, *until_reasons(until))
    return replace(preflight, until=until, reasons=told, verdict=verdict_of(told))


def _by_result(preflight: Preflight, reasons: tuple[Reason, ...]) -> tuple[Reason, ...]:
    """The reasons; what is in the result's interval is a note where that is narrow enough."""
    if not any(each.code in IN_THE_INTERVAL for each in reasons):
        return reasons
    plan = preflight.plan
    try:
        expected = expected_result(plan, preflight.theory, preflight.loading_times)
    except DomainError:
        return reasons
    enough = expected.chord.verdict is ResultVerdict.IDENTIFIED
    return tuple(
        replace(each, severity=Severity.NOTE) if enough and each.code in IN_THE_INTERVAL else each
        for each in reasons
    )


def derive(plan: Plan, measured: Measured | None = None) -> Preflight:
    """The preflight of a plan without trying any remedies; otherwise as `preflight_of`.

    What each level needs for `procedure.until` is left out: such a run goes up to the top force.
    A `touch_force` that nobody wrote is as low as the force budget needs; a `max_drift` that nobody
    wrote and the tolerance of R5 leave room for the stated drift.
    """
    preflight = _derived(plan, measured)
    if preflight.limits is None and follows(plan, "procedure", "touch_force_n"):
        preflight = _with_lower_touch(preflight, measured)
        plan = preflight.plan
    if (roomy := _with_drift(plan, preflight)) == plan:
        return preflight
    roomier = _derived(roomy, measured)
    return preflight if roomier.limits is None else roomier


def _with_drift(plan: Plan, preflight: Preflight) -> Plan:
    """The plan with room for what the stated drifts of both channels give until the next zero."""
    procedure, second = plan.procedure, plan.rig.second_force
    looked_s = SPARE_DRIFT * looked_after_s(procedure, preflight.bounds.loop_s, preflight.stages)
    shift_n = looked_s * plan.rig.force.drift_n_per_s
    if shift_n > procedure.max_drift_n and follows(plan, "procedure", "max_drift_n"):
        procedure = replace(procedure, max_drift_n=shift_n)
    if second.source is not SecondForceSource.NONE:
        drift_n_per_s = second.sensor.drift_n_per_s if second.sensor else 0.0
        zero_n = max(second_zero_n(second), looked_s * drift_n_per_s)
        apart_n = zero_n + min(shift_n, procedure.max_drift_n)
        if apart_n > second.tolerance_n:
            second = replace(second, tolerance_n=apart_n, zero_error_n=zero_n)
    return replace(plan, procedure=procedure, rig=replace(plan.rig, second_force=second))


def _with_lower_touch(preflight: Preflight, measured: Measured | None) -> Preflight:
    """The plan at the highest touch force at which it may be pressed; as it is where none helps."""
    plan = preflight.plan
    least_n = SURE_OF_TOUCH * least_touch_force(plan.rig.force.noise_n)
    touch_n = plan.procedure.touch_force_n
    if plan.procedure.top_force_n > preflight.largest_safe_force_n:
        return preflight
    while touch_n > least_n:
        touch_n = max(least_n, LOWER * touch_n)
        procedure = replace(plan.procedure, touch_force_n=touch_n)
        changed = _derived(rederived(plan, replace(plan, procedure=procedure)), measured)
        if changed.limits is not None:
            return changed
    return preflight


def _derived(plan: Plan, measured: Measured | None) -> Preflight:
    theory = theory_of(plan.payload, plan.procedure.top_force_n)
    bounds = press_rig(plan.rig, plan.rig.force.noise_n)
    safe_n = largest_top_force(plan, theory.counted.lower_n)
    pressing, limits, refusal = _pressed(plan, theory, safe_n, measured)
    found = None if plan.identify.kind == "system" else _identifiability_of(plan)
    stages: tuple[Stage, ...] = ()
    loading_times = aligning = None
    if limits is not None:
        loading_times = load_times(plan, limits, theory.law)
        aligning = aligning_of(plan, limits)
        stages = schedule(
            plan.procedure,
            limits,
            loading_times,
            align_s=align_s(plan.procedure, limits, aligning) if aligning is not None else 0.0,
        )
    reasons = [
        *force_reasons(plan, safe_n, refusal, theory),
        *domain_reasons(plan, theory),
        *rig_reasons(plan, theory.law.secant(plan.procedure.top_force_n)),
        *one_channel_reasons(plan),
        *zero_drift_reasons(plan, bounds.loop_s, stages),
        *age_reasons(plan),
        *cycle_reasons(plan),
        *stiffness_reasons(plan),
        *friction_reasons(plan, theory),
        *lateral_reasons(plan),
        *aligning_reasons(plan, limits),
    ]
    if found is not None:
        hardest = theory.stiffest.secant(plan.procedure.top_force_n)
        reasons += identifiable_reasons(plan, hardest, found)
    if limits is not None:
        reasons += share_reasons(plan, limits.lateral_from_n, limits.allowed_n)
        reasons += softness(plan, limits, theory)
    return Preflight(
        plan=plan,
        verdict=verdict_of(reasons),
        reasons=tuple(reasons),
        theory=theory,
        bounds=bounds,
        limits=limits,
        refusal=refusal,
        largest_safe_force_n=safe_n,
        force_limit_n=pressing.forces.limit_n if pressing else 0.0,
        deformation_m=plan.procedure.top_force_n / theory.law.secant(plan.procedure.top_force_n),
        secant_n_per_m=theory.law.secant(plan.identify.secant_force_n),
        identifiability=found,
        guarded_speed_m_s=pressing.guarded_speed_m_s if pressing else 0.0,
        fast_speed_m_s=pressing.fast_speed_m_s if pressing else 0.0,
        force_budget=pressing.guarded_budget(plan.procedure.touch_force_n) if pressing else (),
        stages=stages,
        loading_times=loading_times,
        aligning=aligning,
    )


def refusal_of(preflight: Preflight) -> RefusedError:
    """The error of a plan that may not run: every refusing reason with its remedy."""
    lines = [
        f"{reason.message}\n  -> {reason.remedy}"
        for reason in preflight.reasons
        if reason.severity is Severity.REFUSE
    ]
    return RefusedError("preflight refused the plan:\n" + "\n".join(lines))


def _pressed(
    plan: Plan, theory: Theory, safe_n: float, measured: Measured | None
) -> tuple[Pressing | None, RunLimits | None, RefusedError | DomainError | None]:
    """How this plan may press, with which limits, or why not as planned.

    A refused plan is shown at the largest force that is safe, if there is any.
    """
    bounds = theory.softest, theory.stiffest, theory.counted.lower_n
    try:
        pressing = pressing_for(plan, *bounds, measured)
        return pressing, limits_of(plan, pressing, theory.elastic_limit_n), None
    except (RefusedError, DomainError) as error:
        refusal = error
    try:
        lower = _with_top(plan, min(plan.procedure.top_force_n, ALMOST * safe_n))
        return pressing_for(lower, *bounds, measured), None, refusal
    except (RefusedError, DomainError):
        return None, None, refusal


def _with_top(plan: Plan, top_n: float) -> Plan:
    step_n = min(plan.procedure.step_n, top_n)
    procedure = replace(plan.procedure, top_force_n=top_n, step_n=step_n, levels_n=(top_n,))
    return replace(plan, procedure=procedure)


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
