"""The gap between what two force channels have read over their skew."""

from __future__ import annotations

import random
import statistics

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload.engine.cross_check import CrossCheck

PERIOD_S, SKEW_S = 0.002, 0.010


def check() -> CrossCheck:
    return CrossCheck(PERIOD_S, SKEW_S, filter_s=PERIOD_S, noise_n=(0.0, 0.0))


@given(
    force_n=st.lists(st.floats(0.0, 500.0), min_size=20, max_size=60),
    main_late=st.integers(0, 5),
    second_late=st.integers(0, 5),
)
def test_a_delay_within_the_skew_is_no_difference(
    force_n: list[float], main_late: int, second_late: int
) -> None:
    cross = check()
    for at in range(len(force_n)):
        cross.add(force_n[max(0, at - main_late)], force_n[max(0, at - second_late)])
        assert cross.difference_n == 0.0


@pytest.mark.parametrize(("main", "second"), [(1.0, 0.5), (0.5, 1.0), (1.0, 0.0), (0.0, 1.0)])
def test_a_wrong_gain_is_the_difference_once_the_skew_has_passed(
    main: float, second: float
) -> None:
    cross = check()
    for _ in range(20):
        cross.add(main * 100.0, second * 100.0)
    assert cross.difference_n == pytest.approx((second - main) * 100.0)


@pytest.mark.parametrize("noise_n", [(2.0, 0.0), (0.0, 2.0)])
def test_noise_that_is_expected_hides_no_difference_at_rest(noise_n: tuple[float, float]) -> None:
    cross = CrossCheck(PERIOD_S, SKEW_S, filter_s=PERIOD_S, noise_n=noise_n)
    for _ in range(20):
        cross.add(0.0, 10.0)
    assert cross.difference_n == pytest.approx(10.0)


@pytest.mark.parametrize("late_ticks", [6, 8])
def test_a_delay_beyond_the_skew_is_a_difference_while_the_force_moves(late_ticks: int) -> None:
    cross = check()
    for at in range(40):
        cross.add(1.0 * at, 1.0 * max(0, at - late_ticks))
    assert cross.difference_n == pytest.approx(-(late_ticks - 5.0))


def test_a_channel_that_stands_falls_behind_by_all_but_the_skew() -> None:
    cross = check()
    for at in range(100):
        cross.add(0.5 * at, 0.0)
    assert cross.difference_n == pytest.approx(-0.5 * (99 - 5))


def test_a_new_zero_forgets_what_was_read() -> None:
    cross = check()
    cross.add(0.0, 50.0)
    assert cross.difference_n == 50.0
    cross.restart()
    assert cross.difference_n == 0.0
    cross.add(0.0, 0.5)
    assert cross.difference_n == 0.5


def test_noise_hides_no_error() -> None:
    """The range that noise makes is taken out: an error just above a limit is seen as that."""
    chance, cross = random.Random(1), CrossCheck(PERIOD_S, SKEW_S, 0.005, noise_n=(0.3, 1.5))
    found = []
    for _ in range(5000):
        cross.add(100.0 + chance.gauss(0.0, 0.3), 110.0 + chance.gauss(0.0, 1.5))
        found.append(cross.difference_n)
    assert statistics.mean(found[100:]) == pytest.approx(10.0, abs=0.5)


def test_noise_is_no_difference() -> None:
    chance, cross = random.Random(2), CrossCheck(PERIOD_S, SKEW_S, 0.005, noise_n=(0.3, 1.5))
    found = []
    for _ in range(5000):
        cross.add(chance.gauss(0.0, 0.3), chance.gauss(0.0, 1.5))
        found.append(abs(cross.difference_n))
    assert statistics.mean(found) < 0.5
    assert max(found) < 4.0


@given(force_n=st.lists(st.floats(-500.0, 500.0), min_size=20, max_size=60))
def test_the_difference_is_the_gap_between_the_last_readings(force_n: list[float]) -> None:
    """Extremes that leave the range are forgotten, whichever way the force goes."""
    cross, ticks = check(), 6
    for at, reading_n in enumerate(force_n):
        cross.add(reading_n, 0.0)
        last_n = ([force_n[0]] * ticks + force_n[: at + 1])[-ticks:]
        expected_n = max(0.0, -max(last_n)) - max(0.0, min(last_n))
        assert cross.difference_n == pytest.approx(expected_n)
