"""R7 and R8 at their edges, with samples made by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from rule_feed import PERIOD_S, PLANNED, Feed, arm_sample, force_sample

from stepload.engine.motion import PROGRESS_S, PROGRESS_SHARE, REST_S, SPEED_MEMORY_S, STILL_SHARE
from stepload.engine.supervisor import Supervisor
from stepload.record.rows import Phase

TOLERANCE_M, STILL_M = PLANNED.model_tolerance_m, PLANNED.still_m
CALM = {"jump_n": 1e9, "cross_tolerance_n": 1e9, "force_limit_n": 1e9}
SEARCH = (Phase.FAST_APPROACH, Phase.GUARDED_APPROACH)
DELAY = round(PLANNED.command_delay_s / PERIOD_S)
SHARE = PERIOD_S / (PLANNED.arm_lag_s + PERIOD_S)


@pytest.mark.parametrize("phase", [Phase.HOLD, *SEARCH])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_r7_a_position_off_the_model_at_rest(sign: float, phase: Phase) -> None:
    for share, found in ((0.99, False), (1.01, True)):
        feed = Feed()
        cause = feed.tick(position_m=sign * share * TOLERANCE_M, phase=phase)
        assert (cause is not None) == found
        if cause is not None:
            assert (cause.rule, cause.limit, cause.unit) == ("R7", TOLERANCE_M, "m")
            assert cause.value == pytest.approx(sign * share * TOLERANCE_M)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_r7_motion_widens_the_tolerance_and_is_forgotten(sign: float) -> None:
    feed, speed = Feed(**CALM, still_m=1.0), 0.01
    feed.moving(3, sign * speed)
    lag_m = PLANNED.model_lag_s * speed
    feed.tick(position_m=feed.target_m + 0.9 * (TOLERANCE_M + 0.9 * lag_m))
    assert feed.supervisor.cause is None
    feed.ticks(round(SPEED_MEMORY_S / PERIOD_S) - 1)
    cause = feed.tick(position_m=feed.target_m + 1.0)
    assert cause is not None
    expected_m = TOLERANCE_M + lag_m * math.exp(-(SPEED_MEMORY_S + PERIOD_S) / SPEED_MEMORY_S)
    assert cause.limit == pytest.approx(expected_m, rel=1e-3)


def test_r7_the_model_has_the_arms_delay_and_lag() -> None:
    """What is left of a step of the target after a while is told by the error at rest."""
    for ticks in (DELAY, DELAY + 1, DELAY + 2, DELAY + 10):
        feed = Feed(**CALM, model_lag_s=1e-9, model_tolerance_m=1e-9, still_m=1.0)
        feed.target_m = 1e-3
        gone = max(0, ticks - DELAY)
        feed.supervisor.cause = None
        for _ in range(ticks - 1):
            feed.tick()
            feed.supervisor.cause = None
        cause = feed.tick(position_m=0.0)
        model_m = 1e-3 * (1.0 - (1.0 - SHARE) ** gone)
        assert (cause is None) == (gone == 0)
        assert cause is None or cause.value == pytest.approx(-model_m)


def test_r7_a_late_tick_moves_the_model_by_the_periods_that_passed() -> None:
    feeds = [Feed(**CALM, model_lag_s=1e-9, model_tolerance_m=1e-9, still_m=1.0) for _ in range(2)]
    values = []
    for feed, skips in zip(feeds, ((0, 0, 0, 0, 0, 0), (0, 0, 3)), strict=True):
        feed.target_m = 1e-3
        for skip in skips:
            feed.supervisor.cause = None
            feed.tick(position_m=0.0, skip=skip)
        assert feed.supervisor.cause is not None
        values.append(feed.supervisor.cause.value)
    assert values[0] == pytest.approx(values[1])


def test_the_speed_of_a_late_tick_is_over_the_time_that_passed() -> None:
    feed = Feed()
    feed.tick(target_m=1e-6)
    assert feed.supervisor.motion.speed_m_s == pytest.approx(1e-3)
    feed.tick(target_m=5e-6, skip=3)
    assert feed.supervisor.motion.speed_m_s == pytest.approx(1e-3)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("seen", "found"), [(1.1, False), (0.9, True), (0.0, True), (-2.0, True)])
def test_r7_an_arm_must_be_seen_to_go_a_quarter_of_its_way(
    sign: float, seen: float, found: bool
) -> None:
    """Slowly, so that no error is large enough for its tolerance."""
    feed, speed = Feed(**CALM), 1e-4
    part = seen * STILL_SHARE
    for _ in range(round(0.9 * TOLERANCE_M / (1.0 + abs(part)) / (speed * PERIOD_S))):
        target_m = feed.target_m + sign * speed * PERIOD_S
        feed.tick(target_m=target_m, position_m=part * target_m)
    cause = feed.supervisor.cause
    assert (cause is not None) == found
    if cause is not None:
        assert cause.rule == "R7"
        assert "does not follow" in cause.message
        blur_m = PLANNED.model_lag_s * speed
        told_m = cause.limit / STILL_SHARE
        assert STILL_M + blur_m < abs(told_m) < STILL_M + blur_m + 2.0 * speed * PERIOD_S
        assert math.copysign(1.0, told_m) == sign


def test_r7_less_travel_than_the_blur_asks_for_no_answer() -> None:
    feed = Feed(**CALM)
    feed.moving(400, 0.9 * STILL_M / 0.4, position_m=0.0)
    feed.ticks(500, position_m=0.0)
    assert feed.supervisor.cause is None


def test_r7_after_fast_motion_it_looks_anew_from_rest() -> None:
    feed = Feed(**CALM)
    feed.moving(150, 0.02)
    assert feed.supervisor.motion._still_blur_m > STILL_M
    feed.ticks(round(REST_S / PERIOD_S) - 1)
    assert feed.supervisor.motion._still_blur_m > STILL_M
    feed.ticks(2, position_m=feed.target_m + 1e-6)
    assert feed.supervisor.motion._still_blur_m == 0.0
    assert feed.supervisor.motion._still_m == pytest.approx(feed.target_m + 1e-6)


@pytest.mark.parametrize("phase", SEARCH)
def test_r8_ends_the_search_at_its_end(phase: Phase) -> None:
    end_m = PLANNED.search_end_m
    for offset_m, found in ((0.0, False), (1e-9, True)):
        feed = Feed(model_tolerance_m=1.0, still_m=1.0)
        cause = feed.tick(position_m=end_m + offset_m, phase=phase)
        assert (cause is not None) == found
        assert cause is None or cause[:4] == ("R8", end_m + offset_m, end_m, "m")


def test_r8_is_one_of_the_search_only() -> None:
    for phase in set(Phase) - set(SEARCH):
        feed = Feed(model_tolerance_m=1.0, still_m=1.0)
        assert feed.tick(position_m=2.0 * PLANNED.search_end_m, phase=phase) is None


@pytest.mark.parametrize("phase", SEARCH)
def test_r7_an_approach_that_gets_nowhere_ends_after_its_time(phase: Phase) -> None:
    feed = Feed()
    passed_s = feed.until("R7", 5.0, phase=phase)
    assert passed_s == pytest.approx(PROGRESS_S, abs=3.0 * PERIOD_S)
    cause = feed.supervisor.cause
    assert cause is not None
    assert "no progress" in cause.message
    assert (cause.limit, cause.unit) == (PROGRESS_S, "s")


def test_r7_progress_is_a_step_that_positions_can_show() -> None:
    least_m = max(3.0 * PLANNED.position_resolution_m, 5e-6)
    for share, found in ((0.9, True), (1.1, False)):
        feed = Feed(model_tolerance_m=1.0, still_m=1.0)
        feed.moving(4000, share * least_m / PROGRESS_S, phase=SEARCH[1])
        assert (feed.supervisor.cause is not None) == found


def test_r7_an_approach_that_may_be_slow_is_given_time() -> None:
    slow = Feed(guarded_speed_m_s=5e-6)
    expected_s = 6e-6 / (PROGRESS_SHARE * 5e-6)
    assert slow.until("R7", 8.0, phase=SEARCH[1]) == pytest.approx(expected_s, abs=0.01)


def test_r7_the_wait_for_progress_begins_with_the_search() -> None:
    feed = Feed()
    for _ in range(3):
        feed.ticks(1000, phase=SEARCH[1])
        feed.ticks(2, phase=Phase.DWELL)
    assert feed.supervisor.cause is None


def test_motion_is_judged_from_the_first_command_on() -> None:
    supervisor = Supervisor(PLANNED, "-fz")
    for index, (target_m, position_m) in enumerate([(math.nan, 1.0), (0.5, 0.5), (0.5, 0.5)]):
        force, arm = force_sample(index, 0.0), arm_sample(index, position_m)
        cause = supervisor.check(index * PERIOD_S, [force], [arm], (), target_m, 0.0, Phase.HOLD)
        assert cause is None
        assert supervisor.motion.speed_m_s == 0.0


def test_new_limits_reach_the_rules_of_motion() -> None:
    feed = Feed(**CALM)
    feed.supervisor.adopt(replace(PLANNED, model_tolerance_m=0.25 * TOLERANCE_M, **CALM))
    cause = feed.tick(position_m=feed.target_m + 0.5 * TOLERANCE_M)
    assert cause is not None
    assert cause.rule == "R7"
