"""Every threshold of a run: what it is, its unit, the rule that stops at it, its origin."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import Field, dataclass, field, fields
from typing import Any

from stepload.errors import DomainError
from stepload.feasibility.bounds import (
    CROSS_CHECK_FILTER_S,
    age_limit_s,
    channel_skew_s,
    retract_speed_m_s,
    shown_noise_n,
    step_band_n,
    step_rate_per_s,
)
from stepload.feasibility.lateral import OVERLOADS, SECOND_OVERLOADS, lateral_limits
from stepload.feasibility.press import NOISE_MULTIPLE, Term
from stepload.feasibility.pressing import Pressing
from stepload.feasibility.zero_drift import SECOND_ZERO_SHARE, second_zero_n
from stepload.plan.model import ForceSpec, Plan, SecondForceSource

CLOCK_S = 0.015
IDENTICAL_COUNTS = 25
SECOND_IDENTICAL_COUNTS = 100
"""The second channel may be slower than the stream it comes in."""
MODEL_LAG_S = 0.07
STILL_BLURS = 2.0
"""Ratio of commanded travel to position blur, from which on R7 expects to see the arm move."""
TRAVEL_LIMIT_TIME_S = 1.5
MOVED_ZERO_SHARE = 0.25
"""Share of the touch force: with a zero off by this, noise neither makes a touch nor trips R11."""
FALSE_FREEZE_ODDS = 1e-11
"""Chance per sample that a sound, quantised sensor repeats itself for long enough to trip R4."""

_OVERLOAD = "80 % of the rated; 0: not stated"
_FROM = "5 N, twice the touch force, at most g(friction) F_allowed; at least 8 sigma"
_AGE = "the plan, or 12 ms, at least 4 periods"
_EQUAL = "equal samples in a row; 0: off"
_ANSWER = "least rise per travel: a share of the softest payload's, on the arm's K_s,"
_FOLLOW = "twice the position resolution + 4 sigma + lost motion"


def _limit(unit: str, source: str, rule: str = "", *, zero: bool = False) -> Any:
    """A threshold: its unit, what it is made of, the rule that stops at it, whether it may be 0."""
    return field(metadata={"unit": unit, "source": source, "rule": rule, "zero": zero})


@dataclass(frozen=True, slots=True, kw_only=True)
class RunLimits:
    """Thresholds of a run in SI units; all are finite, and positive unless 0 has a meaning.

    The rules are those of `stepload.engine.rules`. `identical_counts` 0 switches the
    frozen-value rule off: the sensor's noise is so far below its resolution that a sound sensor
    repeats itself as well; the same for the second channel. `cross_check` names the second force
    channel: "arm", "sensor", or "" where there is none.

    Raises:
        DomainError: a threshold that would never trip.
    """

    cross_check: str
    elastic_limit_n: float = _limit("N", "F_c of the payload")
    used_limit_n: float = _limit("N", "F_c less its uncertainty")
    force_limit_n: float = _limit("N", "F_lim, 1.25 F_top, at most F_allowed", "R1, R2")
    allowed_n: float = _limit(
        "N", "ladder of forces: F_c less what the channels and the zero may err by"
    )
    largest_top_n: float = _limit("N", "F_allowed - headroom")
    top_force_n: float = _limit("N", "plan")
    noise_n: float = _limit("N", "noise and resolution of the force sensor")
    stiffness_n_per_m: float = _limit(
        "N/m", "K_s + 3 sigma, more for a guess, with the tip held sideways"
    )
    tangent_n_per_m: float = _limit("N/m", "k_t of the payload at F_lim")
    period_s: float = _limit("s", "1 / arm rate")
    reading_s: float = _limit("s", "period of force readings, at least that of the arm")
    loop_s: float = _limit("s", "T: measured, or the sum of the delays")
    reaction_s: float = _limit("s", "T_react: the sum of the delays, at least T")
    force_delay_s: float = _limit("s", "rig: force.delay", zero=True)
    stale_force_s: float = _limit("s", _AGE, "R3")
    stale_arm_s: float = _limit("s", _AGE, "R3")
    stale_second_s: float = _limit("s", _AGE, "R3")
    identical_counts: int = _limit("samples", _EQUAL, "R4", zero=True)
    second_identical_counts: int = _limit("samples", _EQUAL, "R4", zero=True)
    full_scale_n: float = _limit("N", "rated range", "R4")
    cross_tolerance_n: float = _limit("N", "plan", "R5", zero=True)
    cross_relative: float = _limit("", "plan", "R5", zero=True)
    cross_time_s: float = _limit("s", "plan", "R5", zero=True)
    cross_filter_s: float = _limit("s", "filter on the difference", "R5")
    second_limit_n: float = _limit(
        "N", "F_lim and the tolerance of R5, of the second channel", "R1, R2", zero=True
    )
    second_zero_n: float = _limit("N", "half of the tolerance, or zero_error if more", zero=True)
    channel_skew_s: float = _limit("s", "longer delay and period of the channels + 2 ticks", "R5")
    travel_limit_time_s: float = _limit(
        "s", "time at the end of the travel without an answer; 0 beside a second channel", zero=True
    )
    undetected_s: float = _limit(
        "s", "age of readings that still arrive; 0: two channels", zero=True
    )
    model_tolerance_m: float = _limit("m", "rig: arm.model_tolerance", "R7")
    model_lag_s: float = _limit("s", "tolerance in proportion to speed", "R7")
    still_m: float = _limit("m", "2 (resolution + 6 sigma + lost motion) of position", "R7")
    command_delay_s: float = _limit("s", "rig: arm.command_delay", zero=True)
    arm_lag_s: float = _limit("s", "rig: arm.lag", zero=True)
    search_end_m: float = _limit("m", "plan", "R8")
    jump_n: float = _limit("N", "10 sigma + 2 quanta; more while the arm moves", "R9")
    clock_s: float = _limit("s", "15 ms, 5 periods or the longest age limit", "R10")
    contact_n_s_per_m: float = _limit("N s/m", "a hidden hard stop of 1 GN/m", "CAP")
    guarded_speed_m_s: float = _limit("m/s", "force budget")
    fast_speed_m_s: float = _limit("m/s", "force budget with all of F_lim")
    retract_speed_m_s: float = _limit("m/s", "half the arm's, 20 mm/s")
    acceleration_m_s2: float = _limit("m/s^2", "half of the arm's")
    ahead_m: float = _limit("m", f"the arm catching up, or {_FOLLOW}")
    follow_m: float = _limit("m", _FOLLOW)
    damping_n_s_per_m: float = _limit("N s/m", "C_s of the rig", zero=True)
    ring_n_s_per_m: float = _limit("N s/m", "C_s + sqrt(m K_s,max): an arm that rings", "R9")
    arm_acceleration_m_s2: float = _limit("m/s^2", "rig: arm.max_acceleration")
    travel_limit_free_m: float = _limit("m", "(F_lim - F_th - 6 sigma) / K_s,max")
    answer_n_per_m: float = _limit("N/m", f"{_ANSWER} at the touch", "R6")
    answer_top_n_per_m: float = _limit("N/m", f"{_ANSWER} at the top force", "R6")
    answers_n: float = _limit("N", "least rises within the travel limit", "R6")
    step_rate_per_s: float = _limit("1/s", "lambda = 0.25 / T")
    band_n: float = _limit("N", "0.25 N, 2 sigma")
    load_rate_n_per_s: float = _limit("N/s", "plan")
    touch_force_n: float = _limit("N", "plan", "R11")
    lateral_share: float = _limit("", "plan; 0: off", "R12", zero=True)
    lateral_askew: float = _limit("", "share that tilt and mounting may hide", zero=True)
    lateral_weakening: float = _limit("", "a of F_allowed (1 - a t^2), t the share", zero=True)
    lateral_from_n: float = _limit("N", _FROM, zero=True)
    overload_fx_n: float = _limit("N", _OVERLOAD, "R13", zero=True)
    overload_fy_n: float = _limit("N", _OVERLOAD, "R13", zero=True)
    overload_fz_n: float = _limit("N", _OVERLOAD, "R13", zero=True)
    overload_tx_n_m: float = _limit("N m", _OVERLOAD, "R13", zero=True)
    overload_ty_n_m: float = _limit("N m", _OVERLOAD, "R13", zero=True)
    overload_tz_n_m: float = _limit("N m", _OVERLOAD, "R13", zero=True)
    second_overload_fx_n: float = _limit("N", _OVERLOAD, "R13", zero=True)
    second_overload_fy_n: float = _limit("N", _OVERLOAD, "R13", zero=True)
    second_overload_fz_n: float = _limit("N", _OVERLOAD, "R13", zero=True)
    second_overload_tx_n_m: float = _limit("N m", _OVERLOAD, "R13", zero=True)
    second_overload_ty_n_m: float = _limit("N m", _OVERLOAD, "R13", zero=True)
    second_overload_tz_n_m: float = _limit("N m", _OVERLOAD, "R13", zero=True)
    lever_m: float = _limit("m", "rig: force.lever; 0: not stated", zero=True)
    eccentricity_m: float = _limit("m", "plan; 0: off", "R14", zero=True)
    dragged_left: float = _limit("", "of F_c, where no force across is seen", zero=True)
    moved_zero_n: float = _limit("N", "a quarter of the touch force, over 5 s of an approach")
    zero_shift_n: float = _limit("N", "shift of the zero that F_allowed leaves room for")
    zero_drift_n_per_s: float = _limit(
        "N/s", "rig: force.drift, or measured; beside a second channel that one's", zero=True
    )
    shown_noise_n: float = _limit("N", "noise_n at the edge of a quantum: more in a tare is noise")
    drift_n_per_s: float = _limit("N/s", "rig: force.drift", zero=True)
    lost_motion_m: float = _limit("m", "rig: arm.lost_motion", zero=True)
    position_resolution_m: float = _limit("m", "rig: arm.position_resolution")
    second_noise_n: float = _limit("N", "rig: second_force.noise", zero=True)

    def answer_at(self, force_n: float) -> float:
        """Least answer to travel at this force, in N/m: a line from touch to top force.

        Where a payload stiffens with force its tangent lies above that line.
        """
        gone_n, way_n = force_n - self.touch_force_n, self.top_force_n - self.touch_force_n
        if gone_n <= 0.0 or way_n <= 0.0:
            return self.answer_n_per_m
        share = min(1.0, gone_n / way_n)
        return self.answer_n_per_m + share * (self.answer_top_n_per_m - self.answer_n_per_m)

    def travel_m(self, force_n: float) -> float:
        """Travel in m past a force, within which the softest payload must have responded (R6).

        As far as is safe on a rigid surface, or as far as that payload needs.
        """
        room_n = self.room_n(force_n)
        soft_m = self.answers_n / self.answer_at(force_n)
        slack_m = self.follow_m if self.cross_check else self.lost_motion_m
        return max(room_n / self.stiffness_n_per_m, soft_m) + slack_m

    def room_n(self, force_n: float) -> float:
        """Force that is left above this one, less the noise."""
        return self.force_limit_n - force_n - NOISE_MULTIPLE * self.noise_n

    def cap_n(self, force_n: float) -> float:
        """Force by which a hidden hard stop may raise this one: the speed cap in contact."""
        return 1.25 * self.room_n(force_n) + 2.0 * self.noise_n

    def cross_limit_n(self, force_n: float) -> float:
        """Difference of the two force channels that is allowed at this force (R5)."""
        return self.cross_tolerance_n + self.cross_relative * abs(force_n)

    def shows_m(self, retract_m: float) -> float:
        """Way back in m on which the softest payload shows the touch force; at most a retract."""
        return min(retract_m, self.touch_force_n / self.answer_n_per_m)

    @property
    def second_late_s(self) -> float:
        """Longest delay in s from a target to its effect on the second force channel.

        T_react, with the delay of the main channel replaced by the skew, which contains the longer
        delay, the longer period and two ticks.
        """
        return self.reaction_s + max(0.0, self.channel_skew_s - self.force_delay_s)

    @property
    def overload_named(self) -> bool:
        """Whether a rating of the force sensor is stated."""
        return min(*self.overload, *self.second_overload) < math.inf

    @property
    def overload(self) -> tuple[float, ...]:
        """Largest reading of each component, fx … tz in N and N·m; inf where none is stated."""
        return self._ratings(OVERLOADS)

    @property
    def second_overload(self) -> tuple[float, ...]:
        """The same for a second force sensor."""
        return self._ratings(SECOND_OVERLOADS)

    def _ratings(self, names: Sequence[str]) -> tuple[float, ...]:
        return tuple(getattr(self, name) or math.inf for name in names)

    def __post_init__(self) -> None:
        for each in _thresholds():
            value = getattr(self, each.name)
            low_enough = value >= 0.0 if each.metadata["zero"] else value > 0.0
            if not (math.isfinite(value) and low_enough):
                raise DomainError(
                    f"run limit {each.name} is {value}; it must be finite and positive",
                    hint="a limit that is not a number would never trip: check the plan",
                )
            if each.metadata["unit"] == "samples" and not isinstance(value, int):
                raise DomainError(f"run limit {each.name} is {value}; it must be a whole number")

    @property
    def values(self) -> dict[str, float]:
        """Every threshold by its name."""
        return {each.name: getattr(self, each.name) for each in _thresholds()}

    def _term(self, each: Field[Any], source: str) -> Term:
        return Term(each.name, getattr(self, each.name), each.metadata["unit"], source)

    @property
    def terms(self) -> tuple[Term, ...]:
        """Every threshold with its value, unit and source; the rule stands before its source."""
        return tuple(
            self._term(
                each, ": ".join(filter(None, (each.metadata["rule"], each.metadata["source"])))
            )
            for each in _thresholds()
        )

    @property
    def judged(self) -> tuple[tuple[str, Term], ...]:
        """(rule, threshold) of those that a rule of the supervisor stops at on this rig."""
        return tuple(
            (rule, self._term(each, each.metadata["source"]))
            for each in _thresholds()
            if (rule := each.metadata["rule"])
            and getattr(self, each.name)
            and (rule != "R5" or self.cross_check)
        )

    @property
    def off(self) -> tuple[str, ...]:
        """Rules that judge nothing on this rig."""
        on = {rule for rule, _ in self.judged}
        rules = dict.fromkeys(each.metadata["rule"] for each in _thresholds())
        return tuple(rule for rule in rules if rule and rule not in on)


def _thresholds() -> list[Field[Any]]:
    return [each for each in fields(RunLimits) if each.metadata]


def identical_counts(force: ForceSpec, noise_n: float, least: int = IDENTICAL_COUNTS) -> int:
    """How many equal samples in a row are too many for a sound sensor (R4).

    A value in the middle of a quantum q stays there with p = erf(q/(2√2 σ)); the count is the run
    length whose odds are `FALSE_FREEZE_ODDS`, never below `least`. 0 where no count separates
    frozen from sound.
    """
    if force.resolution_n <= 0.0:
        return least
    if noise_n <= 0.0:
        return 0
    stays = math.erf(force.resolution_n / (2.0 * math.sqrt(2.0) * noise_n))
    if stays >= 1.0 - 1e-6:
        return 0
    counts = math.log(FALSE_FREEZE_ODDS) / math.log(stays) if stays > 0.0 else 0.0
    return max(least, math.ceil(counts))


def limits_of(plan: Plan, pressing: Pressing, elastic_limit_n: float) -> RunLimits:
    """All thresholds of a run, from its plan, from how it may press and from the believed F_c.

    Raises:
        DomainError: a threshold would not be finite and positive.
    """
    rig, procedure = plan.rig, plan.procedure
    arm, force, second = rig.arm, rig.force, rig.second_force
    press, forces, noise_n = pressing.rig, pressing.forces, pressing.reading_noise_n
    has_second = second.source is not SecondForceSource.NONE
    beside, least = float(has_second), SECOND_IDENTICAL_COUNTS
    clock_s = max(CLOCK_S, 5.0 / force.rate_hz, force.max_age_s or 0.0, arm.max_age_s or 0.0)
    blur_m = arm.position_resolution_m + 6.0 * arm.position_noise_m + arm.lost_motion_m
    near_edge_m = procedure.surface_distance_m - procedure.surface_uncertainty_m
    return RunLimits(
        cross_check=second.source.value if has_second else "",
        elastic_limit_n=elastic_limit_n,
        used_limit_n=forces.elastic_limit_n,
        force_limit_n=forces.limit_n,
        allowed_n=forces.allowed_n,
        largest_top_n=forces.largest_top_n,
        top_force_n=procedure.top_force_n,
        noise_n=noise_n,
        stiffness_n_per_m=press.stiffness_n_per_m,
        tangent_n_per_m=pressing.tangent_n_per_m,
        period_s=1.0 / arm.rate_hz,
        reading_s=max(1.0 / arm.rate_hz, 1.0 / force.rate_hz),
        loop_s=press.loop_s,
        reaction_s=press.reaction_s,
        force_delay_s=force.delay_s,
        stale_force_s=age_limit_s(force),
        stale_arm_s=age_limit_s(arm),
        stale_second_s=age_limit_s(second.sensor or arm),
        # Measured noise contains the resolution too: with it a sound sensor would count as frozen.
        identical_counts=identical_counts(force, min(press.noise_n, force.noise_n)),
        second_identical_counts=identical_counts(second.sensor, second.noise_n, least)
        if second.sensor
        else least,
        full_scale_n=force.range_n,
        cross_tolerance_n=beside * second.tolerance_n,
        cross_relative=beside * second.tolerance_relative,
        cross_time_s=beside * second.time_s,
        cross_filter_s=CROSS_CHECK_FILTER_S,
        second_limit_n=beside
        * (forces.limit_n * (1.0 + second.tolerance_relative) + second.tolerance_n),
        second_zero_n=beside * max(SECOND_ZERO_SHARE * second.tolerance_n, second_zero_n(second)),
        channel_skew_s=channel_skew_s(rig),
        travel_limit_time_s=0.0 if has_second else TRAVEL_LIMIT_TIME_S + pressing.undetected_s,
        undetected_s=pressing.undetected_s,
        model_tolerance_m=arm.model_tolerance_m,
        model_lag_s=MODEL_LAG_S,
        still_m=STILL_BLURS * blur_m,
        command_delay_s=arm.command_delay_s,
        arm_lag_s=arm.lag_s,
        search_end_m=near_edge_m + procedure.search_distance_m,
        jump_n=10.0 * noise_n + 2.0 * force.resolution_n,
        clock_s=clock_s,
        contact_n_s_per_m=pressing.contact_n_s_per_m,
        guarded_speed_m_s=min(pressing.guarded_speed_m_s, pressing.fast_speed_m_s),
        fast_speed_m_s=pressing.fast_speed_m_s,
        retract_speed_m_s=retract_speed_m_s(rig),
        acceleration_m_s2=0.5 * arm.max_acceleration_m_s2,
        ahead_m=pressing.ahead_m,
        follow_m=pressing.follow_m,
        damping_n_s_per_m=press.damping_n_s_per_m,
        ring_n_s_per_m=press.damping_n_s_per_m + math.sqrt(press.mass_kg * press.stiffness_n_per_m),
        arm_acceleration_m_s2=press.acceleration_m_s2,
        travel_limit_free_m=pressing.travel_limit_free_m,
        answer_n_per_m=pressing.answer_n_per_m,
        answer_top_n_per_m=pressing.answer_top_n_per_m,
        answers_n=pressing.answers_n,
        step_rate_per_s=step_rate_per_s(press.loop_s),
        band_n=step_band_n(press.noise_n),
        load_rate_n_per_s=procedure.load_rate_n_per_s,
        touch_force_n=procedure.touch_force_n,
        **lateral_limits(plan, noise_n, forces.allowed_n),
        moved_zero_n=MOVED_ZERO_SHARE * procedure.touch_force_n,
        zero_shift_n=pressing.zero_shift_n,
        zero_drift_n_per_s=pressing.zero_drift_n_per_s,
        shown_noise_n=shown_noise_n(press.noise_n, force.resolution_n),
        drift_n_per_s=force.drift_n_per_s,
        lost_motion_m=arm.lost_motion_m,
        position_resolution_m=arm.position_resolution_m,
        second_noise_n=beside * second.noise_n,
    )
