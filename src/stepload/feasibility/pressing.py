"""How a plan may press: the ladder of forces, and the speeds that respect it on any surface."""

from __future__ import annotations

import math
from dataclasses import dataclass

from stepload.contact.power_law import ContactLaw
from stepload.errors import RefusedError
from stepload.feasibility.bounds import (
    Measured,
    common_error,
    cross_blind_n,
    follow_travel,
    press_rig,
)
from stepload.feasibility.command_backlog import largest_catch_up
from stepload.feasibility.force_limits import ForceLimits, force_limits, headroom
from stepload.feasibility.lateral import counted_left
from stepload.feasibility.press import (
    IMPACT_FACTOR,
    NOISE_MULTIPLE,
    OLD_S,
    ONE_CHANNEL,
    TWO_CHANNELS,
    PressRig,
    Term,
    force_budget,
    largest_speed,
    least_rise_n,
    series_stiffness,
    travel_limit,
)
from stepload.feasibility.zero_drift import counted_shift_n, second_zero_n, unchecked_drift
from stepload.plan.checks import LEAST_TOUCH_SIGMAS, least_touch_force
from stepload.plan.model import Plan, SecondForceSource
from stepload.units import percent

GUARDED_SHARE = 0.4
"""Share of F_lim that a guarded approach may reach."""
LONGEST_STALL_S = 0.2
"""Longest time in s for which a command link may hold commands back, to deliver them at once."""
LEAST_UNCHECKED_N = 15.0
"""Smallest elastic limit that may be pressed with one force channel and no mechanical fuse."""
HARD_STOP_N_PER_M = 1e9
"""Stiffness of a hidden hard stop: metal on metal over some square millimetres."""
TOP_SPEED_SHARE = 0.8
"""Share of the arm's largest speed that is ever commanded."""


@dataclass(frozen=True, slots=True)
class Pressing:
    """Forces and speeds of a plan.

    `zero_shift_n` is the shift of the zero that `forces` leave room for, `zero_drift_n_per_s` the
    drift that only the next look at the zero shows. `reading_noise_n` is the noise (sd) of one
    reading, quantisation included; `travel_limit_free_m` the travel from the contact threshold
    that is safe on a rigid surface, `answer_n_per_m` is the least force per travel that counts as
    an answer at the touch, `answer_top_n_per_m` at the top force, `answers_n` what the softest
    payload must give of it before its travel limit ends, `undetected_s` how old the readings of an
    only channel may be; the force that is left divided by `contact_n_s_per_m` is
    the speed allowed in contact: it holds even if a hidden hard stop takes over from the payload.
    `ahead_m` is how far the target of a guarded approach may run ahead of an arm that does not
    follow, `follow_m` the travel it takes to detect that.
    """

    rig: PressRig
    forces: ForceLimits
    zero_shift_n: float
    zero_drift_n_per_s: float
    tangent_n_per_m: float
    reading_noise_n: float
    travel_limit_free_m: float
    answer_n_per_m: float
    answer_top_n_per_m: float
    answers_n: float
    undetected_s: float
    guarded_speed_m_s: float
    fast_speed_m_s: float
    contact_n_s_per_m: float
    ahead_m: float
    follow_m: float

    def guarded_budget(self, threshold_n: float) -> tuple[Term, ...]:
        """The force budget of the guarded approach, term by term, in N."""
        return force_budget(
            self.rig,
            speed_m_s=self.guarded_speed_m_s,
            threshold_n=threshold_n,
            tangent_n_per_m=self.tangent_n_per_m,
            delay_s=self.rig.reaction_s,
        )


def largest_top_force(plan: Plan, elastic_limit_n: float) -> float:
    """The highest top force in N that this rig and payload allow; 0 where none is."""
    noise_n = plan.rig.force.noise_n
    shift_n = counted_shift_n(plan, press_rig(plan.rig, noise_n).loop_s)
    left = counted_left(plan)
    try:
        return _forces(plan, elastic_limit_n, math.ulp(1.0), noise_n, shift_n, left).largest_top_n
    except RefusedError:
        return 0.0


def pressing_for(
    plan: Plan,
    softest: ContactLaw,
    stiffest: ContactLaw,
    elastic_limit_n: float,
    measured: Measured | None = None,
) -> Pressing:
    """Forces and speeds of a plan against a payload of this elastic limit and any law between two.

    A stiff payload is hit harder at the same speed, a soft one answers less to the same travel: the
    former bounds the speeds and the target's lead, the latter lengthens the travel limit.

    Without `measured` the noise is the rig file's and the drift is the largest that is counted on
    (`counted_shift_n`); with it each is the larger of the two.

    Raises:
        RefusedError: no room below the elastic limit, the top force is too high, no speed above
            zero keeps the force budget.
        DomainError: a number is not finite and positive.
    """
    rig, procedure = plan.rig, plan.procedure
    noise_n = max(rig.force.noise_n, measured.noise_n if measured else 0.0)
    press = press_rig(rig, noise_n)
    drift_n_per_s = measured.drift_n_per_s if measured else 0.0
    shift_n = counted_shift_n(plan, press.loop_s, drift_n_per_s)
    _check_touch(procedure.touch_force_n, procedure.levels_n[0], noise_n)
    _check_channels(plan, elastic_limit_n)
    left = counted_left(plan, one_axis=measured is not None and measured.one_axis)
    forces = _forces(
        plan, elastic_limit_n, procedure.top_force_n, noise_n, shift_n, left,
        measured.second_noise_n if measured else 0.0,
    )  # fmt: skip
    tangent = stiffest.tangent(forces.limit_n)
    guarded, fast = _budgeted_speeds(procedure.touch_force_n, press, forces, tangent)
    reading_n = math.hypot(noise_n, rig.force.resolution_n / math.sqrt(12.0))
    travel_limit_m = travel_limit(
        forces.limit_n, procedure.touch_force_n, reading_n, press.stiffness_n_per_m
    )
    one_channel = rig.second_force.source is SecondForceSource.NONE
    share, answers = ONE_CHANNEL if one_channel else TWO_CHANNELS
    rise_n = least_rise_n(reading_n, max(1.0 / rig.arm.rate_hz, 1.0 / rig.force.rate_hz))
    room_n = forces.allowed_n - procedure.touch_force_n - NOISE_MULTIPLE * noise_n
    rigid = room_n / rigid_coefficient(press, forces.limit_n)
    guarded, fast = min(guarded, rigid), min(fast, rigid)
    catch_up_m = largest_catch_up(press, forces.allowed_n, tangent)
    follow_m = follow_travel(rig.arm)
    if catch_up_m < follow_m:
        guarded = min(guarded, catch_up_m / LONGEST_STALL_S)
    undetected_s = OLD_S if one_channel else 0.0
    if one_channel:
        guarded = min(guarded, travel_limit_m / (undetected_s + press.reaction_s))
    top_speed = TOP_SPEED_SHARE * rig.arm.max_speed_m_s
    arm_n_per_m = rig.system_stiffness.stiffness_n_per_m
    return Pressing(
        rig=press,
        forces=forces,
        zero_shift_n=shift_n,
        zero_drift_n_per_s=unchecked_drift(plan, drift_n_per_s),
        tangent_n_per_m=tangent,
        reading_noise_n=reading_n,
        travel_limit_free_m=travel_limit_m,
        answer_n_per_m=share * _softest(arm_n_per_m, softest, procedure.touch_force_n),
        answer_top_n_per_m=share * _softest(arm_n_per_m, softest, procedure.top_force_n),
        answers_n=share * answers * rise_n,
        undetected_s=undetected_s,
        guarded_speed_m_s=min(guarded, top_speed),
        fast_speed_m_s=min(fast, top_speed),
        contact_n_s_per_m=rigid_coefficient(press, forces.limit_n),
        ahead_m=max(catch_up_m, follow_m),
        follow_m=follow_m,
    )


def _softest(arm_n_per_m: float, softest: ContactLaw, force_n: float) -> float:
    """Force per travel in N/m of the softest payload at this force, by the plan's K_s.

    With the largest K_s more would be required than an arm that gives way sideways can show.
    """
    return series_stiffness(arm_n_per_m, softest.tangent(force_n))


def _forces(
    plan: Plan,
    elastic_limit_n: float,
    top_force_n: float,
    noise_n: float,
    shift_n: float,
    left: float,
    second_noise_n: float = 0.0,
) -> ForceLimits:
    """The ladder. What is compared with a second force channel is as wrong as that one's zero may
    be, and by the tolerance besides and what noise hides from R5; two sensors whose gains are both
    too low pass that by what they state. With one channel nothing checks the gain: it may read too
    little by three times its uncertainty, or as it is bent if that is more; a shift of its zero
    comes on top."""
    rig = plan.rig
    tolerance_n, relative, bias_n = _channel_errors(plan, noise_n, shift_n, second_noise_n)
    return force_limits(
        elastic_limit_n,
        top_force_n=top_force_n,
        step_n=plan.procedure.step_n,
        noise_n=noise_n,
        tolerance_n=tolerance_n,
        tolerance_relative=relative,
        common_relative=common_error(rig)[0],
        bias_n=bias_n,
        capacity_n=min(rig.arm.max_push_n, 0.95 * rig.force.range_n),
        left=left,
    )


def largest_losses(plan: Plan, elastic_limit_n: float) -> list[tuple[str, float]]:
    """What takes most off F_c before the largest safe top force, in N, the largest first."""
    noise_n, second = plan.rig.force.noise_n, plan.rig.second_force
    shift_n = counted_shift_n(plan, press_rig(plan.rig, noise_n).loop_s)
    try:
        tolerance_n, relative, bias_n = _channel_errors(plan, noise_n, shift_n, 0.0)
    except RefusedError:
        return [("gain", elastic_limit_n)]
    part_n = counted_left(plan) * elastic_limit_n
    common_n = common_error(plan.rig)[0] * part_n
    read_n = max(part_n - common_n - bias_n - tolerance_n, 0.0)
    has_second = second.source is not SecondForceSource.NONE
    losses = {
        "lateral force": elastic_limit_n - part_n,
        "errors common to the channels": common_n,
        "second channel's zero" if bias_n > shift_n and has_second else "drift of the zero": bias_n,
        "second channel's tolerance and noise": tolerance_n,
        "gain": read_n * relative / (1.0 + relative),
        "headroom": headroom(noise_n, plan.procedure.step_n),
    }
    return sorted(losses.items(), key=lambda each: -each[1])


def _channel_errors(
    plan: Plan, noise_n: float, shift_n: float, second_noise_n: float
) -> tuple[float, float, float]:
    """Tolerance in N, relative tolerance, and error of the zero in N, of the force channels."""
    rig, second = plan.rig, plan.rig.second_force
    if second.source is SecondForceSource.NONE:
        too_little = max(3.0 * rig.force.gain_uncertainty, rig.force.nonlinearity or 0.0)
        if too_little >= 1.0:
            raise RefusedError(
                f"3 times the gain's uncertainty of {percent(rig.force.gain_uncertainty, 2)}, "
                f"or its"
                " nonlinearity, is all of the reading, and nothing checks the only force channel",
                hint="calibrate the force sensor (rig.force.gain_uncertainty), or declare a second"
                " force channel",
            )
        relative = too_little / (1.0 - too_little)
        return 0.0, relative, shift_n * (1.0 + relative)
    tolerance_n = second.tolerance_n + cross_blind_n(rig, noise_n, second_noise_n)
    return tolerance_n, second.tolerance_relative, max(shift_n, second_zero_n(second))


def _check_touch(touch_force_n: float, first_n: float, noise_n: float) -> None:
    if touch_force_n >= first_n:
        raise RefusedError(
            f"the first level, {first_n:.3g} N, is not above the touch force of"
            f" {touch_force_n:.3g} N that the noise and resolution of the force sensor need",
            hint=f"press more than {touch_force_n:.3g} N, or use a finer force sensor",
        )
    least_n = least_touch_force(noise_n)
    if touch_force_n < least_n:
        raise RefusedError(
            f"touch force {touch_force_n:.3g} N is below {LEAST_TOUCH_SIGMAS:g} times the force"
            f" noise of {noise_n:.3g} N: noise would be taken for a touch",
            hint=f"raise the touch force to {math.ceil(least_n * 100.0) / 100.0:g} N",
        )


def _check_channels(plan: Plan, elastic_limit_n: float) -> None:
    alone = plan.rig.second_force.source is SecondForceSource.NONE
    if alone and plan.rig.mechanical_fuse_n is None and elastic_limit_n < LEAST_UNCHECKED_N:
        raise RefusedError(
            f"elastic limit {elastic_limit_n:.3g} N is below {LEAST_UNCHECKED_N:g} N, and nothing"
            " checks the only force channel",
            hint="declare a second force channel or a mechanical fuse",
        )


def _budgeted_speeds(
    touch_n: float, press: PressRig, forces: ForceLimits, tangent_n_per_m: float
) -> tuple[float, float]:
    """(guarded, fast) approach speeds in m/s at which the force budget is used up.

    Raises:
        RefusedError: there is none above zero.
    """
    guarded, fast = (
        largest_speed(
            press,
            force_n=force_n,
            threshold_n=touch_n,
            tangent_n_per_m=tangent_n_per_m,
            delay_s=press.reaction_s,
        )
        for force_n in (GUARDED_SHARE * forces.limit_n, forces.limit_n)
    )
    if not (math.isfinite(guarded) and guarded > 0.0):
        raise RefusedError(
            f"no approach speed keeps the force budget: touch force {touch_n:.3g} N"
            f" and noise {press.noise_n:.3g} N against {GUARDED_SHARE:g} of the force limit"
            f" {forces.limit_n:.4g} N",
            hint="lower the touch force, raise the top force or use a quieter force sensor",
        )
    return guarded, fast


def rigid_coefficient(rig: PressRig, limit_n: float) -> float:
    """Force per speed, in N s/m, where a hidden hard stop is met at a force up to `limit_n`.

    A single hit is v sqrt(m k). On a soft payload an arm bounces off the stop as it does in free
    air: it swings after its target and comes back faster, in hits that are over before a sample. A
    main force channel that is dead is seen by the second one only, and later: that time counts too.
    """
    travel = rig.stiffness_n_per_m * (rig.reaction_s + rig.cross_check_s)
    impact = IMPACT_FACTOR * math.sqrt(rig.mass_kg * HARD_STOP_N_PER_M)
    linear = 1.1 * travel + rig.damping_n_s_per_m + impact
    braking = rig.stiffness_n_per_m * (limit_n / linear) / (2.0 * rig.acceleration_m_s2)
    return linear + braking
