"""A zero that has moved on a long way to the surface is taken again, and nothing else is."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from course_feed import PERIOD_S, PLAN, PLANNED, Stage

from stepload.engine.approach import MEAN_S, Approach
from stepload.engine.phases import Exit
from stepload.engine.zeroing import LOOK_S, Zeroing
from stepload.feasibility.schedule import WORTH
from stepload.feasibility.zero_drift import SECOND_ZERO_SHARE
from stepload.record.outcome import Tare
from stepload.record.rows import Phase

MOVED_N = PLANNED.moved_zero_n
ZERO = Tare(9.0, 0.3, 300, 0.0, 0.1, 0.0, 0.0, 0.1)
LOOK = round(LOOK_S / PERIOD_S) + 1
TICKS = round(3.0 * MEAN_S / PLANNED.period_s)
"""So long that the mean is 95 % of the force."""


def approach(limits: dict[str, Any] | None = None, **procedure: Any) -> tuple[Stage, Approach]:
    stage = Stage(limits, {"max_drift_n": 10.0, "retract_m": 1e-4, **procedure})
    stage.course.tares.append(ZERO)
    part = Approach(stage.course, stage)  # type: ignore[arg-type]
    stage.begin(part.touch("first", 1))
    return stage, part


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_zero_that_has_moved_is_taken_again_on_the_way(sign: float) -> None:
    stage, _ = approach()
    stage.ticks(TICKS, sign * 0.99 * MOVED_N)
    assert not stage.zeroing
    stage.ticks(TICKS, sign * 1.1 * MOVED_N)
    assert len(stage.zeroing) == 1
    assert stage.course.failure is None


def test_a_force_that_has_not_stood_for_long_is_no_moved_zero() -> None:
    stage, _ = approach()
    ticks_s = MEAN_S * math.log(2.0)  # until the mean of a step is half of it
    stage.ticks(round(0.98 * ticks_s / PLANNED.period_s), 2.0 * MOVED_N)
    assert not stage.zeroing
    stage.ticks(round(0.04 * ticks_s / PLANNED.period_s), 2.0 * MOVED_N)
    assert len(stage.zeroing) == 1


def test_the_way_gained_is_worth_what_backing_off_loses() -> None:
    """Two retracts of way from where the approach began, and from where a zero was taken."""
    worth_m = WORTH * 1e-4
    stage, _ = approach({"fast_speed_m_s": 1e-12})
    for start_m in (0.0, worth_m):
        taken = len(stage.zeroing)
        stage.course.target_m = start_m + 0.99 * worth_m
        stage.ticks(TICKS, 2.0 * MOVED_N)
        assert len(stage.zeroing) == taken
        stage.course.target_m = start_m + 1.001 * worth_m
        stage.ticks(100, 2.0 * MOVED_N)
        assert len(stage.zeroing) == taken + 1
        stage.course.tares.append(ZERO)
        stage.zeroed.append(None)
        stage.ticks()


def test_no_more_than_the_allowed_drift_since_the_first_zero_is_taken_for_one() -> None:
    for share, taken in ((0.99, True), (1.01, False)):
        stage, _ = approach(max_drift_n=2.0)
        stage.course.tares.append(replace(ZERO, mean_n=share * 2.0 - 2.0 * MOVED_N))
        stage.ticks(TICKS, 2.0 * MOVED_N)
        assert bool(stage.zeroing) == taken


def test_the_second_channel_is_the_witness() -> None:
    """What it has moved by since its first zero: more than half its tolerance is no drift."""
    for share, there, taken in ((0.99, "arm", True), (1.01, "arm", False), (1.01, "", True)):
        stage, _ = approach({"cross_check": there})
        shift_n = share * SECOND_ZERO_SHARE * PLANNED.cross_tolerance_n
        stage.course.tares.append(replace(ZERO, second_mean_n=0.5 * shift_n))
        stage.sup.second_n = 0.5 * shift_n
        stage.ticks(TICKS, 1.5 * MOVED_N)
        assert bool(stage.zeroing) == taken


def test_after_a_moved_zero_the_approach_begins_again_and_so_does_the_mean() -> None:
    stage, _ = approach()
    stage.ticks(TICKS, 2.0 * MOVED_N)
    stage.course.tares.append(replace(ZERO, mean_n=2.0 * MOVED_N))
    stage.zeroed.append(None)
    stage.ticks()
    assert stage.course.phase == Phase.FAST_APPROACH
    stage.ticks(round(0.1 * TICKS), 2.0 * MOVED_N)
    assert len(stage.zeroing) == 1
    stage.ticks(TICKS, 2.0 * MOVED_N)
    assert len(stage.zeroing) == 2


def test_what_goes_away_by_backing_off_is_met_with_the_old_zero_and_not_proved_again() -> None:
    stage, part = approach()
    stage.ticks(TICKS, 2.0 * MOVED_N)
    assert stage.zeroing == [True]
    stage.zeroed.append(Exit.CONTACT)
    stage.ticks()
    assert stage.course.phase == Phase.GUARDED_APPROACH
    stage.ticks(TICKS, 2.0 * MOVED_N)
    assert len(stage.zeroing) == 1
    stage.begin(part.touch("cycle", 1))
    stage.ticks(TICKS, 2.0 * MOVED_N)
    assert len(stage.zeroing) == 2


@pytest.mark.parametrize("second", [False, True])
def test_on_the_way_a_little_that_goes_with_the_way_is_contact(second: bool) -> None:
    """Where the start pose is left, half of the drift or of the tolerance passes."""
    noise_free = [0.0] * LOOK
    for share, on_the_way, free in ((0.49, True, True), (0.51, True, False), (0.51, False, True)):
        stage = Stage()
        stage.begin(Zeroing(stage.course, lambda _: None).free_air(on_the_way))
        stage.readings(noise_free, noise_free)
        stage.back_off()
        change = [-share * 0.5 * PLAN.max_drift_n if not on_the_way else -share * MOVED_N] * LOOK
        stage.readings(noise_free if second else change, change if second else noise_free)
        assert stage.course.failure is None
        assert stage.exits == ([] if free else [Exit.CONTACT])
        assert bool(stage.then) == free
