"""When samples of an approach make a touch, and when it waits for more of them."""

from __future__ import annotations

import pytest

from stepload.engine.force_state import BOUNCE_S, SURE, TouchTest

TOUCH_N, PERIOD_S = 2.0, 0.002


def judged(*forces_n: float, period_s: float = PERIOD_S) -> TouchTest:
    test = TouchTest(TOUCH_N)
    for index, force_n in enumerate(forces_n):
        test.add(index * period_s, force_n)
    return test


@pytest.mark.parametrize("forces_n", [(2.1, 2.1), (0.0, 2.01, 9.0), (3.1, 0.0, 3.1)])
def test_two_in_a_row_or_two_hits_make_a_touch(forces_n: tuple[float, ...]) -> None:
    assert judged(*forces_n).touched


@pytest.mark.parametrize(
    "forces_n", [(), (9.0,), (2.1, 0.0, 2.1), (9.0, 0.0, 2.1), (2.0, 2.0), (-9.0, -9.0)]
)
def test_one_sample_or_weak_ones_apart_make_none(forces_n: tuple[float, ...]) -> None:
    assert not judged(*forces_n).touched


@pytest.mark.parametrize(("share", "touched"), [(0.99, True), (1.01, False)])
def test_a_hit_is_waited_for_as_long_as_a_bounce_may_last(share: float, touched: bool) -> None:
    hit_n = 1.01 * SURE * TOUCH_N
    assert judged(hit_n, hit_n, period_s=share * BOUNCE_S).touched  # in a row, however slow
    test = TouchTest(TOUCH_N)
    test.add(0.0, hit_n)
    test.add(0.5 * share * BOUNCE_S, 0.0)
    test.add(share * BOUNCE_S, hit_n)
    assert test.touched is touched


def test_the_approach_waits_after_a_hit_and_not_for_noise_about_the_touch_force() -> None:
    test = TouchTest(TOUCH_N)
    assert not test.waits(0.0)
    test.add(0.0, 0.99 * SURE * TOUCH_N)
    assert not test.waits(0.0)
    test.add(1.0, 1.01 * SURE * TOUCH_N)
    assert test.waits(1.0)
    assert test.waits(1.0 + 0.99 * BOUNCE_S)
    assert not test.waits(1.0 + 1.01 * BOUNCE_S)
