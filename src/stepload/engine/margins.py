"""How near each rule is to stopping the run: a share of its limit, 1 where it trips.

For display only; the supervisor alone judges.
"""

from __future__ import annotations

import math

from stepload.engine.motion import SEARCHING
from stepload.engine.supervisor import ACROSS_SIGMAS, Supervisor
from stepload.envelope.limits import RunLimits
from stepload.record.rows import Phase

MEANING = {
    "R1": "force",
    "R2": "predicted peak",
    "R3": "age of samples",
    "R4": "frozen readings",
    "R5": "channels differ",
    "R6": "no answer in force",
    "R7": "arm off its model",
    "R8": "search distance",
    "R11": "wrong way",
    "R12": "dragged sideways",
    "R13": "sensor overloaded",
    "R14": "touched beside the axis",
    "CAP": "speed in contact",
}
"""What each rule is about, in a few words. R9 and R10 judge single samples and have no margin."""
RULES = tuple(MEANING)


def margins(
    supervisor: Supervisor, limits: RunLimits, now_s: float, phase: int
) -> dict[str, float]:
    """The share of its limit that each rule has used; those that do not judge now are left out.

    R5 and R6 also wait for a time: they may stay at 1 or above for that long without a stop. R1 and
    R2 are judged for the resultant where there is lateral force too.

    Args:
        supervisor: after it has judged the tick of `now_s`.
        limits: the thresholds in use.
        phase: of the tick.
    """
    sup, motion = supervisor, supervisor.motion
    found = {
        "R3": _largest(
            (now_s - sup.force.receive_s) / limits.stale_force_s,
            (now_s - sup.arm.receive_s) / limits.stale_arm_s,
            (now_s - sup.second.receive_s) / limits.stale_second_s if sup.second else 0.0,
        ),
        "R4": _largest(
            _share(sup.force.same, limits.identical_counts or math.inf),
            _share(sup.second.same, limits.second_identical_counts or math.inf)
            if sup.second
            else 0.0,
        ),
        "R7": _largest(
            _share(
                abs(sup.arm.position_m - motion.model_m),
                limits.model_tolerance_m + limits.model_lag_s * motion.recent_m_s,
            ),
            motion.still_share(sup.arm.position_m),
            motion.waited_share(now_s),
        ),
    }
    if phase in SEARCHING:
        found["R8"] = _largest(sup.arm.position_m / limits.search_end_m)
        across_n = max(limits.touch_force_n, ACROSS_SIGMAS * limits.noise_n)
        second_n = max(limits.touch_force_n, ACROSS_SIGMAS * limits.second_noise_n)
        found["R11"] = _largest(
            -sup.force_n / limits.touch_force_n,
            sup.force.smooth_across_n / across_n,
            sup.second.smooth_across_n / second_n if sup.second else 0.0,
        )
    if limits.overload_named:
        found["R13"] = _largest(sup.overload.used, sup.second_overload.used)
    if not sup.tared:
        return found
    if phase not in SEARCHING:
        if limits.lateral_share:
            share = max(sup.wrench.share, sup.arm_wrench.share)
            found["R12"] = _share(share, limits.lateral_share)
        if limits.eccentricity_m:
            found["R14"] = _share(sup.wrench.off_m, limits.eccentricity_m)
    limit_n = limits.force_limit_n
    found["R1"] = _largest(
        math.hypot(sup.force_n, sup.force.across_n) / limit_n,
        math.hypot(sup.force_n, sup.arm_across_n) / limit_n,
        math.hypot(sup.second_n, sup.second.across_n) / limit_n if sup.second else 0.0,
        abs(sup.second_n) / limits.second_limit_n if limits.cross_check else 0.0,
    )
    across_n = max(sup.force.across_n, sup.arm_across_n)
    found["R2"] = _largest(
        math.hypot(sup.predicted_n, across_n) / limit_n,
        sup.second_predicted_n / limits.second_limit_n if limits.cross_check else 0.0,
    )
    if limits.cross_check:
        tolerance_n = limits.cross_tolerance_n + limits.cross_relative * abs(sup.smooth_n)
        found["R5"] = _share(abs(sup.difference_n), tolerance_n)
    if phase == Phase.LOAD:
        room_n = limit_n - sup.smooth_n - 6.0 * limits.noise_n
        cap_n = 1.25 * room_n + 2.0 * limits.noise_n
        found["CAP"] = _share(motion.speed_m_s * limits.contact_n_s_per_m, cap_n)
        found["R6"] = _share(sup.travel_m, sup.answers.limit_m())
    return found


def _share(value: float, limit: float) -> float:
    """Used share of a limit; where the limit is not positive, any positive value is 1."""
    return _largest(value / limit if limit > 0.0 else float(value > 0.0))


def _largest(*shares: float) -> float:
    """The largest share that is a number and positive, 0 where there is none."""
    return max((share for share in shares if share > 0.0), default=0.0)
