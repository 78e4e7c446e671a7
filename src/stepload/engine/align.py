"""Alignment check before loading: touches on a circle give the tilt of the plate.

Between them the arm moves across the approach in free air: slowly, clear of every surface seen so
far, stopped by any force.
"""

from __future__ import annotations

import math

from stepload.contact.plane import CIRCLE, Tilt, circle, tilt_of
from stepload.engine.approach import Approach
from stepload.engine.phases import Exit, May, Steps, phase
from stepload.engine.retract import REST_S, not_open
from stepload.engine.run_state import RunState
from stepload.feasibility.aligning import HUMP_SIGMAS, SURE, Aligning
from stepload.record.rows import Phase

Point = tuple[float, float]
Place = tuple[float, float, float]
CENTRE: Point = (0.0, 0.0)
WENT_SHARE = 0.05
"""Share of a shift by which the arm's pose may differ from it."""


class Alignment:
    """Touches in the middle and on a circle, and judges the tilt.

    These touches belong to no cycle. The arm is never turned: where the tilt is too large the run
    ends, and its message says by how much to turn.

    Args:
        course: state of the run.
        approach: finds the surface, as before every loading.
        aligning: radius, limits and speeds.
    """

    def __init__(self, course: RunState, approach: Approach, aligning: Aligning) -> None:
        self._course, self._approach, self._aligning = course, approach, aligning
        self._shifting = Shifting(course, aligning)
        self._points = (CENTRE, *circle(aligning.radius_m))

    def check(self) -> Steps:
        """Touch at every point, come back to the axis, and judge the tilt."""
        course, aligning = self._course, self._aligning
        cycle, course.cycle = course.cycle, 0
        travel_m: list[float] = []
        for point, after in zip(self._points, (*self._points[1:], CENTRE), strict=True):
            early_m = 0.0 if point == CENTRE else aligning.early_m
            if left := (yield from self._approach.beside(early_m)):
                return left
            travel_m.append(course.surface_m)
            if course.stop_requested():
                return Exit.STOP
            if left := (yield from self._shifting.go(min(travel_m), after)):
                return left
            course.surface_m = min(travel_m)
        course.surface_m, course.cycle = travel_m[0], cycle
        return self._judge(travel_m)

    def _judge(self, all_m: list[float]) -> Exit | None:
        course, aligning = self._course, self._aligning
        middle_m, *travel_m = all_m
        tilt = tilt_of(self._points[1:], travel_m, middle_m, aligning.touch_error_m)
        turn = in_base(tilt.about_rad, self._shifting.places)
        course.tell(
            "tilt",
            {"angle_rad": tilt.angle_rad, "sigma_rad": tilt.sigma_rad,
             "limit_rad": aligning.max_tilt_rad, "about_rad": list(tilt.about_rad),
             "turn_rad": list(turn), "hump_m": tilt.hump_m, "hump_sigma_m": tilt.hump_sigma_m,
             "points_m": [list(point) for point in self._points],
             "travel_m": all_m},
        )  # fmt: skip
        hump_limit_m = HUMP_SIGMAS * tilt.hump_sigma_m
        if abs(tilt.hump_m) > hump_limit_m:
            return course.fail(
                "uneven", tilt.hump_m, hump_limit_m, "m",
                f"the middle of the circle is {tilt.hump_m * 1e6:+.3g} um nearer than the plane of"
                " its three touches: the plate is not flat there, or one touch met something else."
                " Clean the plate, or touch on a smaller circle",
            )  # fmt: skip
        if tilt.angle_rad + SURE * tilt.sigma_rad > aligning.max_tilt_rad:
            return course.fail(
                "tilted", tilt.angle_rad + SURE * tilt.sigma_rad, aligning.max_tilt_rad, "rad",
                advice(tilt, turn, aligning.max_tilt_rad),
            )  # fmt: skip
        return None


class Shifting:
    """Backs off, goes to a point, and checks that the arm is there.

    `places` are the TCP's positions in the arm's base at rest, by point, with the travel along the
    approach subtracted.

    Args:
        course: state of the run.
        aligning: clearance, speed, acceleration and force limit.
    """

    def __init__(self, course: RunState, aligning: Aligning) -> None:
        self._course, self._aligning = course, aligning
        self._speed_m_s = 0.0
        self._along: Place | None = None
        self.places: dict[Point, Place] = {}

    @phase(
        Phase.ALIGN, "after a touch that measures the plate", May.BACK_OR_ACROSS,
        Exit.STOP, Exit.FAIL,
    )  # fmt: skip
    def go(self, nearest_m: float, point: Point) -> Steps:
        """Back off to the clearance from `nearest_m`, then go across to `point`."""
        course, aligning, sup = self._course, self._aligning, self._course.sup
        rest_s = REST_S + 4.0 * course.limits.loop_s
        low_m, low = sup.arm.position_m, self._pose()
        course.enter(Phase.ALIGN)
        course.aim(nearest_m - aligning.clear_m)
        while True:
            yield
            if course.stop_requested():
                return Exit.STOP
            if course.rest_at_goal(rest_s):
                break
        free_n = 0.5 * course.limits.touch_force_n + sup.zero_drift_n
        if abs(sup.smooth_n) > free_n:
            return not_open(course, free_n)
        if self._along is None:
            self._along = self._direction(low_m, low)
        self.places.setdefault(course.shift_m, self._place())
        course.tell("shift", {"from_m": list(course.shift_m), "to_m": list(point)})
        self._speed_m_s, arrived_s = 0.0, math.nan
        while not course.now_s - arrived_s >= rest_s:
            yield
            felt_n = math.hypot(sup.force_n, sup.force.across_n)
            limit_n = aligning.felt_n + sup.zero_drift_n
            if felt_n > limit_n:
                return course.fail(
                    "shift_blocked", felt_n, limit_n, "N",
                    f"{felt_n:.3g} N were felt while the arm went sideways"
                    f" {aligning.clear_m * 1e3:.3g} mm away from every surface seen so far: the"
                    " plate is steeper than 5 deg, or something stands in the way. Look at the"
                    " tool and the plate before starting again",
                )  # fmt: skip
            if course.stop_requested():
                return Exit.STOP
            if self._moved(point) and arrived_s != arrived_s:
                arrived_s = course.now_s
        return self._arrived(point)

    def _moved(self, point: Point) -> bool:
        """Move the target one step towards the point; True when it is there."""
        course, aligning, step_s = self._course, self._aligning, self._course.step_s
        (x_m, y_m), (to_x_m, to_y_m) = course.shift_m, point
        left_m = math.hypot(to_x_m - x_m, to_y_m - y_m)
        self._speed_m_s = min(
            aligning.speed_m_s,
            self._speed_m_s + aligning.acceleration_m_s2 * step_s,
            math.sqrt(2.0 * aligning.acceleration_m_s2 * left_m),
        )
        way_m = self._speed_m_s * step_s
        if way_m >= left_m:
            course.shift_m = point
            return True
        part = way_m / left_m
        course.shift_m = (x_m + part * (to_x_m - x_m), y_m + part * (to_y_m - y_m))
        return False

    def _pose(self) -> Place:
        x, y, z, *_ = self._course.sup.arm.pose
        return x, y, z

    def _direction(self, low_m: float, low: Place) -> Place:
        """Direction of the approach in the arm's base, from the way back from the first touch."""
        way_m = self._course.sup.arm.position_m - low_m
        x, y, z = (now - then for now, then in zip(self._pose(), low, strict=True))
        return x / way_m, y / way_m, z / way_m

    def _place(self) -> Place:
        assert self._along is not None
        position_m = self._course.sup.arm.position_m
        x, y, z = (
            at - position_m * part for at, part in zip(self._pose(), self._along, strict=True)
        )
        return x, y, z

    def _arrived(self, point: Point) -> Exit | None:
        """Check by the arm's pose that its distance from every earlier point is as commanded."""
        course, here = self._course, self._place()
        tolerance_m = course.limits.model_tolerance_m
        for other, place in self.places.items():
            requested_m, went_m = math.dist(other, point), math.dist(place, here)
            allowed_m = max(WENT_SHARE * requested_m, tolerance_m)
            if not abs(went_m - requested_m) <= allowed_m:
                return course.fail(
                    "shift", went_m - requested_m, allowed_m, "m",
                    f"the arm was told to go {requested_m * 1e3:.3g} mm sideways, and its pose says"
                    f" {went_m * 1e3:.3g} mm: it does not follow, or another TCP is set",
                )  # fmt: skip
        self.places[point] = here
        return None


def in_base(about_rad: Point, places: dict[Point, Place]) -> Place:
    """A turn about axes 1 and 2 as a rotation vector in the arm's base, from the measured places.

    Args:
        places: TCP positions in the base, keyed by shift; the middle and the points of a circle.
    """
    middle = places[CENTRE]
    points = [point for point in places if point != CENTRE]
    scale = 2.0 / (CIRCLE * math.hypot(*points[0]) ** 2)
    x, y, z = (
        scale
        * sum(
            (about_rad[0] * point[0] + about_rad[1] * point[1]) * (places[point][i] - middle[i])
            for point in points
        )
        for i in range(3)
    )
    return x, y, z


def advice(tilt: Tilt, turn_rad: Place, limit_rad: float) -> str:
    """Text that says how far to turn the tool or the plate, and about which axis."""
    x, y, z = (f"{math.degrees(part):+.2f}" for part in turn_rad)
    return (
        f"the plate is tilted by {math.degrees(tilt.angle_rad):.2f} ±"
        f" {math.degrees(SURE * tilt.sigma_rad):.2f} deg against the approach (allowed"
        f" {math.degrees(limit_rad):.2g} deg). Turn the tool, and the approach with it, by the"
        f" rotation vector ({x}, {y}, {z}) deg in the arm's base, or the plate by its opposite, and"
        " start again"
    )
