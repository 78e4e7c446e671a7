"""Approach to the surface: fast where nothing can be, guarded where it may be, then the touch."""

from __future__ import annotations

import math
from collections import deque

from stepload.engine.controller import Lead
from stepload.engine.force_state import RingTest, TouchTest
from stepload.engine.phases import Exit, May, Steps, phase
from stepload.engine.retract import REST_S, not_open
from stepload.engine.run_state import RunState
from stepload.engine.zeroing import Zeroing
from stepload.feasibility.schedule import SLOW_SHARE, WORTH, touch_gap_m
from stepload.record.outcome import Touch
from stepload.record.rows import Phase

RING_TIMEOUT_S = 2.0
MEAN_S = 5.0
"""Time constant of the mean force in an approach: a zero moves slowly, a contact grows fast."""
FIRST = "first"
"""Purpose of the first touch of a run on the axis."""
CIRCLE = "circle"
"""Purpose of a touch beside the axis: it measures the plate, and belongs to no cycle."""


class Approach:
    """Finds the surface, as often as it is asked to, and stays in touch with it.

    Args:
        course: state of the run.
        zeroing: proves free air and takes the zero anew, where it has moved on the way.
    """

    def __init__(self, course: RunState, zeroing: Zeroing) -> None:
        self._course = course
        self._zeroing = zeroing
        self._zeroed = False
        self._mean_n, self._renews, self._renew_from_m = 0.0, True, 0.0
        self._mean_share = course.limits.period_s / MEAN_S
        self._purpose = ""
        self._slow = False
        self._left = 0
        self._early_m = 0.0
        self._lead = Lead(course.limits.period_s)
        limits = course.limits
        late_s = limits.undetected_s + limits.reaction_s
        self._targets_m: deque[float] = deque(maxlen=1 + math.ceil(late_s / limits.period_s))
        self._reading_n, self._received_m = math.nan, -math.inf
        self._felt = TouchTest(course.limits.touch_force_n)

    def touch(self, purpose: str, touches: int) -> Steps:
        """Touch `touches` times, and stay in contact; `purpose` goes into the record.

        Where the zero is not proven the first time there are at least two touches.
        """
        self._purpose = purpose
        self._left = max(touches, 2) if self._unshown else touches
        self._zeroed = False
        self._mean_n, self._renews = 0.0, True
        self._renew_from_m = self._course.target_m + WORTH * self._course.retract_m
        self._early_m = 0.0
        return (yield from self._search())

    def beside(self, early_m: float) -> Steps:
        """Touch once beside the axis to measure the plate; slow for the last `early_m`."""
        self._purpose, self._left = CIRCLE, 1
        self._zeroed, self._renews = False, False
        self._early_m = early_m
        return (yield from self._search())

    def _search(self) -> Steps:
        """Until it has touched often enough."""
        course, far = self._course, True
        while True:
            if far:
                left = yield from self.fast()
            else:
                self._keep_lead()
                left = None
            left = left or (yield from self.guarded())
            on_the_way = left is Exit.ZERO
            if left is Exit.TOUCH:
                left = yield from self.dwell()
                self._left -= 1
                if self._left <= 0 or course.stop_requested():
                    return None
                left = yield from self.part()
            far = left is Exit.ZERO
            if far:
                left = yield from self._zeroing.take(on_the_way)
                if left is Exit.CONTACT:
                    # The touch test and R11 judge what was felt, without a new zero.
                    self._renews = far = False
                    left = None
            if left:
                return left

    @phase(
        Phase.FAST_APPROACH, "the zero was taken", May.TOWARDS,
        Exit.TOUCH, Exit.ZERO, Exit.STOP, Exit.FAIL,
    )  # fmt: skip
    def fast(self) -> Steps:
        """Go to where the surface may be."""
        course, procedure = self._course, self._course.procedure
        self._slow = known = course.surface_m == course.surface_m
        near_m = procedure.surface_distance_m - procedure.surface_uncertainty_m
        if known:
            near_m = course.surface_m - self._gap_m() - self._early_m
        self._restart()
        course.aim(near_m - 2.0 * course.limits.fast_speed_m_s * course.limits.reaction_s)
        self._lead.begin(course.target_m - course.sup.arm.position_m)
        course.enter(Phase.FAST_APPROACH)
        near = False
        while not near:
            yield
            if left := self._seen():
                return left
            if self._felt.waits(course.now_s):
                continue
            if self._zero_moved():
                return Exit.ZERO
            limits = course.limits
            near = course.target_m >= course.goal_m or course.move(limits.fast_speed_m_s)
            if near:
                self._keep_lead()
            allowed_m = limits.fast_speed_m_s * limits.reaction_s + limits.ahead_m
            course.target_m -= self._lead.excess(
                course.target_m, course.sup.arm.position_m, allowed_m
            )
        return None

    def _keep_lead(self) -> None:
        """Go on with the lead of now, as far as it may be one of an arm that follows."""
        course, limits = self._course, self._course.limits
        lead_m = course.target_m - course.sup.arm.position_m
        self._lead.begin(min(lead_m, limits.fast_speed_m_s * limits.reaction_s + limits.ahead_m))

    @phase(
        Phase.GUARDED_APPROACH, "the surface may be near", May.TOWARDS,
        Exit.TOUCH, Exit.ZERO, Exit.STOP, Exit.FAIL,
    )  # fmt: skip
    def guarded(self) -> Steps:
        """Go on at the speed at which a touch is harmless."""
        course = self._course
        course.enter(Phase.GUARDED_APPROACH)
        while True:
            yield
            if left := self._seen():
                return left
            if self._felt.waits(course.now_s):
                continue
            if self._zero_moved():
                return Exit.ZERO
            self._advance()

    def _advance(self) -> None:
        course, limits, step_s = self._course, self._course.limits, self._course.step_s
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

    def _restart(self) -> None:
        """Forget what was felt, and the targets: the arm has gone back."""
        self._felt = TouchTest(self._course.limits.touch_force_n)
        self._targets_m.clear()
        self._targets_m.append(self._course.target_m)
        self._received_m = self._course.target_m

    def _hold_back(self, from_m: float) -> None:
        """With one force channel: do not go far beyond what its newest reading can show.

        A reading may be `undetected_s` old and still arrive; one that repeats itself shows nothing.
        """
        course, limits = self._course, self._course.limits
        end_m = max(from_m, self._received_m + limits.travel_limit_free_m)
        if course.target_m > end_m:
            course.target_m = end_m

    def _listen(self) -> None:
        """Take in what the force channel reads, of where the target was."""
        course, reading_n = self._course, self._course.sup.force.raw_n
        targets_m = self._targets_m
        targets_m.append(course.target_m)
        if reading_n != self._reading_n:
            self._reading_n, self._received_m = reading_n, targets_m[0]

    def _too_deep(self) -> Exit | None:
        """End the run (R6) where an only force channel does not feel a surface that is known.

        Where a level was held before it was answered, and may be gone to again.
        """
        course, limits = self._course, self._course.limits
        if limits.cross_check or course.surface_m != course.surface_m:
            return None
        touch_n = limits.touch_force_n
        slack_m = limits.travel_m(touch_n) + limits.moved_zero_n / limits.answer_at(touch_n)
        end_m = max(course.surface_m + slack_m, course.deepest_m) + self._early_m
        beyond_m = course.sup.arm.position_m - end_m
        if not beyond_m > 0.0:
            return None
        travel_m, most_m = end_m + beyond_m - course.surface_m, end_m - course.surface_m
        return course.fail(
            "R6", travel_m, most_m, "m",
            f"{travel_m * 1e6:.1f} um past the last touch without the force of a touch",
        )  # fmt: skip

    def _seen(self) -> Exit | None:
        """Why the approach ends in this tick."""
        course = self._course
        self._listen()
        if course.sup.force.fresh:
            self._felt.add(course.now_s, course.sup.force_n)
        if self._felt.touched:
            return Exit.TOUCH
        return self._too_deep() or (Exit.STOP if course.stop_requested() else None)

    def _zero_moved(self) -> bool:
        """Whether to back off and take the zero again: it has drifted on a long approach.

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
        return True

    @phase(Phase.DWELL, "a touch", May.STAND)
    def dwell(self) -> Steps:
        """Wait until the touch has rung out, and until no reading is from before it."""
        course, sup, limits = self._course, self._course.sup, self._course.limits
        self._tell_touch()
        course.surface_m = position_m = sup.arm.position_m
        self._renews = False  # what grows slowly from here on is a soft payload
        course.target_m = min(course.target_m, position_m)
        ring, rung_out_s = RingTest(limits.noise_n), course.now_s
        rung_out_s += max(2.0 * limits.reaction_s, limits.undetected_s)
        ring.begin(rung_out_s, sup.force_n)
        course.dwelt_n, dwelt = sup.force_n, 0
        course.enter(Phase.DWELL)
        while not ring.quiet and course.now_s - course.since_s < RING_TIMEOUT_S:
            yield
            ring.add(course.now_s, sup.force_n)
            if course.now_s >= rung_out_s:
                dwelt += 1
                course.dwelt_n += (sup.force_n - course.dwelt_n) / dwelt
        return None

    def _tell_touch(self) -> None:
        course, sup = self._course, self._course.sup
        touch = Touch(
            course.now_s, sup.arm.position_m, sup.force_n, course.speed_m_s, course.cycle,
            self._purpose,
        )  # fmt: skip
        if self._purpose == CIRCLE:
            course.tell("circle_touch", touch._asdict() | {"shift_m": list(course.shift_m)})
        else:
            course.touches.append(touch)
            course.tell("touch", touch._asdict())

    @phase(Phase.TOUCH_RETRACT, "between touches", May.BACK, Exit.ZERO, Exit.FAIL)
    def part(self) -> Steps:
        """Back off by as many gaps as it takes until the force is gone.

        Force that is left after a full retract may be a zero that drifted during the approach.
        Once, and within the drift that the limits allow for, the zero is to be taken anew.
        """
        course, limits = self._course, self._course.limits
        gap_m = self._gap_m()
        back_m = max(gap_m, limits.shows_m(course.retract_m)) if self._unshown else gap_m
        self._purpose, self._slow = "again", True
        course.enter(Phase.TOUCH_RETRACT)
        course.aim(course.surface_m - back_m)
        free_n = 0.5 * limits.touch_force_n
        furthest_m = course.surface_m - course.procedure.retract_m
        while True:
            yield
            if not course.rest_at_goal(REST_S):
                continue
            if not abs(course.sup.smooth_n) > free_n:
                self._restart()
                return None
            if course.goal_m > furthest_m:
                course.aim(max(course.goal_m - gap_m, furthest_m))
            elif self._zeroed or not course.may_be_zero:
                return not_open(course, free_n)
            else:
                self._zeroed = True
                return Exit.ZERO

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
        return touch_gap_m(self._course.limits, self._course.procedure.retract_m)
