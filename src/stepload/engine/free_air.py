"""Proof, before a zero is taken, that nothing touches.

A tare in contact would subtract that contact's force from every later reading, and nothing could
detect it any more. So the arm backs off, within the free way that the plan states until its
direction is proven: force that changes with it was contact.
"""

from __future__ import annotations

import math
from dataclasses import asdict

from stepload.engine.course import Course, Then
from stepload.engine.retract import REST_S
from stepload.engine.tare import TareWindow
from stepload.record.outcome import Tare
from stepload.record.rows import Phase

LOOK_S = 0.2
"""Duration of each measurement, before and after backing off: ten periods of 50 Hz mains."""
FREE_SIGMAS = 6.0
ALLOWED_SHARE = 0.5
"""Share of the allowed drift and cross-check tolerance below which a change counts as none, since
sensors are not ideal at rest; more where backing off takes longer than that share of a tare."""


class FreeAir:
    """Reads both force channels, backs off by the plan's retract, and reads them again.

    Args:
        course: state of the run.
        stopped: what to do when the operator stops the run here.
    """

    def __init__(self, course: Course, stopped: Then) -> None:
        self._course = course
        self._stopped = stopped
        self._then = stopped
        self._touching: Then | None = None
        self._window = TareWindow()
        self._before: Tare | None = None
        self._back_m, self._share = 0.0, ALLOWED_SHARE

    def prove(self, now_s: float, then: Then, touching: Then | None = None) -> None:
        """Back off; call `then` if nothing touched, else `touching`; without that end the run.

        With `touching`, in an approach, a smaller change already counts as contact: a payload much
        softer than planned is still compressed after the retract.
        """
        self._then, self._touching = then, touching
        self._window = TareWindow()
        self._course.enter(Phase.FREE_AIR, now_s, self._look)

    def _look(self, now_s: float, _step_s: float) -> None:
        course = self._course
        if course.stop_asked():
            self._stopped(now_s)
        elif (look := self._window.offer(now_s, course.sup, LOOK_S)) is not None:
            self._before = look
            course.aim(max(course.target_m - course.retract_m, course.back_end_m))
            self._back_m = course.target_m - course.goal_m
            course.act = self._back_off

    def _back_off(self, now_s: float, step_s: float) -> None:
        course = self._course
        if course.rest_at_goal(now_s, step_s, REST_S + 4.0 * course.limits.loop_s):
            self._window = TareWindow()
            course.act = self._look_again

    def _look_again(self, now_s: float, _step_s: float) -> None:
        course, limits, before = self._course, self._course.limits, self._before
        after = self._window.offer(now_s, course.sup, LOOK_S)
        if after is None or before is None:
            return
        change_n = after.mean_n - before.mean_n
        second_n = after.second_mean_n - before.second_mean_n
        course.emit(
            now_s,
            "free_air",
            {"backed_off_m": self._back_m, "change_n": change_n,
             "second_change_n": second_n, "before": asdict(before), "after": asdict(after)},
        )  # fmt: skip
        apart_s = after.time_s - before.time_s
        self._share = ALLOWED_SHARE
        if self._touching is None:
            self._share = max(ALLOWED_SHARE, min(1.0, apart_s / course.plan.tare_s))
        error_n = math.hypot(after.mean_error_n, before.mean_error_n)
        second_error_n = math.hypot(after.second_mean_error_n, before.second_mean_error_n)
        # `max_drift` leaves room for a whole cycle. Between two looks a touch is contact.
        drift_n = min(course.plan.max_drift_n, limits.touch_force_n / self._share)
        tolerance_n = limits.cross_tolerance_n
        if self._touching is not None:
            drift_n = tolerance_n = limits.moved_zero_n
        free = self._unchanged("force", change_n, error_n, drift_n)
        if free and limits.cross_check:
            free = self._unchanged("second force channel", second_n, second_error_n, tolerance_n)
        if free:
            self._then(now_s)
        elif self._touching is not None:
            self._touching(now_s)

    def _unchanged(self, name: str, change_n: float, error_n: float, allowed_n: float) -> bool:
        limit_n = max(FREE_SIGMAS * error_n, self._share * allowed_n)
        if abs(change_n) <= limit_n:
            return True
        if self._touching is not None:
            return False
        if change_n > 0.0 and not self._course.proven:
            self._course.fail(*self._course.guard.turn(change_n, limit_n))
            return False
        self._course.fail(
            "not_free", change_n, limit_n, "N",
            f"the {name} changed by {change_n:+.3g} N when the arm backed off by"
            f" {self._back_m * 1e3:.3g} mm: it was in contact, and a zero taken there"
            " would be wrong. Move the start pose away from the surface, see that nothing drags on"
            " the tool, and start again",
        )  # fmt: skip
        return False
