"""Reasons for and against a plan, each with its numbers.

Remedies that change a plan's forces or devices are left to `advice`, which tries them first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from stepload.envelope.bounds import AGE_S
from stepload.envelope.force_limits import headroom
from stepload.envelope.pressing import largest_losses
from stepload.envelope.reason import Reason, Severity
from stepload.envelope.theory import DECLARED, Theory
from stepload.errors import DomainError, RefusedError
from stepload.estimators.identifiability import Identifiability
from stepload.estimators.smooth import NORMAL_95
from stepload.plan.model import Plan, Provenance
from stepload.units import format_quantity, rounded_down

MOST_WORDS = 24
"""Words of a text from elsewhere that a finding quotes."""
WHOLE = 2
"""A first loading and one more of the same contact: the least that reveals set and drift."""


def force_reasons(
    plan: Plan,
    safe_n: float,
    refusal: RefusedError | DomainError | None,
    theory: Theory,
) -> Iterator[Reason]:
    """Why the forces asked for may not be pressed."""
    top_n = plan.procedure.top_force_n
    if refusal is not None and top_n > safe_n:
        yield _too_much("top_force_above_safe_limit", _above(plan, safe_n, theory), top_n, safe_n)
    elif refusal is not None:
        yield _too_much("no_safe_way_to_press", short(f"{refusal.message}."), top_n, safe_n)
    push_n = plan.rig.arm.max_push_n
    if top_n > push_n:
        message = (
            f"The arm pushes at most {format_quantity(push_n, 'N')}, top force is "
            f"{format_quantity(top_n, 'N')}."
        )
        yield _too_much("arm_too_weak", message, top_n, push_n)
    range_n = plan.rig.force.range_n
    if top_n > range_n:
        message = (
            f"Top force {format_quantity(top_n, 'N')} is beyond the force sensor's range "
            f"{format_quantity(range_n, 'N')}."
        )
        yield _too_much("sensor_range", message, top_n, range_n)


def _above(plan: Plan, safe_n: float, theory: Theory) -> str:
    """The top force beside F_c, or beside what is left of it on this rig."""
    top_n, counted = plan.procedure.top_force_n, theory.counted
    top, used = format_quantity(top_n, "N"), format_quantity(counted.lower_n, "N")
    safe = format_quantity(rounded_down(safe_n), "N")
    if top_n > counted.value_n:
        whose, onset = "the elastic limit of the contact", theory.yield_onset
        if declared := counted.equation == DECLARED:
            whose = "the stated force_limit"
        own = f"; by (13) {format_quantity(onset.force_n, 'N')}" if declared and onset else ""
        limit = format_quantity(counted.value_n, "N")
        return f"{top} is {top_n / counted.value_n:.3g} times {whose}, {limit}{own}."
    capacity_n = min(plan.rig.arm.max_push_n, 0.95 * plan.rig.force.range_n)
    headroom_n = headroom(plan.rig.force.noise_n, plan.procedure.step_n)
    if safe_n >= 0.999 * (capacity_n - headroom_n):
        return f"{top} is above the {safe} that arm and force sensor leave, headroom taken off."
    name, loss_n = largest_losses(plan, counted.lower_n)[0]
    loss = f"{name}, {format_quantity(loss_n, 'N')}."
    if safe_n <= 0.0:
        return f"Nothing of F_c used ({used}) is left to press. Largest loss: {loss}"
    return (
        f"{top} is above the largest safe top force, {safe}. Largest loss from F_c used ({used}):"
        f" {loss}"
    )


def _too_much(code: str, message: str, top_n: float, limit_n: float) -> Reason:
    """A refusal of the top force, whose remedies are tried later."""
    key = "procedure.top_force"
    return Reason(code, Severity.REFUSE, message, "", top_n, limit_n, "N", key=key)


def identifiable_reasons(
    plan: Plan, secant_n_per_m: float, found: Identifiability
) -> Iterator[Reason]:
    """Why the payload cannot, or can hardly, be identified on this rig (34)."""
    k_max = found.k_max_n_per_m
    if math.isnan(secant_n_per_m) or secant_n_per_m <= 0.8 * k_max:
        return
    figures = (
        f"the predicted {format_quantity(secant_n_per_m, 'N/m')} is "
        f"{secant_n_per_m / k_max:.3g} times K_max, {format_quantity(k_max, 'N/m')} (34); "
        f"{found.binding} binds."
    )
    cost = secant_n_per_m / k_max / plan.identify.accuracy_t
    if secant_n_per_m <= k_max:
        yield Reason(
            "close_to_k_max", Severity.WARN, f"Hardly identifiable: {figures}", "",
            secant_n_per_m, k_max, "N/m", cost,
        )  # fmt: skip
    elif plan.identify.accept_unidentifiable:
        yield Reason(
            "unidentifiable_accepted", Severity.WARN,
            f"Not identifiable, as accepted: {figures}", "",
            secant_n_per_m, k_max, "N/m", cost,
        )  # fmt: skip
    else:
        yield Reason(
            "unidentifiable", Severity.REFUSE, f"Not identifiable: {figures}", "",
            secant_n_per_m, k_max, "N/m", cost,
        )  # fmt: skip


def rig_reasons(plan: Plan, secant_n_per_m: float) -> Iterator[Reason]:
    """What is doubtful about the rig: its system stiffness, its only force channel.

    Args:
        plan: of the run.
        secant_n_per_m: of the payload at the top force.
    """
    system = plan.rig.system_stiffness
    relative = system.sigma_n_per_m / system.stiffness_n_per_m
    quality = plan.identify.compensation_quality_s
    cost = NORMAL_95 * relative * secant_n_per_m / system.stiffness_n_per_m
    known = f"{100.0 * NORMAL_95 * relative:.2g} % (95 %)"
    effect = f"{format_quantity(system.stiffness_n_per_m, 'N/m')} ± {known}"
    if plan.rig.displacement is None and plan.identify.kind != "system":
        if system.provenance is Provenance.INDICATIVE:
            yield Reason(
                "stiffness_indicative", Severity.WARN,
                f"K_s is a class figure, {effect}. It costs ±{100.0 * cost:.2g} % of the result.",
                "stepload calibrate in this pose", relative, 1.0 / quality, "", cost,
            )  # fmt: skip
        elif relative * quality > 1.0:
            yield Reason(
                "stiffness_uncertain", Severity.WARN,
                f"K_s is known as {effect}; s = {quality:g} asks for"
                f" ±{100.0 * NORMAL_95 / quality:.2g} %."
                f" It costs ±{100.0 * cost:.2g} % of the result.",
                "stepload calibrate again, with more force and more levels",
                relative, 1.0 / quality, "", cost, "rig.system_stiffness",
            )  # fmt: skip
        if system.validity_problem:
            yield Reason(
                "calibration_record", Severity.WARN,
                f"Calibration record: {short(system.validity_problem)}.",
                "calibrate again, or state rig.system_stiffness.policy", cost=cost,
            )  # fmt: skip
    if system.simulated:
        yield Reason(
            "calibration_simulated", Severity.WARN,
            "The calibration record was made in a dry run; it is good for dry runs only.",
            "measure K_s on the rig: stepload calibrate PLAN --record FILE", cost=1.0,
        )  # fmt: skip


def short(text: str) -> str:
    """The first words of a text from elsewhere."""
    words = text.split()
    return text if len(words) <= MOST_WORDS else f"{' '.join(words[:MOST_WORDS])} …"


def age_reasons(plan: Plan) -> Iterator[Reason]:
    """Streams whose data may be older than usual before R3 stops the run."""
    rig, second = plan.rig, plan.rig.second_force.sensor
    limits = {
        "arm": rig.arm.max_age_s,
        "force": rig.force.max_age_s,
        "second_force.sensor": second.max_age_s if second else None,
    }
    patient = {name: s for name, s in limits.items() if s is not None and s > AGE_S}
    if not patient:
        return
    limit_s = max(patient.values())
    yield Reason(
        "patient", Severity.WARN,
        f"max_age of {', '.join(patient)} lets the run go on for {limit_s * 1e3:.0f} ms without new"
        f" data; {AGE_S * 1e3:.0f} ms is usual.",
        "leave max_age out; it is for emulators on a busy computer",
        limit_s, AGE_S, "s", 0.0, f"rig.{next(iter(patient))}.max_age",
    )  # fmt: skip


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
        yield Reason(
            "one_cycle", Severity.NOTE,
            "One cycle: set, creep and drift cannot be told from the contact law.",
            "cycles: 2 with unload: true", procedure.cycles, WHOLE, "", key="procedure.cycles",
        )  # fmt: skip
    elif not procedure.unload:
        yield Reason(
            "no_unloading",
            Severity.NOTE,
            "No holds while unloading: creep cannot be told from set and drift.",
            "unload: true",
            key="procedure.unload",
        )
