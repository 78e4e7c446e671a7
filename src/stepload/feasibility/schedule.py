"""How long a plan takes, phase by phase, before anything moves: plans are data."""

from __future__ import annotations

import math
from dataclasses import dataclass

from stepload.contact.plane import CIRCLE
from stepload.feasibility.aligning import Aligning
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.load_times import LoadTimes
from stepload.plan.model import Procedure

LOOK_S = 0.2
"""Duration in s of each force measurement that proves free air, before and after backing off."""
DRIFT_CHECK_S = 0.5
REST_S = 0.2
"""Rest after a retract; the loop's own delays come on top."""
RING_S = 0.2
"""Time in s until the ringing of a touch has died out."""
SETTLED_S = 1.2
"""Time in s until the settling test can pass; a hold waits for it."""
BETWEEN_CYCLES_TARE_S = 1.0
LOAD_STEP, UNLOAD_STEP = "load step with hold", "unload step with hold"
BETWEEN, UNLOAD_BETWEEN = "part, tare and touch between cycles", "unload between cycles"
LAST = "retract, second tare, last touch"
"""Names of stages; what comes before the load steps is in the order of time."""
ALIGN = "align with the plate"
FAST, GUARDED = "fast approach", "guarded approach"
AGAIN = "touch again"
APPROACH = (ALIGN, FAST, GUARDED, AGAIN)
"""From the first zero of the force to the first load step."""
UNDER_LOAD = (LOAD_STEP, UNLOAD_STEP, UNLOAD_BETWEEN)
SLOW_SHARE = 0.5
"""Share of the guarded speed that is used where the surface is known."""

WORTH = 2.0
"""Least distance between two zeros taken in one approach, in retracts."""
USUAL_DRIFT = 1.0 / 3.0
"""Usual drift of a zero over the largest, which is stated; it decides how often it is renewed."""


def touch_gap_m(limits: RunLimits, retract_m: float) -> float:
    """How far the arm backs off between touches, in m."""
    gap_m = max(
        20.0 * limits.position_resolution_m,
        4.0 * limits.lost_motion_m,
        0.3 * limits.guarded_speed_m_s,
    )
    return min(retract_m, gap_m)


@dataclass(frozen=True, slots=True)
class Stage:
    """One line of the schedule; `repeats` times `each_s`.

    Where its parts differ `each_s` is their mean, and `parts_s` are those of one cycle in order.
    """

    name: str
    each_s: float
    repeats: int
    parts_s: tuple[float, ...] = ()

    @property
    def total_s(self) -> float:
        """Time of all repeats together."""
        return self.each_s * self.repeats


def align_s(procedure: Procedure, limits: RunLimits, aligning: Aligning) -> float:
    """Expected time in s of the touches on a circle, the first one in its middle included."""
    slow_m_s, fast_m_s = SLOW_SHARE * limits.guarded_speed_m_s, limits.fast_speed_m_s
    run_out_m = 2.0 * fast_m_s * limits.reaction_s
    near_m = procedure.surface_uncertainty_m
    first_s = (procedure.surface_distance_m - near_m) / fast_m_s
    first_s += (near_m + run_out_m) / limits.guarded_speed_m_s + RING_S
    down_s = (aligning.early_m + run_out_m) / slow_m_s + RING_S
    back_s = aligning.clear_m / limits.retract_speed_m_s + 2.0 * (REST_S + 4.0 * limits.loop_s)
    ways_m = aligning.radius_m * (2.0 + (CIRCLE - 1) * math.sqrt(3.0))
    return first_s + CIRCLE * down_s + (CIRCLE + 1) * back_s + ways_m / aligning.speed_m_s


def renewals(limits: RunLimits, fast_m: float, way_m: float, retract_m: float) -> int:
    """How often the zero is expected to be taken anew on a first approach of this length.

    It is fast up to `fast_m`. See `engine.approach`.
    """
    drift_n_per_s = USUAL_DRIFT * limits.drift_n_per_s
    from_m, next_m, count = 0.0, WORTH * retract_m, 0
    while drift_n_per_s > 0.0:
        left_s = limits.moved_zero_n / drift_n_per_s
        moved_m = max(fast_m - from_m, 0.0)
        moved_m = min(moved_m, limits.fast_speed_m_s * left_s)
        left_s -= moved_m / limits.fast_speed_m_s
        at_m = max(from_m + moved_m + limits.guarded_speed_m_s * left_s, next_m)
        if at_m >= way_m:
            break
        from_m, next_m, count = at_m - retract_m, at_m + WORTH * retract_m, count + 1
    return count


def schedule(
    procedure: Procedure,
    limits: RunLimits,
    loading_times: LoadTimes,
    *,
    align_s: float = 0.0,
) -> tuple[Stage, ...]:
    """Expected stages of a run that meets no trouble, from open devices on.

    Proving free air leaves the arm backed off by the retract: that way is approached again, before
    the first touch and after every lift-off.

    Args:
        loading_times: times of the load steps, without their holds.
        align_s: time of the touches on a circle; 0 without them.
    """
    fast_m_s, guarded_m_s = limits.fast_speed_m_s, limits.guarded_speed_m_s
    back_m, band_m = procedure.retract_m, procedure.surface_uncertainty_m
    clear_m = max(procedure.surface_distance_m - band_m, 0.0)
    run_out_m = 2.0 * fast_m_s * limits.reaction_s
    gap_m = touch_gap_m(limits, back_m)
    settled_s = 4.0 / limits.step_rate_per_s + SETTLED_S
    longest_s = procedure.hold_s + procedure.settle_timeout_s
    hold_s = min(max(procedure.hold_s, settled_s), longest_s)
    up = tuple(each + hold_s for each in loading_times.up_s)
    down = (
        tuple(each + hold_s for each in reversed(loading_times.down_s)) if procedure.unload else ()
    )
    rest_s = REST_S + 4.0 * limits.loop_s
    back_s = back_m / limits.retract_speed_m_s + rest_s
    first_m = min(back_m, clear_m)
    first_s = first_m / min(limits.retract_speed_m_s, guarded_m_s) + rest_s
    ring_s = RING_S + 2.0 * limits.undetected_s  # an only channel is waited for, before and after
    slow_m_s = SLOW_SHARE * guarded_m_s
    touch_s = gap_m / limits.retract_speed_m_s + REST_S + gap_m / slow_m_s + ring_s
    return_s = max(back_m - gap_m - run_out_m, 0.0) / fast_m_s
    return_s += (gap_m + run_out_m) / slow_m_s + ring_s
    again_touches, again_s = procedure.touches - 1, touch_s
    if clear_m < (shows_m := limits.shows_m(back_m)):
        # The first of them is after a longer way back, see `engine.approach`.
        again_touches, longer_m = max(again_touches, 1), max(shows_m - gap_m, 0.0)
        again_s += longer_m * (1.0 / limits.retract_speed_m_s + 1.0 / slow_m_s) / again_touches
    fast_m = max(clear_m + first_m - run_out_m, 0.0)
    guarded_m = band_m + run_out_m + loading_times.touch_m
    again = renewals(limits, fast_m, fast_m + guarded_m, back_m)
    between_s = min(procedure.tare_s, BETWEEN_CYCLES_TARE_S)
    stages = [
        Stage("warm up", procedure.warm_up_s, 1),
        Stage("prove free air", 2.0 * LOOK_S + first_s, 1 + again),
        Stage("tare and drift check", procedure.tare_s + DRIFT_CHECK_S, 1 + again),
        Stage(ALIGN, align_s, 1),
        Stage(FAST, (fast_m + again * back_m) / fast_m_s, 1),
        Stage(GUARDED, guarded_m / guarded_m_s + ring_s, 1),
        Stage(AGAIN, again_s, again_touches),
        _steps(LOAD_STEP, up, procedure.cycles),
        _steps(UNLOAD_STEP, down, procedure.cycles),
    ]
    if procedure.cycles > 1 and procedure.lift_off:
        part_s = back_s + between_s + return_s
        stages.append(Stage(BETWEEN, part_s, procedure.cycles - 1))
    elif procedure.cycles > 1:
        last_s = (down or up)[-1]
        stages.append(Stage(UNLOAD_BETWEEN, last_s, procedure.cycles - 1))
    end_s = 2.0 * back_s + procedure.tare_s + return_s
    stages.append(Stage(LAST, end_s, 1))
    return tuple(stage for stage in stages if stage.total_s > 0.0)


def _steps(name: str, parts_s: tuple[float, ...], cycles: int) -> Stage:
    mean_s = sum(parts_s) / len(parts_s) if parts_s else 0.0
    return Stage(name, mean_s, len(parts_s) * cycles, parts_s)
