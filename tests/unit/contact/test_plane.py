"""The plane through three touches about an axis."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stepload.contact.plane import circle, tilt_error_rad, tilt_of


def touched(about_1: float, about_2: float, radius_m: float = 0.01) -> list[float]:
    """Travel to a plate turned about axes 1 and 2, 3 mm away."""
    angle = math.hypot(about_1, about_2)
    normal = np.array([about_2 / angle, -about_1 / angle]) * math.tan(angle) if angle else (0, 0)
    # The plate's points satisfy n·r = const with n the turned axis 3: z = 3 mm - (n1 x + n2 y)/n3.
    return [3e-3 - normal[0] * x - normal[1] * y for x, y in circle(radius_m)]


@pytest.mark.parametrize("about", [(0.0, 0.0), (0.02, 0.0), (0.0, -0.03), (0.02, 0.01)])
def test_the_turn_of_the_plate_is_the_turn_of_the_tool(about: tuple[float, float]) -> None:
    tilt = tilt_of(circle(0.01), touched(*about), 3e-3, 20e-6)
    assert tilt.about_rad == pytest.approx(about, abs=1e-9)
    assert tilt.angle_rad == pytest.approx(math.hypot(*about), abs=1e-9)
    assert tilt.hump_m == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("error_m", "deg"), [(20e-6, 0.094), (50e-6, 0.234)])
def test_the_uncertainty_is_that_of_the_touches(error_m: float, deg: float) -> None:
    assert math.degrees(tilt_error_rad(0.01, error_m)) == pytest.approx(deg, abs=1e-3)
    rng = np.random.default_rng(1)
    found = [
        tilt_of(circle(0.01), rng.normal(3e-3, error_m, 3), rng.normal(3e-3, error_m), error_m)
        for _ in range(4000)
    ]
    assert np.std([t.about_rad for t in found], axis=0) == pytest.approx(
        [found[0].sigma_rad] * 2, rel=0.05
    )
    assert np.std([t.hump_m for t in found]) == pytest.approx(found[0].hump_sigma_m, rel=0.05)
