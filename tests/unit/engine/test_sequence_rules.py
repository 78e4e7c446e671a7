"""The parts of a run's order at their bounds: approach, touch, retract, steps, start."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from course_feed import PERIOD_S, PLAN, PLANNED, Stage

from stepload.engine.approach import RING_TIMEOUT_S, Approach
from stepload.engine.controller import LEAD_FILTER_S, Lead
from stepload.engine.force_state import BLOCK_S, BLOCKS, BOUNCE_S, SURE, RingTest, SettleTest
from stepload.engine.operator import StopLevel
from stepload.engine.phases import Exit
from stepload.engine.retract import retract
from stepload.engine.sequence import START_REST_S, RunSequence
from stepload.engine.steps import LoadSteps
from stepload.record.outcome import Tare
from stepload.record.rows import Phase

NEAR_M = PLAN.surface_distance_m - PLAN.surface_uncertainty_m
RUN_OUT_M = 2.0 * PLANNED.fast_speed_m_s * PLANNED.reaction_s
WIDE = {"travel_limit_free_m": 1.0, "ahead_m": 1.0}


def approach(
    limits: dict[str, Any] | None = None, touches: int = 1, **procedure: Any
) -> tuple[Stage, Approach]:
    stage = Stage(limits, procedure)
    stage.course.tares.append(Tare(9.0, 0.3, 300, 0.0, 0.1, 0.0, 0.0, 0.1))
    part = Approach(stage.course, stage)  # type: ignore[arg-type]
    stage.begin(part.touch("first", touches))
    return stage, part


def guarded(limits: dict[str, Any] | None = None, **options: Any) -> Stage:
    """An approach that has just become a guarded one, at rest."""
    stage, _ = approach(limits, **options)
    stage.sup.arm.position_m = stage.course.target_m = stage.course.goal_m
    stage.ticks()
    assert stage.course.phase == Phase.GUARDED_APPROACH
    return stage


def test_the_fast_approach_ends_short_of_where_the_surface_may_be() -> None:
    stage, _ = approach()
    assert stage.course.phase == Phase.FAST_APPROACH
    assert stage.course.goal_m == pytest.approx(NEAR_M - RUN_OUT_M)
    while stage.course.phase == Phase.FAST_APPROACH:
        stage.ticks()
        assert stage.course.speed_m_s <= PLANNED.fast_speed_m_s
    assert stage.course.phase == Phase.GUARDED_APPROACH
    assert stage.course.target_m == pytest.approx(NEAR_M - RUN_OUT_M)


def test_a_known_surface_is_approached_to_a_gap_and_half_as_fast() -> None:
    stage = Stage(WIDE)
    stage.course.surface_m = 2e-3
    part = Approach(stage.course, stage)  # type: ignore[arg-type]
    stage.begin(part.touch("cycle", 1))
    gap_m = max(20.0 * PLANNED.position_resolution_m, 0.3 * PLANNED.guarded_speed_m_s)
    assert stage.course.goal_m == pytest.approx(2e-3 - min(gap_m, PLAN.retract_m) - RUN_OUT_M)
    while stage.course.phase == Phase.FAST_APPROACH:
        stage.ticks()
    stage.ticks(200)
    assert stage.course.speed_m_s == pytest.approx(0.5 * PLANNED.guarded_speed_m_s)


def test_the_guarded_approach_keeps_its_speed_and_its_acceleration() -> None:
    stage = guarded(WIDE)
    stage.ticks(1)
    assert stage.course.speed_m_s == pytest.approx(
        min(PLANNED.acceleration_m_s2 * PERIOD_S, PLANNED.guarded_speed_m_s)
    )
    begin_m = stage.course.target_m
    stage.ticks(100)
    assert stage.course.speed_m_s == PLANNED.guarded_speed_m_s
    way_m = stage.course.target_m - begin_m
    assert way_m == pytest.approx(100.0 * PERIOD_S * PLANNED.guarded_speed_m_s, rel=1e-9)


def test_the_fast_approach_does_not_run_ahead_of_an_arm_that_does_not_follow() -> None:
    stage, _ = approach({"ahead_m": 2e-5})
    stage.position_m = 0.0
    stage.ticks(3000)
    most_m = PLANNED.fast_speed_m_s * PLANNED.reaction_s + 2e-5
    assert 0.99 * most_m < stage.course.target_m < 1.2 * most_m


ONE = {"cross_check": "", "undetected_s": 0.5, "ahead_m": 1.0, "travel_limit_free_m": 1e-4}
LATE_S = (1 + math.ceil((0.5 + PLANNED.reaction_s) / PLANNED.period_s)) * PERIOD_S


def test_an_only_channel_that_repeats_itself_holds_the_guarded_approach_back() -> None:
    """What it read last was of the target of `undetected_s` ago."""
    stage = guarded(WIDE | ONE)
    from_m = stage.course.target_m
    stage.ticks(2000)
    assert stage.course.target_m == from_m
    stage.sup.force.raw_n = 0.01
    stage.ticks(5000)
    assert stage.course.target_m == pytest.approx(from_m + 1e-4)


def test_an_only_channel_that_reads_anew_lets_the_approach_go_on_at_the_speed_of_its_age() -> None:
    stage = guarded(WIDE | ONE)
    for tick in range(3000):
        stage.sup.force.raw_n = 0.01 * (tick % 2)
        stage.ticks(1)
    from_m = stage.course.target_m
    for tick in range(2000):
        stage.sup.force.raw_n = 0.01 * (tick % 2)
        stage.ticks(1)
    speed = (stage.course.target_m - from_m) / (2000 * PERIOD_S)
    assert speed == pytest.approx(1e-4 / LATE_S, rel=0.05)


@pytest.mark.parametrize(("changes", "found"), [(ONE, True), (WIDE, False)])
def test_r6_an_only_channel_that_feels_no_known_surface_ends_the_approach(
    changes: dict[str, Any], found: bool
) -> None:
    for deepest_slacks in (-math.inf, 2.0):
        for beyond_m, ended in ((-1e-6, False), (1e-6, found)):
            stage = guarded(WIDE | changes)
            course, limits = stage.course, stage.course.limits
            course.surface_m, touch_n = course.target_m, limits.touch_force_n
            slack_m = limits.travel_m(touch_n) + limits.moved_zero_n / limits.answer_at(touch_n)
            course.deepest_m = course.surface_m + deepest_slacks * slack_m
            end_m = max(course.surface_m + slack_m, course.deepest_m)
            course.target_m = stage.position_m = end_m + beyond_m
            stage.ticks(1)
            assert (course.failure is not None) == ended
            assert course.failure is None or course.failure.rule == "R6"


def test_the_target_does_not_run_ahead_of_an_arm_that_does_not_follow() -> None:
    ahead_m = 2e-5
    stage = guarded({"ahead_m": ahead_m, "travel_limit_free_m": 1.0})
    stage.position_m = stage.course.target_m
    stage.ticks(3000)
    ahead = stage.course.target_m - stage.position_m
    assert 0.99 * ahead_m < ahead < 1.2 * ahead_m


@pytest.mark.parametrize("phase", [Phase.FAST_APPROACH, Phase.GUARDED_APPROACH])
def test_two_fresh_samples_above_the_touch_force_are_a_touch(phase: Phase) -> None:
    touch_n = PLANNED.touch_force_n
    stage = approach()[0] if phase is Phase.FAST_APPROACH else guarded()
    course = stage.course
    stage.ticks(5, 0.99 * touch_n)
    stage.ticks(1, 1.01 * touch_n)
    stage.ticks(1, 0.0)
    stage.ticks(1, 1.01 * touch_n)
    stage.sup.force.fresh = False
    stage.ticks(3, 1.01 * touch_n)
    assert course.phase == phase
    stage.sup.force.fresh = True
    stage.position_m = at_m = course.target_m - 5e-6
    stage.ticks(1, 1.01 * touch_n)
    assert course.phase == Phase.DWELL
    assert course.surface_m == course.target_m == at_m
    (touch,) = course.touches
    assert (touch.position_m, touch.purpose, touch.cycle) == (at_m, "first", 1)


def test_a_touch_never_moves_the_target_on() -> None:
    stage = guarded()
    stage.position_m = stage.course.target_m + 5e-5
    before_m = stage.course.target_m
    stage.ticks(1, 2.0 * PLANNED.touch_force_n)
    moved_m = stage.course.target_m
    stage.ticks(1, 2.0 * PLANNED.touch_force_n)
    assert stage.course.phase == Phase.DWELL
    assert stage.course.target_m == moved_m < before_m + 1e-6


@pytest.mark.parametrize("phase", [Phase.FAST_APPROACH, Phase.GUARDED_APPROACH])
def test_an_approach_waits_after_a_hit_and_goes_on_where_none_follows(phase: Phase) -> None:
    stage = guarded(WIDE) if phase == Phase.GUARDED_APPROACH else approach(WIDE)[0]
    stage.ticks(20)
    hit_m = stage.course.target_m
    stage.ticks(1, 1.01 * SURE * PLANNED.touch_force_n)
    stage.ticks(round(0.95 * BOUNCE_S / PERIOD_S), 0.0)
    assert stage.course.target_m == hit_m
    stage.ticks(round(0.2 * BOUNCE_S / PERIOD_S))
    assert stage.course.target_m > hit_m
    assert stage.course.phase == phase
    assert stage.course.touches == []


def touched(touches: int, **options: Any) -> Stage:
    stage = guarded(touches=touches, **options)
    stage.ticks(2, 1.5 * PLANNED.touch_force_n)
    assert stage.course.phase == Phase.DWELL
    return stage


def test_the_dwell_lasts_until_ringing_has_died_out_or_its_time_is_over() -> None:
    stage = touched(1)
    begin_s = stage.now_s
    stage.ticks(1000)
    assert stage.then[0] - begin_s < 0.2
    ringing = touched(1)
    begin_s = ringing.now_s
    for tick in range(5000):
        ringing.ticks(1, 1.5 * PLANNED.touch_force_n + 10.0 * (tick % 2))
    assert ringing.then[0] - begin_s == pytest.approx(RING_TIMEOUT_S, abs=2.0 * PERIOD_S)


def test_the_mean_force_of_a_dwell_leaves_out_what_made_the_touch() -> None:
    stage = touched(1)
    touch_n, rings = 1.5 * PLANNED.touch_force_n, math.floor(2.0 * PLANNED.reaction_s / PERIOD_S)
    assert stage.course.dwelt_n == touch_n
    stage.ticks(rings, 3.0 * touch_n)
    stage.ticks(10, 0.2 * touch_n)
    assert stage.course.dwelt_n == pytest.approx(0.2 * touch_n)
    stage.ticks(10, 0.4 * touch_n)
    assert stage.course.dwelt_n == pytest.approx(0.3 * touch_n, rel=0.05)


def test_a_stop_in_contact_leaves_before_the_next_touch() -> None:
    stage = touched(3)
    stage.operator.request_stop(StopLevel.AFTER_STEP)
    stage.ticks(300)
    assert stage.then


def test_a_stop_during_an_approach_leaves() -> None:
    for stage in (approach()[0], guarded()):
        stage.operator.request_stop(StopLevel.AFTER_STEP)
        stage.ticks()
        assert stage.exits == [Exit.STOP]


def test_force_that_stays_between_touches_leads_back_by_the_retract_and_no_further() -> None:
    gap_m = max(20.0 * PLANNED.position_resolution_m, 0.3 * PLANNED.guarded_speed_m_s)
    retract_m = 1.5 * min(gap_m, PLAN.retract_m)
    stage = touched(2, retract_m=retract_m)
    course = stage.course
    stage.ticks(20_000, 0.51 * PLANNED.touch_force_n + 3.0 * PLANNED.touch_force_n)
    assert course.failure is not None
    assert course.failure.rule == "not_open"
    assert course.failure.limit == 0.5 * PLANNED.touch_force_n
    assert course.goal_m == pytest.approx(course.surface_m - retract_m)


DRIFT_N = 2.5
"""Allowed, in the following; more than half the touch force."""


def drifted(left_n: float) -> Stage:
    """Backed off as far as it goes after a touch, with so much force left."""
    stage = touched(3, retract_m=1e-4, max_drift_n=DRIFT_N)
    stage.ticks(100)
    stage.ticks(5_000, left_n)
    return stage


def test_a_zero_that_moved_on_the_way_is_taken_again_and_the_surface_touched_again() -> None:
    stage = drifted(0.99 * DRIFT_N)
    course = stage.course
    assert course.failure is None
    assert len(stage.zeroing) == 1
    assert course.target_m == pytest.approx(course.surface_m - 1e-4)
    stage.zeroed.append(None)
    stage.ticks()
    assert course.phase == Phase.FAST_APPROACH
    stage.ticks(5_000, 0.0)
    assert course.phase == Phase.GUARDED_APPROACH
    stage.ticks(2, 1.5 * PLANNED.touch_force_n)
    stage.ticks(300)
    assert [touch.purpose for touch in course.touches] == ["first", "again"]
    stage.ticks(5_000, 0.99 * DRIFT_N)
    assert course.failure is not None
    assert course.failure.rule == "not_open"
    assert len(stage.zeroing) == 1


def test_more_than_the_allowed_drift_is_no_new_zero() -> None:
    assert drifted(1.01 * DRIFT_N).course.failure is not None
    stage = touched(3, retract_m=1e-4, max_drift_n=DRIFT_N)
    stage.course.tares.append(replace(stage.course.tares[0], mean_n=0.3 * DRIFT_N))
    stage.ticks(100)
    stage.ticks(5_000, 0.8 * DRIFT_N)
    assert stage.course.failure is not None
    assert not stage.zeroing


def test_half_the_touch_force_is_free_again() -> None:
    for share, free in ((0.49, True), (0.51, False)):
        stage = touched(2)
        stage.ticks(300)
        stage.ticks(800, share * PLANNED.touch_force_n)
        assert (stage.course.phase == Phase.GUARDED_APPROACH) == free


def test_the_gap_between_touches_covers_lost_motion_and_resolution() -> None:
    for change, gap_m in (
        ({"lost_motion_m": 1e-4}, 4e-4),
        ({"position_resolution_m": 3e-5}, 6e-4),
        ({"lost_motion_m": 1e-2}, PLAN.retract_m),
    ):
        stage = touched(2, limits=change)
        stage.ticks(300)
        assert stage.course.surface_m - stage.course.goal_m == pytest.approx(gap_m)


@pytest.mark.parametrize(("share", "is_open"), [(0.99, True), (1.01, False)])
def test_a_retract_proves_that_the_contact_is_open(share: float, is_open: bool) -> None:
    stage = Stage()
    stage.course.surface_m = stage.course.target_m = 1e-3
    stage.sup.arm.position_m = 1e-3
    stage.begin(retract(stage.course))
    assert stage.course.goal_m == pytest.approx(1e-3 - PLAN.retract_m)
    begin_s = stage.now_s
    stage.ticks(3000, share * PLANNED.touch_force_n)
    assert bool(stage.then) == is_open
    failure = stage.course.failure
    assert (failure is None) == is_open
    assert failure is None or failure[:3] == (
        "not_open", share * PLANNED.touch_force_n, PLANNED.touch_force_n
    )  # fmt: skip
    rest_s = 0.2 + 4.0 * PLANNED.loop_s
    assert stage.now_s - begin_s > rest_s + PLAN.retract_m / PLANNED.retract_speed_m_s
    assert stage.course.level_n == 0.0


def test_where_the_arm_is_believed_to_be_is_within_a_retract_of_its_target() -> None:
    course = Stage().course
    for position_m, expected_m in ((0.3e-3, 0.3e-3), (5e-3, 1e-3), (-5e-3, -1e-3)):
        course.sup.arm.position_m = position_m
        assert course.expected_m == pytest.approx(expected_m)
    course.target_m = math.nan
    assert course.expected_m == -5e-3


def test_the_contact_is_open_a_retract_behind_all_that_is_known() -> None:
    course = Stage().course
    course.sup.arm.position_m, course.target_m = 0.5e-3, 0.2e-3
    assert course.release_m == pytest.approx(0.2e-3 - PLAN.retract_m)
    course.surface_m = 0.1e-3
    assert course.release_m == pytest.approx(0.1e-3 - PLAN.retract_m)
    course.surface_m, course.sup.arm.position_m = 0.7e-3, -0.3e-3
    assert course.release_m == pytest.approx(-0.3e-3 - PLAN.retract_m)


def test_motion_to_a_goal_has_bounded_speed_and_acceleration_and_comes_to_rest_there() -> None:
    for goal_m in (2e-3, -2e-3):
        stage = Stage()
        course = stage.course
        course.aim(goal_m)
        speeds, before_m = [0.0], 0.0
        course.step_s = PERIOD_S
        while not course.move(0.01):
            speeds.append(abs(course.target_m - before_m) / PERIOD_S)
            before_m = course.target_m
            assert abs(course.target_m) <= abs(goal_m)
        assert course.target_m == goal_m
        assert max(speeds) == pytest.approx(0.01)
        fastest = 1.001 * PLANNED.acceleration_m_s2 * PERIOD_S
        assert all(b - a <= fastest for a, b in pairwise(speeds))
        assert speeds[-1] < 3.0 * fastest
        assert course.speed_m_s == 0.0


def test_rest_is_counted_from_the_arrival_and_anew_for_a_new_goal() -> None:
    course = Stage().course

    def rests(now_s: float) -> bool:
        course.now_s = now_s
        return course.rest_at_goal(0.5)

    course.aim(0.0)
    assert [rests(now_s) for now_s in (1.0, 1.4, 1.5)] == [False, False, True]
    course.aim(0.0)
    assert not rests(1.6)
    course.enter(Phase.HOLD)
    assert not rests(9.0)


def test_a_lead_is_learned_slowly_and_not_from_an_arm_that_does_not_follow() -> None:
    lead = Lead(PERIOD_S)
    lead.begin(1e-4)
    assert lead.excess(1e-4, 0.0, 1e-5) == 0.0
    assert lead.excess(1.3e-4, 0.0, 1e-5) == pytest.approx(2e-5)
    assert lead._lead_m == 1e-4
    assert lead.excess(1.1e-4, 0.0, 1.5e-5) == 0.0
    assert lead._lead_m == pytest.approx(1e-4 + 1e-5 * PERIOD_S / LEAD_FILTER_S)


class Controller:
    """Takes the target up by a micrometre a tick until it is told that the level is reached."""

    def __init__(self, _limits: object) -> None:
        self.reached = False
        self.begun: list[tuple[Any, ...]] = []
        self.step_m = 1e-6

    def begin(self, *arguments: Any) -> None:
        self.begun.append(arguments)
        self.reached = False

    def step(self, *arguments: Any) -> float:
        target_m: float = arguments[3]
        return target_m + self.step_m


def steps(**procedure: Any) -> tuple[Stage, LoadSteps, Any]:
    stage = Stage(procedure=procedure)
    stage.course.surface_m = 0.0
    made: Any = LoadSteps(stage.course, Controller)  # type: ignore[arg-type]
    return stage, made, made.controller


def test_a_step_that_does_not_come_to_its_level_is_given_up_after_its_time() -> None:
    stage, part, _ = steps(settle_timeout_s=0.125)
    begin_s = stage.now_s
    stage.begin(part.step(1, 50.0))
    while stage.course.phase == Phase.LOAD:
        stage.ticks(1, 20.0)
    assert stage.now_s - begin_s == 20.0 * 0.125
    assert stage.find("level_missed") == {"level_n": 50.0, "force_n": 20.0}
    assert stage.course.phase == Phase.HOLD


def test_a_level_that_was_given_up_is_not_settled_though_its_force_is_at_rest() -> None:
    stage, part, _ = steps(settle_timeout_s=2.0)
    stage.begin(part.step(1, 50.0))
    while not stage.then:
        stage.ticks(1, 20.0)
    held = stage.find("held")
    assert held["held_s"] < PLAN.hold_s + 1.0  # it has come to rest, and need not wait
    assert (held["settled"], held["force_n"]) == (False, 20.0)


def test_unloading_that_does_not_open_the_contact_goes_back_by_a_retract_and_no_further() -> None:
    stage, part, controller = steps()
    controller.step_m = -1e-6
    stage.begin(part.step(1, 50.0, up=False))
    stage.ticks(2000, 100.0)
    assert stage.course.failure is not None
    assert stage.course.failure.rule == "not_open"
    assert stage.course.failure.limit == 50.0
    assert stage.course.target_m == pytest.approx(-PLAN.retract_m, abs=2e-6)


def hold(forces: Any, **procedure: Any) -> tuple[float, dict[str, Any]]:
    """How long a hold of 0.5 s lasts, and what is said of it."""
    stage, part, controller = steps(hold_s=0.5, settle_timeout_s=3.0, **procedure)
    stage.begin(part.step(1, 50.0))
    controller.reached = True
    stage.ticks(1, 50.0)
    begin_s = stage.now_s
    for tick in range(10_000):
        stage.ticks(1, forces(tick * PERIOD_S))
        if stage.then:
            break
    return stage.then[0] - begin_s, stage.find("held")


def test_a_hold_lasts_until_the_force_has_settled_and_at_most_its_time_and_the_timeout() -> None:
    held_s, data = hold(lambda s: 50.0)
    assert data["settled"] is True
    assert held_s == pytest.approx(4.0 / PLANNED.step_rate_per_s + 1.1, abs=0.03)
    held_s, data = hold(lambda s: 50.0 - 5.0 * s)
    assert data["settled"] is False
    assert held_s == pytest.approx(3.5, abs=2.0 * PERIOD_S)


def test_creep_is_rest_below_half_a_percent_of_the_level_or_the_band_over_the_hold() -> None:
    eps_n = max(PLANNED.band_n, 0.005 * 50.0)
    for share, settled in ((0.9, True), (1.1, False)):
        assert hold(lambda s, rate=share * eps_n / 0.5: 50.0 + rate * s)[1]["settled"] is settled


def settled_at(slope: float, hold_s: float = 2.0, eps_n: float = 1.0) -> float:
    test = SettleTest()
    test.begin(0.0, hold_s, eps_n)
    for tick in range(4000):
        test.add(tick * PERIOD_S, slope * tick * PERIOD_S)
        if test.settled:
            return tick * PERIOD_S
    return math.inf


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_settled_is_a_slope_that_creeps_by_less_than_eps_over_the_hold(sign: float) -> None:
    assert settled_at(sign * 0.98 * 0.5) == pytest.approx(BLOCK_S * (BLOCKS + 1), abs=0.01)
    assert settled_at(sign * 1.02 * 0.5) == math.inf


def test_noise_that_hides_the_slope_is_not_rest() -> None:
    def settles(swing_n: float) -> bool:
        test = SettleTest()
        test.begin(0.0, 2.0, 1.0)
        for tick in range(3000):
            block = int(tick * PERIOD_S / BLOCK_S)
            test.add(tick * PERIOD_S, swing_n * (1.0 if block % 4 < 2 else -1.0))
        return test.settled

    # Slope error of +-a in ten blocks: a sqrt(10/8/82.5); twice that over the hold of 2 s.
    edge_n = 1.0 / (2.0 * math.sqrt(10.0 / 8.0 / 82.5) / BLOCK_S * 2.0)
    assert settles(0.6 * edge_n)
    assert not settles(1.1 * edge_n)


def test_ringing_has_died_out_after_two_quiet_blocks() -> None:
    for width, quiet in ((6.9, True), (7.1, False)):
        ring = RingTest(1.0)
        ring.begin(0.0, 0.0)
        told = []
        for tick in range(1, 100):
            ring.add(tick * PERIOD_S, 0.5 * width * (1.0 if tick % 2 else -1.0))
            told.append(ring.quiet)
        assert told[-1] is quiet
        if quiet:
            assert told.index(True) * PERIOD_S == pytest.approx(2 * 0.025, abs=0.003)


def order(position_m: float, procedure: dict[str, Any] | None = None) -> tuple[Stage, RunSequence]:
    stage = Stage(None, procedure)
    stage.course.target_m = math.nan
    stage.position_m = position_m
    run = RunSequence(stage.course, lambda measured: None, 0, Controller, None)  # type: ignore[arg-type]
    return stage, run


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_arm_that_moves_before_the_first_command_is_not_taken_over(sign: float) -> None:
    for share, taken in ((0.99, True), (1.01, False)):
        stage, _ = order(0.0)
        stage.ticks(3)
        stage.position_m = sign * share * PLANNED.model_tolerance_m
        stage.ticks(1)
        assert (stage.course.failure is None) == taken
        assert math.isnan(stage.course.target_m)


def test_an_arm_that_stands_is_taken_over_where_it_stands() -> None:
    stage, _ = order(7e-3)
    rest = round(START_REST_S / PERIOD_S)
    stage.ticks(rest)
    assert math.isnan(stage.course.target_m)
    stage.ticks(2)
    assert stage.course.target_m == 7e-3
    assert stage.course.phase == Phase.WARM_UP


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_arm_that_is_not_held_where_it_says_that_it_is_is_not_taken_over(sign: float) -> None:
    for share, taken in ((0.99, True), (1.01, False)):
        stage, _ = order(7e-3)
        stage.course.held_m = 7e-3 + sign * share * PLANNED.model_tolerance_m
        stage.ticks(round(START_REST_S / PERIOD_S) + 2)
        failure = stage.course.failure
        assert (failure is None) == taken
        if taken:  # the first command moves nothing
            assert stage.course.target_m == stage.course.start_m == stage.course.held_m
        else:
            assert math.isnan(stage.course.target_m)
        if failure is not None:
            assert failure.rule == "held"
            assert failure.value == pytest.approx(-sign * share * PLANNED.model_tolerance_m)
            assert "Nothing was commanded" in failure.message


def test_near_the_plate_an_arm_may_be_held_off_by_less() -> None:
    """The first command would move it there."""
    near = {"surface_distance_m": 60e-6, "surface_uncertainty_m": 10e-6}
    for off_m, taken in ((24e-6, True), (26e-6, False)):
        stage, _ = order(7e-3, near)
        assert off_m < PLANNED.model_tolerance_m
        stage.course.held_m = 7e-3 - off_m
        stage.ticks(round(START_REST_S / PERIOD_S) + 2)
        assert (stage.course.failure is None) == taken
