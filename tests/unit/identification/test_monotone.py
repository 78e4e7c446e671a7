"""The rising curve is scipy's PCHIP, digit for digit, and never falls."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from stepload.identification.deflection import rising_curve

steps = st.lists(st.tuples(st.floats(1e-6, 1e3), st.floats(1e-9, 1e3)), min_size=1, max_size=12)


@given(steps, st.lists(st.floats(-2.0, 3.0), min_size=1, max_size=30))
def test_it_is_scipys(pieces: list[tuple[float, float]], shares: list[float]) -> None:
    x, y = (np.cumsum([0.0, *column]) for column in zip(*pieces, strict=True))
    assume((np.diff(x) > 0.0).all() and (np.diff(y) > 0.0).all())
    at = np.concatenate([np.array(shares) * x[-1], x])
    np.testing.assert_array_equal(rising_curve(x, y)(at), PchipInterpolator(x, y)(at))


def test_it_goes_through_the_points_and_never_falls() -> None:
    x, y = np.array([0.0, 1.0, 1.5, 4.0, 9.0]), np.array([0.0, 5.0, 5.1, 5.2, 40.0])
    curve = rising_curve(x, y)
    assert curve(x) == pytest.approx(y, rel=1e-12)
    assert (np.diff(curve(np.linspace(0.0, 9.0, 2000))) >= 0.0).all()


def test_where_the_parabola_would_fall_the_end_is_level() -> None:
    x, y = np.array([0.0, 1.0, 2.0]), np.array([0.0, 0.1, 10.0])
    assert rising_curve(x, y)(np.array([1e-9]))[0] == pytest.approx(0.0, abs=1e-15)
