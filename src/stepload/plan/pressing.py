"""What a plan's numbers mean for pressing: force limits, delays and speeds, each with its source.

Preflight prints these figures and the run obeys them: both take them from here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from stepload.contact.catch_up import largest_catch_up
from stepload.contact.elastic import law_for
from stepload.contact.press import (
    IMPACT_FACTOR,
    NOISE_MULTIPLE,
    ForceLimits,
    PressRig,
    Term,
    force_budget,
    force_limits,
    largest_speed,
)
from stepload.errors import RefusedError
from stepload.plan.leash import check_leash, leash_travel
from stepload.plan.model import (
    ArmSpec,
    ForceSpec,
    Plan,
    Provenance,
    Rig,
    SecondForceSource,
    SystemStiffness,
)

GUARDED_SHARE = 0.4
"""Share of F_lim that a guarded approach may reach."""
LONGEST_STALL_S = 0.2
"""A command link may hold commands back for so long, and then deliver them at once."""
CROSS_CHECK_FILTER_S = 0.005
"""Time constant of the filter on the difference of the two force channels."""
LEAST_STIFFNESS_DOUBT = {
    Provenance.MEASURED: 0.0,
    Provenance.DECLARED: 0.1,
    Provenance.INDICATIVE: 0.3,
}
"""Smallest relative doubt about K_s by where it comes from; 3 sigma where that is more."""
LEAST_TOUCH_SIGMAS = 4.0
LEAST_UNCHECKED_N = 15.0
"""Smallest elastic limit that may be pressed with one force channel and no mechanical fuse."""
AGE_S = 0.012
"""Age at which data stop a run where the plan does not say."""
HARD_STOP_N_PER_M = 1e9
"""Stiffness of a hidden hard stop: metal on metal over some square millimetres."""
HARD_STOP_IMPACT_FACTOR = 1.5
"""On v sqrt(m k) in contact, which is exact for a linear stop without damping. An approach needs
`IMPACT_FACTOR`: an arm that bounces off the payload comes back faster than its target moves."""


@dataclass(frozen=True, slots=True)
class Measured:
    """What the run itself has found out about its force sensor: noise (sd) and drift since tare."""

    noise_n: float
    bias_n: float


@dataclass(frozen=True, slots=True)
class Pressing:
    """Everything about pressing that follows from a plan and its elastic limit.

    `contact_n_s_per_m` divides the force that is left into the speed allowed in contact: it holds
    even if a hidden hard stop takes over from the payload. `ahead_m` is how far the target of a
    guarded approach may run ahead of an arm that does not follow, `follow_m` what it takes to see
    that.
    """

    rig: PressRig
    forces: ForceLimits
    tangent_n_per_m: float
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


def largest_stiffness(system: SystemStiffness) -> float:
    """The largest K_s in N/m that is believed possible: K_s + 3 sigma, more where it is a guess."""
    doubt = LEAST_STIFFNESS_DOUBT[system.provenance] * system.stiffness_n_per_m
    return system.stiffness_n_per_m + max(3.0 * system.sigma_n_per_m, doubt)


def age_limit_s(stream: ForceSpec | ArmSpec) -> float:
    """Age at which data of a stream stop the run (R3): the plan's, else 12 ms or 4 periods."""
    return max(stream.max_age_s or AGE_S, 4.0 / stream.rate_hz)


def channel_skew_s(rig: Rig) -> float:
    """Bound on the difference of the delays of the two force channels, in s."""
    return rig.force.delay_s + 2.0 / rig.arm.rate_hz


def follow_travel(arm: ArmSpec) -> float:
    """Travel in m that an arm must be given before it can be seen whether it follows."""
    return 2.0 * arm.position_resolution_m + 4.0 * arm.position_noise_m + arm.lost_motion_m


def press_rig(rig: Rig, noise_n: float) -> PressRig:
    """Upper bounds of a rig's delays and inertia, from the plan."""
    arm, force = rig.arm, rig.force
    parts = (
        Term("force sensor delay", force.delay_s, "s", "rig: force.delay"),
        Term("force sensor period", 1.0 / force.rate_hz, "s", "rig: 1 / force.rate"),
        Term("tick", 1.0 / arm.rate_hz, "s", "rig: 1 / arm.rate"),
        Term("computing and jitter", 1.0 / arm.rate_hz, "s", "one tick"),
        Term("command delay", arm.command_delay_s, "s", "rig: arm.command_delay"),
        Term("arm lag", arm.lag_s, "s", "rig: arm.lag"),
    )
    total_s = sum(part.value for part in parts)
    loop_s = rig.loop_delay_s if rig.loop_delay_s is not None else total_s
    second = rig.second_force
    has_second = second.source is not SecondForceSource.NONE
    return PressRig(
        stiffness_n_per_m=largest_stiffness(rig.system_stiffness),
        damping_n_s_per_m=rig.system_stiffness.damping_n_s_per_m,
        mass_kg=arm.effective_mass_kg,
        acceleration_m_s2=arm.max_acceleration_m_s2,
        lag_s=arm.lag_s,
        noise_n=noise_n,
        reaction=parts,
        reaction_s=max(total_s, loop_s),
        loop_s=loop_s,
        cross_check_s=(
            second.time_s + CROSS_CHECK_FILTER_S + channel_skew_s(rig) if has_second else 0.0
        ),
    )


def step_rate_per_s(loop_s: float) -> float:
    """λ = 0.25/T of the step controller, from the loop delay T in s."""
    return 0.25 / loop_s


def retract_speed_m_s(rig: Rig) -> float:
    """Half the arm's largest speed, at most 20 mm/s."""
    return min(0.5 * rig.arm.max_speed_m_s, 0.02)


def _forces(
    plan: Plan, elastic_limit_n: float, top_force_n: float, noise_n: float, bias_n: float
) -> ForceLimits:
    rig, second = plan.rig, plan.rig.second_force
    has_second = second.source is not SecondForceSource.NONE
    return force_limits(
        elastic_limit_n,
        top_force_n=top_force_n,
        step_n=plan.procedure.step_n,
        noise_n=noise_n,
        tolerance_n=second.tolerance_n if has_second else 0.0,
        tolerance_relative=(
            second.tolerance_relative if has_second else 3.0 * rig.force.gain_uncertainty
        ),
        bias_n=bias_n,
        capacity_n=min(rig.arm.max_push_n, 0.95 * rig.force.range_n),
    )


def largest_top_force(plan: Plan, *, elastic_limit_n: float) -> float:
    """The highest top force in N that this rig and payload allow; 0 where none is."""
    noise_n, bias_n = plan.rig.force.noise_n, plan.procedure.max_drift_n
    try:
        return _forces(plan, elastic_limit_n, math.ulp(1.0), noise_n, bias_n).largest_top_n
    except RefusedError:
        return 0.0


def pressing_for(
    plan: Plan, *, elastic_limit_n: float, measured: Measured | None = None
) -> Pressing:
    """Force limits and speeds of a plan.

    Without `measured` the noise is the rig file's and the drift is the largest that the plan lets
    pass. With one force channel nothing checks the gain: three times its uncertainty stands in for
    the tolerance of the cross-check.

    Raises:
        RefusedError: no room below the elastic limit, the top force is too high, no speed above
            zero keeps the force budget, or the payload is too soft for the rig.
        DomainError: a number is not finite and positive.
    """
    rig, procedure = plan.rig, plan.procedure
    noise_n = max(rig.force.noise_n, measured.noise_n if measured else 0.0)
    bias_n = max(procedure.max_drift_n, measured.bias_n if measured else 0.0)
    second = rig.second_force
    has_second = second.source is not SecondForceSource.NONE
    _check_touch(procedure.touch_force_n, noise_n)
    if not has_second and rig.mechanical_fuse_n is None and elastic_limit_n < LEAST_UNCHECKED_N:
        raise RefusedError(
            f"elastic limit {elastic_limit_n:.3g} N is below {LEAST_UNCHECKED_N:g} N, and nothing"
            " checks the only force channel",
            hint="declare a second force channel or a mechanical fuse",
        )
    forces = _forces(plan, elastic_limit_n, procedure.top_force_n, noise_n, bias_n)
    numbers = press_rig(rig, noise_n)
    payload = plan.payload
    law = law_for(payload.geometry, payload.material, payload.plate)
    tangent = law.tangent(forces.limit_n)
    limits = [(GUARDED_SHARE * forces.limit_n, procedure.touch_force_n, numbers.reaction_s)]
    fast_limits = [(forces.limit_n, procedure.touch_force_n, numbers.reaction_s)]
    if has_second:
        late = (elastic_limit_n, second.tolerance_n, numbers.reaction_s + numbers.cross_check_s)
        limits.append(late)
        fast_limits.append(late)
    guarded, fast = (
        min(
            largest_speed(
                numbers,
                force_n=force_n,
                threshold_n=threshold_n,
                tangent_n_per_m=tangent,
                delay_s=delay_s,
            )
            for force_n, threshold_n, delay_s in rows
        )
        for rows in (limits, fast_limits)
    )
    if not (math.isfinite(guarded) and guarded > 0.0):
        raise RefusedError(
            f"no approach speed keeps the force budget: touch force {procedure.touch_force_n:.3g} N"
            f" and noise {noise_n:.3g} N against {GUARDED_SHARE:g} of the force limit"
            f" {forces.limit_n:.4g} N",
            hint="lower the touch force, raise the top force or use a quieter force sensor",
        )
    reading_n = math.hypot(noise_n, rig.force.resolution_n / math.sqrt(12.0))
    check_leash(
        leash_travel(forces.limit_n, procedure.touch_force_n, reading_n, numbers.stiffness_n_per_m),
        law,
        touch_force_n=procedure.touch_force_n,
        noise_n=reading_n,
        period_s=max(1.0 / rig.arm.rate_hz, 1.0 / rig.force.rate_hz),
        position_resolution_m=rig.arm.position_resolution_m,
    )
    contact = _rigid_coefficient(numbers, forces.limit_n, HARD_STOP_IMPACT_FACTOR)
    meeting = _rigid_coefficient(numbers, forces.limit_n, IMPACT_FACTOR)
    room_n = forces.allowed_n - procedure.touch_force_n - NOISE_MULTIPLE * noise_n
    rigid = room_n / meeting
    guarded, fast = min(guarded, rigid), min(fast, rigid)
    catch_up_m = largest_catch_up(numbers, forces.allowed_n, tangent)
    follow_m = follow_travel(rig.arm)
    if catch_up_m < follow_m:
        guarded = min(guarded, catch_up_m / LONGEST_STALL_S)
    top_speed = 0.8 * rig.arm.max_speed_m_s
    return Pressing(
        rig=numbers,
        forces=forces,
        tangent_n_per_m=tangent,
        guarded_speed_m_s=min(guarded, top_speed),
        fast_speed_m_s=min(fast, top_speed),
        contact_n_s_per_m=contact,
        ahead_m=max(catch_up_m, follow_m),
        follow_m=follow_m,
    )


def _check_touch(touch_force_n: float, noise_n: float) -> None:
    least_n = LEAST_TOUCH_SIGMAS * noise_n
    if touch_force_n < least_n:
        raise RefusedError(
            f"touch force {touch_force_n:.3g} N is below {LEAST_TOUCH_SIGMAS:g} times the force"
            f" noise of {noise_n:.3g} N: noise would be taken for a touch",
            hint=f"raise the touch force to {math.ceil(least_n * 100.0) / 100.0:g} N",
        )


def _rigid_coefficient(rig: PressRig, limit_n: float, impact_factor: float) -> float:
    """Force per speed, in N s/m, where a hidden hard stop is met."""
    travel = rig.stiffness_n_per_m * (rig.reaction_s + rig.cross_check_s)
    impact = impact_factor * math.sqrt(rig.mass_kg * HARD_STOP_N_PER_M)
    linear = 1.1 * travel + rig.damping_n_s_per_m + impact
    braking = rig.stiffness_n_per_m * (limit_n / linear) / (2.0 * rig.acceleration_m_s2)
    return linear + braking
