"""Tilt of a plate, with its uncertainty, from touches on a circle about the axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

Point = tuple[float, float]
CIRCLE = 3


@dataclass(frozen=True, slots=True)
class Tilt:
    """Orientation of a plate under a tool.

    Attributes:
        about_rad: rotation about axes 1 and 2 that would make the tool perpendicular to the plate.
        angle_rad: size of that rotation.
        sigma_rad: standard uncertainty of each of the two.
        hump_m: height of the plate's middle above the plane through the circle, towards the tool.
        hump_sigma_m: standard uncertainty of that.
    """

    about_rad: tuple[float, float]
    angle_rad: float
    sigma_rad: float
    hump_m: float
    hump_sigma_m: float


def circle(radius_m: float) -> tuple[Point, ...]:
    """Three points on a circle, 120 degrees apart."""
    angles = (0.5 * math.pi + 2.0 * math.pi * index / CIRCLE for index in range(CIRCLE))
    return tuple((radius_m * math.cos(a), radius_m * math.sin(a)) for a in angles)


def tilt_error_rad(radius_m: float, touch_error_m: float) -> float:
    """Standard uncertainty of either angle, with independent errors of the three touches."""
    return touch_error_m * math.sqrt(2.0 / CIRCLE) / radius_m


def tilt_of(
    points_m: Sequence[Point], travel_m: Sequence[float], middle_m: float, touch_error_m: float
) -> Tilt:
    """The tilt that follows from touches on a circle about the axis.

    Args:
        points_m: positions of the three touches across the approach, along axes 1 and 2.
        travel_m: (3,) travel along the approach at each touch.
        middle_m: the same on the axis itself.
        touch_error_m: standard uncertainty of one touch.
    """
    radius_m = math.hypot(*points_m[0])
    scale = 2.0 / (CIRCLE * radius_m * radius_m)
    slope_1 = scale * sum(z * x for (x, _), z in zip(points_m, travel_m, strict=True))
    slope_2 = scale * sum(z * y for (_, y), z in zip(points_m, travel_m, strict=True))
    slope = math.hypot(slope_1, slope_2)
    angle = math.atan(slope)
    part = angle / slope if slope > 0.0 else 1.0
    return Tilt(
        about_rad=(slope_2 * part, -slope_1 * part),
        angle_rad=angle,
        sigma_rad=tilt_error_rad(radius_m, touch_error_m),
        hump_m=sum(travel_m) / CIRCLE - middle_m,
        hump_sigma_m=touch_error_m * math.sqrt(1.0 + 1.0 / CIRCLE),
    )
