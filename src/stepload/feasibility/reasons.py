"""Reasons for and against a plan, each with its numbers.

Remedies that change a plan's forces or devices are left to `advice`, which tries them first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache
from typing import cast

from stepload.declaration.sections import keys, schema_of
from stepload.errors import DomainError, RefusedError
from stepload.feasibility.bounds import AGE_S, LEAST_CLASS_RATIO, largest_stiffness, step_patience_s
from stepload.feasibility.conditions import across_of, gauge_offset_of
from stepload.feasibility.force_limits import headroom
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.load_times import load_times
from stepload.feasibility.pressing import largest_losses
from stepload.feasibility.reason import Reason, Severity
from stepload.feasibility.theory import DECLARED, Theory
from stepload.identification.identifiability import Identifiability
from stepload.identification.lateral import TURN_RAD_PER_N, UNKNOWN_FRICTION
from stepload.identification.smooth import NORMAL_95
from stepload.plan.model import DeviceSpec, Plan, Provenance, SecondForceSource, Structure
from stepload.rig.device import ForceSensor
from stepload.rig.plugins import load_driver
from stepload.units import format_quantity, percent, rounded_down

MOST_WORDS = 24
"""Words of a text from elsewhere that a finding quotes."""
WHOLE = 2
"""A first loading and one more of the same contact: the least that reveals set and drift."""
SIX_AXES = "a gauge across the contact, or calibrate with a six-axis force sensor, dry and greased"
NO_ARM = "a gauge across the contact, or rig.arm.structure: machine if the axis is guided"
SPARE = 1.25
"""Factor on the expected time of a step, which must then be below the time allowed for it."""
GROUP = "stepload.force_sensors"


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
    top = f"Top force {format_quantity(top_n, 'N')}"
    used = format_quantity(counted.lower_n, "N")
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
        f"{top} exceeds the largest safe one, {safe}. Largest loss from F_c used ({used}): {loss}"
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
        f"count, {percent(harm, 2)} of the deformation.",
        "state rig.displacement.offset, or use two gauges on both sides",
        harm, math.nan, "", harm, "rig.displacement.offset",
    )  # fmt: skip


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
    loading_times = load_times(plan, limits, law)
    step_s = max(loading_times.up_s)
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
    stiffness, counted_n = limits.stiffness_n_per_m, limits.used_limit_n
    most_n = max(level_n + stiffness * limits.travel_m(level_n) for level_n in levels_n)
    if most_n > counted_n:
        yield Reason(
            "one_channel_soft", Severity.WARN,
            "If the only force channel fails and the payload rests on something rigid, the force"
            f" may reach {format_quantity(most_n, 'N')}.",
            "Add a second force channel.",
            most_n, counted_n, "N",
        )  # fmt: skip


@cache
def _driver(name: str) -> type[ForceSensor]:
    return cast(type[ForceSensor], load_driver(GROUP, name))


def one_channel_reasons(plan: Plan) -> Iterator[Reason]:
    """Refusals where both force channels read the same sensor.

    Raises:
        BadInputError: a driver of the plan is not installed.
    """
    first, second = plan.rig.force, plan.rig.second_force
    remedy = "second_force.source: none, or a second force sensor"
    if second.source is SecondForceSource.ARM and _driver(first.driver).built_into_arm:
        yield Reason(
            "channels_are_one", Severity.REFUSE,
            f"force.driver {first.driver} and second_force.source: arm read the same sensor.",
            remedy, key="rig.second_force",
        )  # fmt: skip
    if second.sensor is not None and same_device(first, second.sensor):
        yield Reason(
            "channels_are_one", Severity.REFUSE,
            f"force and second_force.sensor are one device, {first.driver} at {_address(first)}.",
            remedy, key="rig.second_force",
        )  # fmt: skip


def same_device(first: DeviceSpec, second: DeviceSpec) -> bool:
    """Whether both name one device; other axes, rates or scales of it do not make it a second."""
    return (
        first.driver == second.driver
        and bool(_address(first))
        and (_address(first) == _address(second))
    )


def _address(choice: DeviceSpec) -> str:
    """A device's address: the options in the driver's `ADDRESS`, or its required texts."""
    driver = _driver(choice.driver)
    names = driver.ADDRESS or tuple(
        key.name
        for key in keys(driver.OPTIONS)
        if key.required and key.is_text and "enum" not in schema_of(key.hint)
    )
    return ", ".join(f"{name} {choice.options.get(name)}" for name in names)
