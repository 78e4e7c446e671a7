"""Alignment check before loading: touches on a circle give the tilt of the plate."""

from __future__ import annotations

import math

from stepload.contact.plane import CIRCLE, Tilt, circle, tilt_of
from stepload.engine.approach import Approach
from stepload.engine.course import Course, Then
from stepload.engine.shifting import Place, Point, Shifting
from stepload.envelope.aligning import HUMP_SIGMAS, SURE, Aligning

CENTRE: Point = (0.0, 0.0)


class Alignment:
    """Touches in the middle and on a circle, and judges the tilt.

    These touches belong to no cycle. The arm is never turned: where the tilt is too large the run
    ends, and its message says by how much to turn.

    Args:
        course: state of the run.
        approach: finds the surface, as before every loading.
        aligning: radius, limits and speeds.
        stopped: what to do when the operator stops the run here.
    """

    def __init__(
        self, course: Course, approach: Approach, aligning: Aligning, stopped: Then
    ) -> None:
        self._course, self._approach, self._aligning = course, approach, aligning
        self._shifting = Shifting(course, aligning, stopped)
        self._stopped = stopped
        self._then = stopped
        self._cycle = course.cycle
        self._points = (CENTRE, *circle(aligning.radius_m))
        self._travel_m: list[float] = []

    def begin(self, now_s: float, then: Then) -> None:
        """Touch, judge the tilt, and call `then` on the axis."""
        self._then = then
        self._cycle, self._course.cycle = self._course.cycle, 0
        self._approach.beside(now_s, 0.0, self._touched)

    def _touched(self, now_s: float) -> None:
        course = self._course
        self._travel_m.append(course.surface_m)
        if course.stop_asked():
            self._stopped(now_s)
            return
        done = len(self._travel_m)
        back = done == len(self._points)
        point = CENTRE if back else self._points[done]
        self._shifting.go(now_s, min(self._travel_m), point, self._judge if back else self._down)

    def _down(self, now_s: float) -> None:
        self._course.surface_m = min(self._travel_m)
        self._approach.beside(now_s, self._aligning.early_m, self._touched)

    def _judge(self, now_s: float) -> None:
        course, aligning = self._course, self._aligning
        middle_m, *travel_m = self._travel_m
        course.surface_m, course.cycle = middle_m, self._cycle
        tilt = tilt_of(self._points[1:], travel_m, middle_m, aligning.touch_error_m)
        turn = in_base(tilt.about_rad, self._shifting.places)
        course.emit(
            now_s,
            "tilt",
            {"angle_rad": tilt.angle_rad, "sigma_rad": tilt.sigma_rad,
             "limit_rad": aligning.max_tilt_rad, "about_rad": list(tilt.about_rad),
             "turn_rad": list(turn), "hump_m": tilt.hump_m, "hump_sigma_m": tilt.hump_sigma_m,
             "points_m": [list(point) for point in self._points],
             "travel_m": list(self._travel_m)},
        )  # fmt: skip
        hump_limit_m = HUMP_SIGMAS * tilt.hump_sigma_m
        if abs(tilt.hump_m) > hump_limit_m:
            course.fail(
                "uneven", tilt.hump_m, hump_limit_m, "m",
                f"the middle of the circle is {tilt.hump_m * 1e6:+.3g} um nearer than the plane of"
                " its three touches: the plate is not flat there, or one touch met something else."
                " Clean the plate, or touch on a smaller circle",
            )  # fmt: skip
        elif tilt.angle_rad + SURE * tilt.sigma_rad > aligning.max_tilt_rad:
            course.fail(
                "tilted", tilt.angle_rad + SURE * tilt.sigma_rad, aligning.max_tilt_rad, "rad",
                advice(tilt, turn, aligning.max_tilt_rad),
            )  # fmt: skip
        else:
            self._then(now_s)


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
