"""Every threshold of a run, derived once from the plan."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

from stepload.contact.press import Term
from stepload.errors import DomainError
from stepload.plan.leash import leash_travel
from stepload.plan.model import ForceSpec, Plan, SecondForceSource
from stepload.plan.pressing import (
    CROSS_CHECK_FILTER_S,
    Measured,
    age_limit_s,
    channel_skew_s,
    pressing_for,
    retract_speed_m_s,
    step_rate_per_s,
)

CLOCK_S = 0.015
IDENTICAL_COUNTS = 25
SECOND_IDENTICAL_COUNTS = 100
"""The second channel may be slower than the stream it comes in."""
MODEL_LAG_S = 0.07
STILL_BLURS = 2.0
"""Commanded travel over what may hide it in the measured position, before R7 asks for an answer."""
LEASH_TIME_S = 1.5
AGE_SOURCE = "R3: the plan, or 12 ms, at least 4 periods"
FREEZE_SOURCE = "R4: equal samples in a row; 0: off"
FALSE_FREEZE_ODDS = 1e-11
"""Chance per sample that a sound, quantised sensor repeats itself for long enough to trip R4."""


@dataclass(frozen=True, slots=True)
class RunLimits:
    """Thresholds in SI units; `terms` says of each what it is, how much and where it comes from.

    R1 … R10 and the in-contact speed cap are those of `stepload.run.supervisor`. Times in s,
    lengths in m, forces in N. `identical_counts` 0 switches the frozen-value rule off: the sensor's
    noise is so far below its resolution that a sound sensor repeats itself as well; the same for
    the second channel. `cross_check` "" means that there is no second force channel.
    """

    elastic_limit_n: float
    force_limit_n: float
    allowed_n: float
    largest_top_n: float
    top_force_n: float
    noise_n: float
    stiffness_n_per_m: float
    tangent_n_per_m: float
    period_s: float
    loop_s: float
    reaction_s: float
    force_delay_s: float
    stale_force_s: float
    stale_arm_s: float
    stale_second_s: float
    identical_counts: int
    second_identical_counts: int
    full_scale_n: float
    cross_check: str
    cross_tolerance_n: float
    cross_relative: float
    cross_time_s: float
    cross_filter_s: float
    channel_skew_s: float
    leash_time_s: float
    model_tolerance_m: float
    model_lag_s: float
    still_m: float
    command_delay_s: float
    arm_lag_s: float
    search_end_m: float
    jump_n: float
    clock_s: float
    contact_n_s_per_m: float
    guarded_speed_m_s: float
    fast_speed_m_s: float
    retract_speed_m_s: float
    acceleration_m_s2: float
    leash_free_m: float
    ahead_m: float
    follow_m: float
    damping_n_s_per_m: float
    arm_acceleration_m_s2: float
    step_rate_per_s: float
    load_rate_n_per_s: float
    band_n: float
    touch_force_n: float
    lost_motion_m: float
    position_resolution_m: float
    second_noise_n: float
    terms: tuple[Term, ...] = ()

    def __post_init__(self) -> None:
        allowed_zero = {
            "cross_tolerance_n", "cross_relative", "cross_time_s", "identical_counts",
            "second_identical_counts", "second_noise_n", "command_delay_s", "arm_lag_s",
            "force_delay_s", "lost_motion_m", "damping_n_s_per_m",
        }  # fmt: skip
        for field in fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, (int, float)):
                continue
            low_enough = value >= 0.0 if field.name in allowed_zero else value > 0.0
            if not (math.isfinite(value) and low_enough):
                raise DomainError(
                    f"run limit {field.name} is {value}; it must be finite and positive",
                    hint="a limit that is not a number would never trip: check the plan",
                )


def identical_counts(force: ForceSpec, noise_n: float, least: int = IDENTICAL_COUNTS) -> int:
    """How many equal samples in a row are too many for a sound sensor (R4).

    A value in the middle of a quantum q stays there with p = erf(q/(2√2 σ)); the count is the run
    length whose odds are `FALSE_FREEZE_ODDS`, never below `least`. 0 where no count separates
    frozen from sound.
    """
    if force.resolution_n <= 0.0:
        return least
    stays = math.erf(force.resolution_n / (2.0 * math.sqrt(2.0) * noise_n))
    if stays >= 1.0 - 1e-6:
        return 0
    counts = math.log(FALSE_FREEZE_ODDS) / math.log(stays) if stays > 0.0 else 0.0
    return max(least, math.ceil(counts))


def derive_limits(
    plan: Plan, *, elastic_limit_n: float, measured: Measured | None = None
) -> RunLimits:
    """All thresholds of a run from its plan and the payload's elastic limit F_c in N.

    Raises:
        RefusedError: the plan leaves no room below F_c.
        DomainError: a threshold would not be finite and positive.
    """
    rig, procedure = plan.rig, plan.procedure
    arm, force, second = rig.arm, rig.force, rig.second_force
    pressing = pressing_for(plan, elastic_limit_n=elastic_limit_n, measured=measured)
    press, forces = pressing.rig, pressing.forces
    period_s = 1.0 / arm.rate_hz
    noise_n = math.hypot(press.noise_n, force.resolution_n / math.sqrt(12.0))
    leash_free_m = leash_travel(
        forces.limit_n, procedure.touch_force_n, noise_n, press.stiffness_n_per_m
    )
    fast_m_s = min(pressing.fast_speed_m_s, 0.7 * leash_free_m / press.reaction_s)
    checking = second.sensor or arm
    clock_s = max(CLOCK_S, 5.0 / force.rate_hz, force.max_age_s or 0.0, arm.max_age_s or 0.0)
    has_second = second.source is not SecondForceSource.NONE
    blur_m = arm.position_resolution_m + 6.0 * arm.position_noise_m + arm.lost_motion_m
    still_m = STILL_BLURS * blur_m
    near_edge_m = procedure.surface_distance_m - procedure.surface_uncertainty_m
    values: dict[str, tuple[Any, str, str]] = {
        "elastic_limit_n": (elastic_limit_n, "N", "F_c of the payload"),
        "force_limit_n": (forces.limit_n, "N", "R1, R2: F_lim, 1.25 F_top, at most F_allowed"),
        "allowed_n": (forces.allowed_n, "N", "(F_c - tol_abs - drift)/(1 + tol_rel)"),
        "largest_top_n": (forces.largest_top_n, "N", "F_allowed - headroom"),
        "top_force_n": (procedure.top_force_n, "N", "plan"),
        "noise_n": (noise_n, "N", "noise and resolution of the force sensor"),
        "stiffness_n_per_m": (press.stiffness_n_per_m, "N/m", "K_s + 3 sigma, more for a guess"),
        "tangent_n_per_m": (pressing.tangent_n_per_m, "N/m", "k_t of the payload at F_lim"),
        "period_s": (period_s, "s", "1 / arm rate"),
        "loop_s": (press.loop_s, "s", "T: measured, or the sum of the delays"),
        "reaction_s": (press.reaction_s, "s", "T_react: the sum of the delays, at least T"),
        "force_delay_s": (force.delay_s, "s", "rig: force.delay"),
        "stale_force_s": (age_limit_s(force), "s", AGE_SOURCE),
        "stale_arm_s": (age_limit_s(arm), "s", AGE_SOURCE),
        "stale_second_s": (age_limit_s(checking), "s", AGE_SOURCE),
        # Noise that was measured holds the resolution too, and would have a sound sensor freeze.
        "identical_counts": (
            identical_counts(force, min(press.noise_n, force.noise_n)), "samples", FREEZE_SOURCE,
        ),
        "second_identical_counts": (
            identical_counts(second.sensor, second.noise_n, SECOND_IDENTICAL_COUNTS)
            if second.sensor
            else SECOND_IDENTICAL_COUNTS,
            "samples", FREEZE_SOURCE,
        ),
        "full_scale_n": (force.range_n, "N", "R4: rated range"),
        "cross_tolerance_n": (second.tolerance_n if has_second else 0.0, "N", "R5: plan"),
        "cross_relative": (second.tolerance_relative if has_second else 0.0, "", "R5: plan"),
        "cross_time_s": (second.time_s if has_second else 0.0, "s", "R5: plan"),
        "cross_filter_s": (CROSS_CHECK_FILTER_S, "s", "R5: filter on the difference"),
        "channel_skew_s": (channel_skew_s(rig), "s", "R5: force sensor delay + 2 ticks"),
        "leash_time_s": (LEASH_TIME_S, "s", "R6: time at the end of the leash without an answer"),
        "model_tolerance_m": (arm.model_tolerance_m, "m", "R7: rig: arm.model_tolerance"),
        "model_lag_s": (MODEL_LAG_S, "s", "R7: tolerance in proportion to speed"),
        "still_m": (still_m, "m", "R7: 2 (resolution + 6 sigma + lost motion) of position"),
        "command_delay_s": (arm.command_delay_s, "s", "rig: arm.command_delay"),
        "arm_lag_s": (arm.lag_s, "s", "rig: arm.lag"),
        "search_end_m": (near_edge_m + procedure.search_distance_m, "m", "R8: plan"),
        "jump_n": (10.0 * noise_n + 2.0 * force.resolution_n, "N", "R9: 10 sigma + 2 quanta"),
        "clock_s": (clock_s, "s", "R10: 15 ms, 5 periods or the longest age limit"),
        "contact_n_s_per_m": (
            pressing.contact_n_s_per_m, "N s/m", "speed cap: a hidden hard stop of 1e9 N/m",
        ),
        "guarded_speed_m_s": (min(pressing.guarded_speed_m_s, fast_m_s), "m/s", "force budget"),
        "fast_speed_m_s": (fast_m_s, "m/s", "force budget with all of F_lim, and the leash"),
        "retract_speed_m_s": (retract_speed_m_s(rig), "m/s", "half the arm's, 20 mm/s"),
        "acceleration_m_s2": (0.5 * arm.max_acceleration_m_s2, "m/s^2", "half of the arm's"),
        "ahead_m": (
            min(pressing.ahead_m, leash_free_m), "m",
            "the arm catching up, or twice the position resolution + 4 sigma + lost motion",
        ),
        "follow_m": (
            pressing.follow_m, "m", "twice the position resolution + 4 sigma + lost motion",
        ),
        "damping_n_s_per_m": (press.damping_n_s_per_m, "N s/m", "C_s of the rig"),
        "arm_acceleration_m_s2": (press.acceleration_m_s2, "m/s^2", "rig: arm.max_acceleration"),
        "leash_free_m": (leash_free_m, "m", "(F_lim - F_th - 6 sigma) / K_s,max"),
        "step_rate_per_s": (step_rate_per_s(press.loop_s), "1/s", "lambda = 0.25 / T"),
        "band_n": (max(0.25, 2.0 * press.noise_n), "N", "0.25 N, 2 sigma"),
        "load_rate_n_per_s": (procedure.load_rate_n_per_s, "N/s", "plan"),
        "touch_force_n": (procedure.touch_force_n, "N", "plan"),
        "lost_motion_m": (arm.lost_motion_m, "m", "rig: arm.lost_motion"),
        "position_resolution_m": (arm.position_resolution_m, "m", "rig: arm.position_resolution"),
        "second_noise_n": (second.noise_n if has_second else 0.0, "N", "rig: second_force.noise"),
    }  # fmt: skip
    return RunLimits(
        cross_check=second.source.value if has_second else "",
        terms=tuple(Term(name, *row) for name, row in values.items()),
        **{name: row[0] for name, row in values.items()},
    )
