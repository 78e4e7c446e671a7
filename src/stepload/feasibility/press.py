"""How hard an arm hits and how fast it may go: the force budget, as equations of plain numbers.

An arm that moves at v and is told to stop when the force passes F_th still presses on. Every term
below is an upper bound, and none of them needs the payload: the stiffness the arm feels,
K_s k_t/(K_s + k_t), never exceeds K_s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

IMPACT_FACTOR = 3.0
"""Factor on v √(m k_t): 1 was exceeded in simulated approaches, 3 in none of 24,000."""
NOISE_MULTIPLE = 6.0
"""z of the budget: how many standard deviations of force noise may hide a contact."""

ANCHOR_WINDOW_S = 0.04
"""Time in s over which the force is averaged before it counts as an answer."""
END_WINDOW_S = 0.1
"""The same at the end of the travel, at least: the noise of an answer would hide the next one."""
ANSWER_FILTER_S = 0.1
"""Time constant in s of the filter on the force in which R6 looks for an answer."""
ANSWER_SIGMAS = 4.5
"""Standard deviations by which a mean must rise to be an answer. Of noise alone few means in a
hundred thousand rise so far."""
DRIFT_SHARE = 0.5
"""Share of an answer at the end of the travel that may be a drift which goes on while the arm
stands."""
DRIFT_SIGMAS = 1.5
"""Standard deviations added to that drift; a steady drift then passes in one look of 700."""
ONE_CHANNEL = 0.3, 4.0
TWO_CHANNELS = 0.1, 20.0
"""Least share of the softest payload's rise that counts as an answer, and how many least rises that
payload shows within the travel limit. Two answers end its count, so beside a second channel a
payload ten times softer than stated is pressed all the same."""
OLD_S = 0.5
"""How old the readings of an only force channel may be while they go on arriving, fresh stamps and
all, as from a buffer that fills."""


@dataclass(frozen=True, slots=True)
class Term:
    """One line of a printed list of figures: what, how much, and where it comes from."""

    name: str
    value: float
    unit: str
    source: str


@dataclass(frozen=True, slots=True)
class PressRig:
    """Properties of a rig that matter for pressing; upper bounds throughout.

    `stiffness_n_per_m` is the largest K_s that is believed possible; `reaction_s` is T_r, from a
    rise of force until the arm gives way; `loop_s` is the delay T of the whole control loop;
    `cross_check_s` how much later the second channel reacts (0: has none).
    """

    stiffness_n_per_m: float
    damping_n_s_per_m: float
    mass_kg: float
    acceleration_m_s2: float
    lag_s: float
    noise_n: float
    reaction_s: float
    loop_s: float
    cross_check_s: float


def series_stiffness(first_n_per_m: float, second_n_per_m: float) -> float:
    """Stiffness of two springs in series; never above either."""
    return first_n_per_m / (1.0 + first_n_per_m / second_n_per_m)


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


def travel_limit(
    limit_n: float, touch_force_n: float, noise_n: float, stiffness_n_per_m: float
) -> float:
    """Travel in m that lifts the force from the contact threshold to F_lim on a rigid surface."""
    return (limit_n - touch_force_n - NOISE_MULTIPLE * noise_n) / stiffness_n_per_m


def least_rise_n(noise_n: float, reading_s: float) -> float:
    """Least rise in N of the force filtered by `ANSWER_FILTER_S` that noise does not explain."""
    return ANSWER_SIGMAS * noise_n * math.sqrt(min(1.0, 0.5 * reading_s / ANSWER_FILTER_S))
