"""Away from the surface until the contact is open, and proof that it is."""

from __future__ import annotations

from stepload.engine.phases import Exit, May, Steps, phase
from stepload.engine.run_state import RunState
from stepload.record.rows import Phase

REST_S = 0.2


def not_open(course: RunState, limit_n: float) -> Exit:
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
    return course.fail(
        "not_open", left_n, limit_n, "N",
        "the contact did not open, the force sensor is dead, or its zero has moved: it reads"
        f" {left_n:.3g} N after a retract of {course.procedure.retract_m * 1e3:g} mm{drifted}",
    )  # fmt: skip


@phase(Phase.RETRACT, "after contact", May.BACK, Exit.FAIL)
def retract(course: RunState) -> Steps:
    """Open the contact, rest, and check that the force is gone."""
    course.level_n = 0.0
    course.enter(Phase.RETRACT)
    course.aim(course.release_m)
    yield
    while not course.rest_at_goal(REST_S + 4.0 * course.limits.loop_s):
        yield
    open_n = course.open_n
    return not_open(course, open_n) if abs(course.sup.smooth_n) > open_n else None
