"""Approach to the surface: fast where nothing can be, guarded where it may be, then the touch."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

from stepload.engine.course import Course, Then
from stepload.engine.retract import REST_S, not_open
from stepload.engine.settle import RingTest
from stepload.engine.touch import TouchTest
from stepload.engine.tracking import Lead
from stepload.envelope.schedule import SLOW_SHARE, WORTH, touch_gap_m
from stepload.record.outcome import Touch
from stepload.record.rows import Phase

RING_TIMEOUT_S = 2.0
MEAN_S = 5.0
"""Time constant of the mean force in an approach: a zero moves slowly, a contact grows fast."""
Zero = Callable[[float, Then, Then | None], None]
"""Proves free air and takes the zero: (now_s, what follows, what follows on contact)."""
FIRST = "first"
"""Purpose of the first touch of a run on the axis."""
CIRCLE = "circle"
"""Purpose of a touch beside the axis: it measures the plate, and belongs to no cycle."""


class Approach:
    """Finds the surface, as often as it is asked to, and stays in touch with it.

    Args:
        course: state of the run.
        stopped: what to do when the operator stops the search.
        zero: proves free air, takes the zero anew, and goes on; see `Zeroing.take`.
    """

    def __init__(self, course: Course, stopped: Then, zero: Zero) -> None:
        self._course = course
        self._stopped = stopped
        self._zero = zero
        self._zeroed = False
        self._mean_n, self._renews, self._renew_from_m = 0.0, True, 0.0
        self._mean_share = course.limits.period_s / MEAN_S
        self._then: Then = stopped
        self._purpose = ""
        self._slow = False
        self._left = 0
        self._early_m = 0.0
        self._lead = Lead(course.limits.period_s)
        limits = course.limits
        late_s = limits.unseen_s + limits.reaction_s
        self._targets_m: deque[float] = deque(maxlen=1 + math.ceil(late_s / limits.period_s))
        self._reading_n, self._heard_m = math.nan, -math.inf
        self._felt = TouchTest(course.limits.touch_force_n)
        self._ring = RingTest(course.limits.noise_n)
        self._rung_out_s, self._dwelt = 0.0, 0

    def begin(self, now_s: float, purpose: str, touches: int, then: Then) -> None:
        """Touch `touches` times, then call `then` in contact; `purpose` goes into the record.

        Where the zero is not proven the first time there are at least two touches.
        """
        self._purpose, self._then = purpose, then
        self._left = max(touches, 2) if self._unshown else touches
        self._zeroed = False
        self._mean_n, self._renews = 0.0, True
        self._renew_from_m = self._course.target_m + WORTH * self._course.retract_m
        self._early_m = 0.0
        self._fast_to_guarded(now_s)

    def beside(self, now_s: float, early_m: float, then: Then) -> None:
        """Touch once beside the axis to measure the plate; slow for the last `early_m`."""
        self._purpose, self._left, self._then = CIRCLE, 1, then
        self._zeroed, self._renews = False, False
        self._early_m = early_m
        self._fast_to_guarded(now_s)

    def _fast_to_guarded(self, now_s: float) -> None:
        course, plan = self._course, self._course.plan
        self._slow = known = course.surface_m == course.surface_m
        near_m = plan.surface_distance_m - plan.surface_uncertainty_m
        if known:
            near_m = course.surface_m - self._gap_m() - self._early_m
        run_out_m = 2.0 * course.limits.fast_speed_m_s * course.limits.reaction_s
        self._felt = TouchTest(course.limits.touch_force_n)
        self._restart()
        course.aim(near_m - run_out_m)
        self._begin_fast(now_s)

    def _restart(self) -> None:
        """Forget the targets: the arm has gone back."""
        self._targets_m.clear()
        self._targets_m.append(self._course.target_m)
        self._heard_m = self._course.target_m

    def _begin_fast(self, now_s: float) -> None:
        self._lead.begin(self._course.target_m - self._course.sup.arm.position_m)
        self._course.enter(Phase.FAST_APPROACH, now_s, self._fast)

    def _fast(self, now_s: float, step_s: float) -> None:
        course = self._course
        if self._held_up(now_s):
            return
        limits = course.limits
        if course.target_m >= course.goal_m or course.move(limits.fast_speed_m_s, step_s):
            self._begin_guarded(now_s)
        allowed_m = limits.fast_speed_m_s * limits.reaction_s + limits.ahead_m
        course.target_m -= self._lead.excess(course.target_m, course.sup.arm.position_m, allowed_m)

    def _begin_guarded(self, now_s: float) -> None:
        course = self._course
        limits = course.limits
        lead_m = course.target_m - course.sup.arm.position_m
        self._lead.begin(min(lead_m, limits.fast_speed_m_s * limits.reaction_s + limits.ahead_m))
        course.enter(Phase.GUARDED_APPROACH, now_s, self._guarded)

    def _guarded(self, now_s: float, step_s: float) -> None:
        course = self._course
        if self._held_up(now_s):
            return
        limits = course.limits
        speed = min(limits.guarded_speed_m_s, course.speed_m_s + limits.acceleration_m_s2 * step_s)
        if self._slow:
            speed = min(speed, SLOW_SHARE * limits.guarded_speed_m_s)
        course.speed_m_s = speed
        from_m = course.target_m
        course.target_m = from_m + speed * step_s
        if not limits.cross_check:
            self._hold_back(from_m)
        position_m = course.sup.arm.position_m
        course.target_m -= self._lead.excess(course.target_m, position_m, limits.ahead_m)

    def _hold_back(self, from_m: float) -> None:
        """With one force channel: do not go far beyond what its newest reading can show.

        A reading may be `unseen_s` old and still arrive; one that repeats itself shows nothing.
        """
        course, limits = self._course, self._course.limits
        end_m = max(from_m, self._heard_m + limits.leash_free_m)
        if course.target_m > end_m:
            course.target_m = end_m

    def _listen(self) -> None:
        """Take in what the force channel reads, of where the target was."""
        course, reading_n = self._course, self._course.sup.force.raw_n
        targets_m = self._targets_m
        targets_m.append(course.target_m)
        if reading_n != self._reading_n:
            self._reading_n, self._heard_m = reading_n, targets_m[0]

    def _too_deep(self) -> bool:
        """End the run (R6) where an only force channel does not feel a surface that is known.

        Where a level was held before it was answered, and may be gone to again.
        """
        course, limits = self._course, self._course.limits
        if limits.cross_check or course.surface_m != course.surface_m:
            return False
        touch_n = limits.touch_force_n
        slack_m = limits.travel_m(touch_n) + limits.moved_zero_n / limits.answer_at(touch_n)
        end_m = max(course.surface_m + slack_m, course.deepest_m) + self._early_m
        beyond_m = course.sup.arm.position_m - end_m
        if not beyond_m > 0.0:
            return False
        travel_m, most_m = end_m + beyond_m - course.surface_m, end_m - course.surface_m
        course.fail(
            "R6", travel_m, most_m, "m",
            f"{travel_m * 1e6:.1f} um past the last touch without the force of a touch",
        )  # fmt: skip
        return True

    def _held_up(self, now_s: float) -> bool:
        """Whether the approach pauses in this tick, or has come to its end."""
        self._listen()
        return (
            self._touched(now_s)
            or self._too_deep()
            or self._stop_asked(now_s)
            or self._felt.waits(now_s)
            or self._zero_moved(now_s)
        )

    def _zero_moved(self, now_s: float) -> bool:
        """Back off and take the zero again where it has drifted on a long approach.

        Only after more distance was gained than backing off costs: the zero drifts on meanwhile.
        """
        course, limits = self._course, self._course.limits
        self._mean_n += self._mean_share * (course.sup.smooth_n - self._mean_n)
        moved = abs(self._mean_n) > limits.moved_zero_n
        if not (moved and self._renews and course.may_be_zero):
            return False
        if course.target_m < self._renew_from_m:
            return False
        self._mean_n, self._renew_from_m = 0.0, course.target_m + WORTH * course.retract_m
        self._zero(now_s, self._fast_to_guarded, self._meet)
        return True

    def _meet(self, now_s: float) -> None:
        """Approach what was felt, without a new zero; the touch test and R11 judge what it is."""
        self._renews = False
        self._begin_guarded(now_s)

    def _stop_asked(self, now_s: float) -> bool:
        if not self._course.stop_asked():
            return False
        self._stopped(now_s)
        return True

    def _touched(self, now_s: float) -> bool:
        course = self._course
        sup, limits = course.sup, course.limits
        if sup.force.fresh:
            self._felt.add(now_s, sup.force_n)
        if not self._felt.touched:
            return False
        position_m = sup.arm.position_m
        touch = Touch(
            now_s, position_m, sup.force_n, course.speed_m_s, course.cycle, self._purpose
        )  # fmt: skip
        if self._purpose == CIRCLE:
            told = touch._asdict() | {"shift_m": list(course.shift_m)}
            course.emit(now_s, "circle_touch", told)
        else:
            course.touches.append(touch)
            course.emit(now_s, "touch", touch._asdict())
        course.surface_m = position_m
        self._renews = False  # what grows slowly from here on is a soft payload
        course.target_m = min(course.target_m, position_m)
        self._ring = RingTest(limits.noise_n)
        self._rung_out_s = now_s + max(2.0 * limits.reaction_s, limits.unseen_s)
        self._ring.begin(self._rung_out_s, sup.force_n)
        course.dwelt_n, self._dwelt = sup.force_n, 0
        course.enter(Phase.DWELL, now_s, self._dwell)
        return True

    def _dwell(self, now_s: float, _step_s: float) -> None:
        """Wait until the touch has rung out, and until no reading is from before it."""
        course, ring = self._course, self._ring
        force_n = course.sup.force_n
        ring.add(now_s, force_n)
        if now_s >= self._rung_out_s:
            self._dwelt += 1
            course.dwelt_n += (force_n - course.dwelt_n) / self._dwelt
        if not ring.quiet and now_s - course.since_s < RING_TIMEOUT_S:
            return
        self._left -= 1
        if self._left <= 0 or course.stop_asked():
            self._then(now_s)
            return
        back_m = self._gap_m()
        if self._unshown:
            back_m = max(back_m, course.limits.shows_m(course.retract_m))
        self._purpose, self._slow = "again", True
        course.enter(Phase.TOUCH_RETRACT, now_s, self._part)
        course.aim(course.surface_m - back_m)

    @property
    def _unshown(self) -> bool:
        """Whether the zero may hold a contact force that the back-off in free air did not show.

        A free way that short may leave a soft payload pressed. The first touch proves the
        direction; a retract that is long enough then shows the force.
        """
        course = self._course
        return self._purpose == FIRST and course.free_m < course.limits.shows_m(course.retract_m)

    def _gap_m(self) -> float:
        """How far to back off between touches."""
        return touch_gap_m(self._course.limits, self._course.plan.retract_m)

    def _part(self, now_s: float, step_s: float) -> None:
        """Back off by as many gaps as it takes until the force is gone, then touch again.

        Force that is left after a full retract may be a zero that drifted during the approach.
        Once, and within the drift that the limits allow for, free air is proved and the zero taken
        anew.
        """
        course = self._course
        if not course.rest_at_goal(now_s, step_s, REST_S):
            return
        free_n = 0.5 * course.limits.touch_force_n
        if abs(course.sup.smooth_n) > free_n:
            furthest_m = course.surface_m - course.plan.retract_m
            if course.goal_m <= furthest_m:
                if self._zeroed or not course.may_be_zero:
                    not_open(course, free_n)
                else:
                    self._zeroed = True
                    self._zero(now_s, self._fast_to_guarded, None)
                return
            course.aim(max(course.goal_m - self._gap_m(), furthest_m))
            return
        self._felt = TouchTest(course.limits.touch_force_n)
        self._restart()
        self._begin_guarded(now_s)
