"""Away from the surface until the contact is open, and proof that it is."""

from __future__ import annotations

from stepload.engine.course import Course, Then
from stepload.record.rows import Phase

REST_S = 0.2


def not_open(course: Course, limit_n: float) -> None:
    """End the run because force is left where there should be none."""
    left_n, second_n = course.sup.smooth_n, course.sup.second_n
    drifted = ""
    if course.limits.cross_check and abs(second_n) < 0.5 * abs(left_n):
        drifted = (
            f"; the second channel reads {second_n:.3g} N, so it may be open and the force sensor's"
            " zero may have moved since the tare"
        )
    elif left_n < -limit_n:
        whose = (
            "both channels' zeros were" if course.limits.cross_check else "the sensor's zero was"
        )
        drifted = (
            f"; unless the contact sticks, {whose} taken in contact or moved since the tare, and"
            f" the force may have been about {-left_n:.3g} N more than it read"
        )
    course.fail(
        "not_open", left_n, limit_n, "N",
        "the contact did not open, the force sensor is dead, or its zero has moved: it reads"
        f" {left_n:.3g} N after a retract of {course.plan.retract_m * 1e3:g} mm{drifted}",
    )  # fmt: skip


class Retract:
    """Opens the contact, rests, and checks that the force is gone."""

    def __init__(self, course: Course) -> None:
        self._course = course
        self._then: Then = course.finish

    def begin(self, now_s: float, then: Then) -> None:
        """Retract, then call `then`."""
        course = self._course
        self._then = then
        course.level_n = 0.0
        course.enter(Phase.RETRACT, now_s, self._act)
        course.aim(course.release_m)

    def _act(self, now_s: float, step_s: float) -> None:
        course = self._course
        if not course.rest_at_goal(now_s, step_s, REST_S + 4.0 * course.limits.loop_s):
            return
        open_n = course.open_n(now_s)
        if abs(course.sup.smooth_n) > open_n:
            not_open(course, open_n)
        else:
            self._then(now_s)
