"""Moves across the approach in free air: slowly, clear of every surface, stopped by any force."""

from __future__ import annotations

import math

from stepload.engine.course import Course, Then
from stepload.engine.retract import REST_S, not_open
from stepload.envelope.aligning import Aligning
from stepload.record.rows import Phase

Point = tuple[float, float]
Place = tuple[float, float, float]
WENT_SHARE = 0.05
"""Share of a shift by which the arm's pose may differ from it."""


class Shifting:
    """Backs off, goes to a point, and checks that the arm is there.

    `places` are the TCP's positions in the arm's base at rest, by point, with the travel along the
    approach subtracted.

    Args:
        course: state of the run.
        aligning: clearance, speed, acceleration and force limit.
        stopped: what to do when the operator stops the run here.
    """

    def __init__(self, course: Course, aligning: Aligning, stopped: Then) -> None:
        self._course, self._aligning = course, aligning
        self._stopped = stopped
        self._then = stopped
        self._point: Point = (0.0, 0.0)
        self._speed_m_s = 0.0
        self._arrived_s = math.nan
        self._low_m = math.nan
        self._low: Place = (0.0, 0.0, 0.0)
        self._along: Place | None = None
        self.places: dict[Point, Place] = {}

    def go(self, now_s: float, nearest_m: float, point: Point, then: Then) -> None:
        """Back off to the clearance from `nearest_m`, go to `point`, then call `then`."""
        course = self._course
        self._point, self._then = point, then
        self._low_m, self._low = course.sup.arm.position_m, self._pose()
        course.enter(Phase.ALIGN, now_s, self._back_off)
        course.aim(nearest_m - self._aligning.clear_m)

    def _back_off(self, now_s: float, step_s: float) -> None:
        course = self._course
        if course.stop_asked():
            self._stopped(now_s)
            return
        if not course.rest_at_goal(now_s, step_s, REST_S + 4.0 * course.limits.loop_s):
            return
        if abs(course.sup.smooth_n) > 0.5 * course.limits.touch_force_n:
            not_open(course, 0.5 * course.limits.touch_force_n)
            return
        if self._along is None:
            self._along = self._direction()
        self.places.setdefault(course.shift_m, self._place())
        self._speed_m_s, self._arrived_s = 0.0, math.nan
        course.emit(now_s, "shift", {"from_m": list(course.shift_m), "to_m": list(self._point)})
        course.act = self._across

    def _across(self, now_s: float, step_s: float) -> None:
        course, aligning, sup = self._course, self._aligning, self._course.sup
        felt_n = math.hypot(sup.force_n, sup.force.across_n)
        if felt_n > aligning.felt_n:
            course.fail(
                "shift_blocked", felt_n, aligning.felt_n, "N",
                f"{felt_n:.3g} N were felt while the arm went sideways"
                f" {aligning.clear_m * 1e3:.3g} mm away from every surface seen so far: the plate"
                " is steeper than 5 deg, or something stands in the way. Look at the tool and the"
                " plate before starting again",
            )  # fmt: skip
        elif course.stop_asked():
            self._stopped(now_s)
        elif self._moved(step_s):
            if self._arrived_s != self._arrived_s:
                self._arrived_s = now_s
            if now_s - self._arrived_s >= REST_S + 4.0 * course.limits.loop_s:
                self._look(now_s)

    def _moved(self, step_s: float) -> bool:
        """Move the target one step towards the point; True when it is there."""
        course, aligning = self._course, self._aligning
        (x_m, y_m), (to_x_m, to_y_m) = course.shift_m, self._point
        left_m = math.hypot(to_x_m - x_m, to_y_m - y_m)
        self._speed_m_s = min(
            aligning.speed_m_s,
            self._speed_m_s + aligning.acceleration_m_s2 * step_s,
            math.sqrt(2.0 * aligning.acceleration_m_s2 * left_m),
        )
        way_m = self._speed_m_s * step_s
        if way_m >= left_m:
            course.shift_m = self._point
            return True
        part = way_m / left_m
        course.shift_m = (x_m + part * (to_x_m - x_m), y_m + part * (to_y_m - y_m))
        return False

    def _pose(self) -> Place:
        x, y, z, *_ = self._course.sup.arm.pose
        return x, y, z

    def _direction(self) -> Place:
        """Direction of the approach in the arm's base, from the way back from the first touch."""
        way_m = self._course.sup.arm.position_m - self._low_m
        x, y, z = (now - low for now, low in zip(self._pose(), self._low, strict=True))
        return x / way_m, y / way_m, z / way_m

    def _place(self) -> Place:
        assert self._along is not None
        position_m = self._course.sup.arm.position_m
        x, y, z = (
            at - position_m * part for at, part in zip(self._pose(), self._along, strict=True)
        )
        return x, y, z

    def _look(self, now_s: float) -> None:
        """Check by the arm's pose that its distance from every earlier point is as commanded."""
        course, here = self._course, self._place()
        tolerance_m = course.limits.model_tolerance_m
        for point, place in self.places.items():
            asked_m, went_m = math.dist(point, self._point), math.dist(place, here)
            allowed_m = max(WENT_SHARE * asked_m, tolerance_m)
            if not abs(went_m - asked_m) <= allowed_m:
                course.fail(
                    "shift", went_m - asked_m, allowed_m, "m",
                    f"the arm was told to go {asked_m * 1e3:.3g} mm sideways, and its pose says"
                    f" {went_m * 1e3:.3g} mm: it does not follow, or another TCP is set",
                )  # fmt: skip
                return
        self.places[self._point] = here
        self._then(now_s)
