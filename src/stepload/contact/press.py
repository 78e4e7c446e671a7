"""How hard an arm hits and how fast it may go: the force budget, as equations of plain numbers.

An arm that moves at v and is told to stop when the force passes F_th still presses on. Every term
below is an upper bound, and none of them needs the payload: the stiffness the arm feels,
K_s k_t/(K_s + k_t), never exceeds K_s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from stepload.contact.checks import require_not_negative, require_positive
from stepload.errors import RefusedError

IMPACT_FACTOR = 3.0
"""On v √(m k_t): 1 was exceeded in simulated approaches, 3 in none of 24,000."""
NOISE_MULTIPLE = 6.0
"""z of the budget: how many standard deviations of force noise may hide a contact."""


@dataclass(frozen=True, slots=True)
class Term:
    """One line of a printed list of figures: what, how much, and where it comes from."""

    name: str
    value: float
    unit: str
    source: str


@dataclass(frozen=True, slots=True)
class PressRig:
    """What a rig's numbers mean for pressing; upper bounds throughout.

    `stiffness_n_per_m` is the largest K_s that is believed possible; `reaction` are the delays from
    a rise of force until the arm gives way, `reaction_s` their sum T_r; `loop_s` is the delay T of
    the whole control loop; `cross_check_s` how much later the second channel speaks (0: has none).
    """

    stiffness_n_per_m: float
    damping_n_s_per_m: float
    mass_kg: float
    acceleration_m_s2: float
    lag_s: float
    noise_n: float
    reaction: tuple[Term, ...]
    reaction_s: float
    loop_s: float
    cross_check_s: float


@dataclass(frozen=True, slots=True)
class ForceLimits:
    """The ladder of forces below F_c; each lower rung leaves room for what the upper cannot see.

    `allowed_n` is the largest reading at which the true force is surely below F_c, `limit_n` is
    F_lim, at which the run is stopped, `largest_top_n` the highest top force a plan may ask for.
    """

    elastic_limit_n: float
    allowed_n: float
    limit_n: float
    headroom_n: float
    largest_top_n: float


def series_stiffness(first_n_per_m: float, second_n_per_m: float) -> float:
    """Stiffness of two springs in series; never above either."""
    return first_n_per_m / (1.0 + first_n_per_m / second_n_per_m)


def force_limits(
    elastic_limit_n: float,
    *,
    top_force_n: float,
    step_n: float,
    noise_n: float,
    tolerance_n: float,
    tolerance_relative: float,
    bias_n: float,
    capacity_n: float,
) -> ForceLimits:
    """F_lim and the largest safe top force.

    A force error within the cross-check tolerance cannot be seen, hence
    F_allowed = (F_c − tol_abs − |bias|)/(1 + tol_rel). F_lim lies a quarter above the top force,
    never above F_allowed nor above `capacity_n`, what sensor and arm can bear.

    Raises:
        DomainError: a number is not finite and positive (or zero where that has a meaning).
        RefusedError: the elastic limit leaves no room, or the top force is above the largest safe.
    """
    require_positive(elastic_limit_n, "elastic limit F_c", "N")
    require_positive(top_force_n, "top force", "N")
    require_positive(step_n, "load step", "N")
    require_positive(noise_n, "force noise", "N")
    require_positive(capacity_n, "force capacity of arm and sensor", "N")
    require_not_negative(tolerance_n, "cross-check tolerance", "N")
    require_not_negative(tolerance_relative, "relative cross-check tolerance", "")
    require_not_negative(bias_n, "allowed drift", "N")
    headroom_n = 8.0 * noise_n + max(0.5, 0.02 * step_n)
    allowed_n = (elastic_limit_n - tolerance_n - bias_n) / (1.0 + tolerance_relative)
    allowed_n = min(allowed_n, capacity_n)
    largest_top_n = allowed_n - headroom_n
    arithmetic = (
        f"(F_c {elastic_limit_n:.4g} N - {tolerance_n:.3g} N tolerance - {bias_n:.3g} N drift)"
        f" / (1 + {tolerance_relative:.3g}), at most {capacity_n:.4g} N capacity,"
        f" less {headroom_n:.3g} N headroom = {largest_top_n:.4g} N"
    )
    if largest_top_n <= 0.0:
        raise RefusedError(
            f"the elastic limit leaves no room to press: {arithmetic}",
            hint="use a more precise second force channel, or a mechanical fuse",
        )
    if top_force_n > largest_top_n:
        raise RefusedError(
            f"top force {top_force_n:.4g} N is above the largest safe top force: {arithmetic}",
            hint=f"reduce the top force to {math.floor(largest_top_n * 100.0) / 100.0:g} N",
        )
    limit_n = min(allowed_n, max(1.25 * top_force_n, top_force_n + headroom_n))
    return ForceLimits(elastic_limit_n, allowed_n, limit_n, headroom_n, largest_top_n)


def speed_terms(rig: PressRig, tangent_n_per_m: float, delay_s: float) -> tuple[Term, ...]:
    """The force budget's terms that grow in proportion to speed, in N per m/s."""
    stiffness = series_stiffness(rig.stiffness_n_per_m, tangent_n_per_m)
    omega = math.sqrt((rig.stiffness_n_per_m + tangent_n_per_m) / rig.mass_kg)
    ringing_s = 1.0 / omega
    if rig.lag_s > 0.0:
        ringing_s = min(ringing_s, 2.0 / (omega * omega * rig.lag_s))
    impact = math.sqrt(rig.mass_kg * tangent_n_per_m) * math.sqrt(
        tangent_n_per_m / (rig.stiffness_n_per_m + tangent_n_per_m)
    )
    unit = "N s/m"
    return (
        Term("travel during reaction", stiffness * delay_s, unit, "K_eff T_r"),
        Term("damping", rig.damping_n_s_per_m, unit, "C_s"),
        Term("impact", IMPACT_FACTOR * impact, unit, "3 sqrt(m k_t) sqrt(k_t/(K_s+k_t))"),
        Term("ringing", stiffness * ringing_s, unit, "K_eff min(2/(w^2 tau), 1/w)"),
    )


def force_budget(
    rig: PressRig, *, speed_m_s: float, threshold_n: float, tangent_n_per_m: float, delay_s: float
) -> tuple[Term, ...]:
    """Every contribution to the peak force of an approach at `speed_m_s`, in N; they add up.

    `threshold_n` is the force at which the approach is stopped, `delay_s` the time from there until
    the arm gives way, `tangent_n_per_m` k_t of the payload at the force limit.
    """
    stiffness = series_stiffness(rig.stiffness_n_per_m, tangent_n_per_m)
    braking = stiffness * speed_m_s * speed_m_s / (2.0 * rig.acceleration_m_s2)
    noise = NOISE_MULTIPLE * rig.noise_n
    return (
        Term("contact threshold", threshold_n, "N", "F_th"),
        Term("noise", noise, "N", f"{NOISE_MULTIPLE:g} sigma, sigma = {rig.noise_n:.3g} N"),
        *(
            Term(t.name, t.value * speed_m_s, "N", f"{t.source} v, v = {speed_m_s * 1e3:.3g} mm/s")
            for t in speed_terms(rig, tangent_n_per_m, delay_s)
        ),
        Term("braking", braking, "N", "K_eff v^2/(2a)"),
    )


def largest_speed(
    rig: PressRig, *, force_n: float, threshold_n: float, tangent_n_per_m: float, delay_s: float
) -> float:
    """The speed in m/s at which `force_budget` adds up to `force_n`; 0 where none is left."""
    room_n = force_n - threshold_n - NOISE_MULTIPLE * rig.noise_n
    if room_n <= 0.0:
        return 0.0
    linear = sum(t.value for t in speed_terms(rig, tangent_n_per_m, delay_s))
    stiffness = series_stiffness(rig.stiffness_n_per_m, tangent_n_per_m)
    square = stiffness / (2.0 * rig.acceleration_m_s2)
    return 2.0 * room_n / (linear + math.sqrt(linear * linear + 4.0 * square * room_n))
