"""Limits of a push and of a weight, from either side."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stepload.errors import RefusedError
from stepload.setup.judge import (
    GRAVITY_M_S2,
    Channel,
    agreed,
    judged,
    off_the_tool_rad,
    turned_rad,
    weighed,
)

QUIET = Channel("the sensor", np.zeros(3), np.full(3, 0.01))
DOWN = (0.0, 0.0, 0.0, 0.0, math.pi, 0.0)


def at(angle_rad):
    """A tool that is led so far from pointing down."""
    return (0.0, 0.0, 0.0, 0.0, math.pi - angle_rad, 0.0)


def along(force_n, across=0.0):
    return np.array([across * force_n, 0.0, force_n])


def test_a_weak_push_tells_no_sign():
    assert judged(QUIET, [along(-11.0)] * 2).axis == "-fz"
    with pytest.raises(RefusedError, match=r"read 9\.0 N of a push"):
        judged(QUIET, [along(-9.0)] * 2)


def test_a_push_stands_out_of_the_noise():
    noisy = Channel("the sensor", np.zeros(3), np.array([0.1, 2.0, 0.1]))
    assert judged(noisy, [along(25.0)] * 2).axis == "+fz"
    with pytest.raises(RefusedError, match=r"at least 24\.0 N are needed"):
        judged(noisy, [along(23.0)] * 2)


def test_a_push_lies_along_one_axis():
    assert judged(QUIET, [along(30.0, across=0.45)] * 2).cross_talk == pytest.approx(0.45)
    with pytest.raises(RefusedError, match="which one is the axis is not clear"):
        judged(QUIET, [along(30.0, across=0.55)] * 2)


def test_two_channels_read_the_same_of_one_push():
    agreed(("one", 30.0), ("other", 22.0), 0.0)
    agreed(("one", 30.0), ("other", 18.0), 5.0)
    with pytest.raises(RefusedError, match="of the same push, which differ"):
        agreed(("one", 30.0), ("other", 20.0), 0.0)


def felt(mass_kg, angle_rad, axis_share=1.0):
    """Weight in the tool's frame; the sensor shows `axis_share` of what is along the tool."""
    weight_n = mass_kg * GRAVITY_M_S2
    along_n = axis_share * weight_n * math.cos(angle_rad)
    return np.array([weight_n * math.sin(angle_rad), 0.0, along_n])


def test_poses_differ_enough_to_weigh_a_tool():
    def weigh(angle_rad):
        poses = DOWN, at(angle_rad)
        return weighed(poses, (felt(1.0, 0.0), felt(1.0, angle_rad)), 1e-3, "-fz")

    found = weigh(math.radians(65.0))
    assert found is not None
    assert found.mass_kg == pytest.approx(1.0)
    with pytest.raises(RefusedError, match="nearly alike in both poses"):
        weigh(math.radians(55.0))


def test_the_weight_along_the_axis_is_that_of_the_whole_vector():
    poses = DOWN, at(math.pi / 2)
    with pytest.raises(RefusedError, match="does not fit the axis"):
        weighed(poses, (felt(1.0, 0.0, 0.5), felt(1.0, math.pi / 2, 0.5)), 1e-3, "-fz")


def test_the_approach_away_from_the_plate_is_half_a_circle_off():
    assert off_the_tool_rad(DOWN, (0.0, 0.0, -1.0)) == pytest.approx(0.0, abs=1e-7)
    assert off_the_tool_rad(DOWN, (0.0, 0.0, 1.0)) == pytest.approx(math.pi)


def test_a_rotation_is_told_whichever_way_it_is_written():
    other = (0.0, 0.0, 0.0, 0.0, 1e-3 - math.pi, 0.0)
    assert turned_rad(DOWN, other) == pytest.approx(1e-3, rel=1e-3)
    assert turned_rad(DOWN, at(0.1)) == pytest.approx(0.1)
    assert math.isnan(turned_rad(DOWN, (0.0,) * 3 + (math.nan,) * 3))
