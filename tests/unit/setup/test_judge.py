"""Limits of a push, from either side."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stepload.errors import RefusedError
from stepload.setup.judge import (
    Channel,
    agreed,
    judged,
    off_the_tool_rad,
    turned_rad,
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


def test_the_approach_away_from_the_plate_is_half_a_circle_off():
    assert off_the_tool_rad(DOWN, (0.0, 0.0, -1.0)) == pytest.approx(0.0, abs=1e-7)
    assert off_the_tool_rad(DOWN, (0.0, 0.0, 1.0)) == pytest.approx(math.pi)


def test_a_rotation_is_told_whichever_way_it_is_written():
    other = (0.0, 0.0, 0.0, 0.0, 1e-3 - math.pi, 0.0)
    assert turned_rad(DOWN, other) == pytest.approx(1e-3, rel=1e-3)
    assert turned_rad(DOWN, at(0.1)) == pytest.approx(0.1)
    assert math.isnan(turned_rad(DOWN, (0.0,) * 3 + (math.nan,) * 3))
