"""One tick of a run and its safing, with samples made by hand; and safing's own order."""

from __future__ import annotations

import math
import threading
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from rule_feed import PERIOD_S, arm_sample, force_sample
from run_plans import preflight_for, stvf_plan

from stepload.engine.operator import Operator, StopLevel
from stepload.engine.safing import Action, make_safe
from stepload.engine.tick import LATE_S, SAFING_EXTRA_S, Engine
from stepload.feasibility.bounds import Measured, cross_blind_n
from stepload.feasibility.zero_drift import under_load_s
from stepload.record.outcome import Cause
from stepload.record.rows import Phase

ENVELOPE = preflight_for(stvf_plan())
PLANNED = ENVELOPE.run_limits
RETRACT_M = ENVELOPE.plan.procedure.retract_m


class Rig:
    """An engine whose course stands where a test puts it; the arm is where it is said to be."""

    def __init__(self, **changes: Any) -> None:
        self.operator = Operator()
        preflight = replace(ENVELOPE, limits=replace(PLANNED, **changes))
        self.engine = Engine(preflight, self.operator)
        self.index = 0
        self.force_n = 0.0
        self.steps: list[float] = []
        course = self.engine.course
        course.sequence = iter(lambda: self.steps.append(course.step_s), self)
        self.engine.course.target_m = 0.0
        self.tick()
        self.engine.supervisor.tare(0.0, 0.0)
        self.tick()

    def tick(self, position_m: float | None = None, periods: float = 1.0) -> bool:
        """One tick so many periods after the last one; whether the run is over."""
        self.index += 1
        self.now_s = getattr(self, "now_s", 5.0) + periods * PERIOD_S
        target_m = self.engine.course.target_m
        at_m = target_m if position_m is None else position_m
        stamps = {"receive_time_s": self.now_s, "device_time_s": math.nan}
        force = force_sample(self.index, self.force_n, **stamps)
        arm = arm_sample(self.index, at_m, self.force_n, **stamps)
        return self.engine.tick(self.now_s, [force], [arm])[1]

    def trip(self) -> None:
        """Stop the run for a reason of its own."""
        self.engine.trip(Cause("device", 1.0, 0.0, "", 0.0, self.now_s, "broken"))


FOLLOWED = 200
"""Ticks after which the arm is where its commands put it, lag and delay included."""
CALM = {"model_tolerance_m": 1.0, "still_m": 1.0}


@pytest.mark.parametrize(
    ("periods", "expected"), [(0.5, 0.5), (1.0, 1.0), (1.1, 1.1), (5.0, 1.2), (-1.0, 0.0)]
)
def test_a_late_tick_moves_less_and_a_clock_that_goes_back_nothing(
    periods: float, expected: float
) -> None:
    rig = Rig()
    rig.tick(periods=periods)
    assert rig.steps[-1] == pytest.approx(expected * PERIOD_S, abs=1e-9)


def test_safing_takes_the_target_back_to_the_arm_at_once() -> None:
    for ahead_m, back_m in ((0.4e-3, 0.4e-3), (5e-3, RETRACT_M), (-0.4e-3, 0.0)):
        rig = Rig(**CALM)
        rig.engine.course.target_m = 2e-3
        rig.tick(2e-3 - ahead_m)
        rig.trip()
        assert rig.engine.target_m == rig.engine.course.target_m == pytest.approx(2e-3 - back_m)
        assert rig.engine.safing


def retracted(rig: Rig, position_m: float | None = None) -> list[float]:
    """The targets until the run is over."""
    targets = [rig.engine.target_m]
    while not rig.tick(position_m):
        targets.append(rig.engine.target_m)
        assert len(targets) < 20_000
    return targets


def test_safing_retracts_by_the_whole_way_at_the_retract_speed() -> None:
    rig = Rig(**CALM)
    rig.engine.course.target_m = 2e-3
    rig.tick()
    rig.engine.course.surface_m = 1.9e-3
    rig.trip()
    targets = retracted(rig)
    assert rig.engine.safe_reached
    assert rig.engine.target_m == pytest.approx(1.9e-3 - RETRACT_M)
    speeds = [(a - b) / PERIOD_S for a, b in pairwise(targets)]
    most = 2.0 * PLANNED.acceleration_m_s2 * PERIOD_S
    assert speeds[0] == pytest.approx(most)
    assert speeds[1] == pytest.approx(2.0 * most)
    assert max(speeds) == pytest.approx(PLANNED.retract_speed_m_s)
    assert rig.engine.row is not None
    assert rig.engine.row.phase == Phase.SAFING


def test_an_arm_that_is_not_seen_to_arrive_is_not_called_retracted() -> None:
    for off, reached in ((0.99, True), (1.01, False)):
        for changes, near_m in ((CALM, 0.25 * RETRACT_M), ({}, PLANNED.model_tolerance_m)):
            rig = Rig(**changes)
            rig.trip()
            goal_m = rig.engine._safe_m
            while rig.engine.target_m > goal_m:
                rig.tick(0.0)
            for _ in range(FOLLOWED):
                rig.tick(0.0)
            assert not rig.engine.safe_reached
            for _ in range(math.ceil(LATE_S / PERIOD_S) - 1):  # its commands may be on the way
                assert not rig.tick(goal_m + off * near_m)
            over = [rig.tick(goal_m + off * near_m) for _ in range(3)]
            assert any(over) is reached
            assert rig.engine.safe_reached is reached


def test_a_position_that_jumps_back_is_not_there_before_the_commands_had_their_time() -> None:
    """R7 trips on it, and it says at once that the arm is 5 mm further back than it is."""
    rig = Rig(arm_lag_s=0.3, command_delay_s=0.05)
    rig.trip()
    goal_m, near_m = rig.engine._safe_m, PLANNED.model_tolerance_m
    waited = 0
    while not rig.tick(goal_m - 5e-3):
        waited += rig.engine.target_m <= goal_m
    assert rig.engine.safe_reached
    assert rig.engine.supervisor.motion.model_m <= goal_m + near_m
    assert waited * PERIOD_S > 0.05


def test_safing_gives_up_after_twice_its_time_and_some_seconds() -> None:
    rig = Rig(**CALM)
    rig.engine.course.guard.proven = True
    rig.trip()
    begin_s, way_m = rig.now_s, RETRACT_M
    retracted(rig, 0.0)
    assert not rig.engine.safe_reached
    expected_s = 2.0 * way_m / PLANNED.retract_speed_m_s + SAFING_EXTRA_S
    assert rig.now_s - begin_s == pytest.approx(expected_s, abs=0.01)


def test_an_arm_that_never_said_where_it_is_is_left_to_the_rest_of_safing() -> None:
    engine = Engine(ENVELOPE, Operator())
    engine.trip(Cause("device", 1.0, 0.0, "", 0.0, 0.0, "broken"))
    assert engine.tick(1.0, [force_sample(0, 0.0)], [])[1]
    assert not engine.safe_reached


def test_the_first_reason_is_the_one_that_counts() -> None:
    rig = Rig()
    rig.trip()
    first = rig.engine.cause
    rig.engine.trip(Cause("R1", 9.0, 1.0, "N", 0.0, 9.0, "later"))
    assert rig.engine.cause is first
    assert [kind for _, kind, _ in rig.engine.events].count("trip") == 1
    assert [kind for _, kind, _ in rig.engine.events].count("safing") == 1


def test_a_rule_of_the_supervisor_begins_safing_in_the_same_tick() -> None:
    rig = Rig()
    rig.force_n = 900.0
    before = len(rig.steps)
    assert not rig.tick()
    assert rig.engine.safing
    assert rig.engine.cause is rig.engine.supervisor.cause
    assert len(rig.steps) == before
    assert rig.engine.peak_force_n == 900.0


@pytest.mark.parametrize("level", list(StopLevel))
def test_the_operator_stops_at_once_from_the_second_time_on(level: StopLevel) -> None:
    rig = Rig()
    rig.operator.request_stop(level)
    rig.tick()
    assert rig.engine.safing is (level >= StopLevel.NOW)
    assert rig.engine.cause is None


def test_what_the_course_finds_impossible_stops_the_run() -> None:
    rig = Rig()
    rig.engine.course.fail("drift", 3.0, 1.0, "N", "moved")
    assert not rig.tick()
    assert rig.engine.cause is not None
    assert rig.engine.cause[:4] == ("drift", 3.0, 1.0, "N")
    assert rig.engine.safing


def test_the_peak_force_and_the_row_of_a_tick_are_the_supervisors() -> None:
    rig = Rig(jump_n=1e9)
    for rig.force_n in (20.0, 10.0):
        rig.tick()
    assert rig.engine.peak_force_n == 20.0
    assert rig.engine.row is not None
    assert rig.engine.row.force_n == 10.0
    assert rig.engine.row.limit_n == PLANNED.force_limit_n


def test_how_far_the_arm_must_go_back_counts_from_the_farthest_it_may_be() -> None:
    rig = Rig(**CALM)
    rig.engine.course.target_m = 2e-3
    rig.tick(2.5e-3)
    rig.engine.course.surface_m = 1.5e-3
    assert rig.engine.retract_distance_m == pytest.approx(1e-3 + RETRACT_M)
    rig.trip()
    rig.engine.target_m = rig.engine.course.target_m = rig.engine._safe_m - 1.0
    assert rig.engine.retract_distance_m == RETRACT_M


def test_limits_measured_during_the_run_only_get_tighter() -> None:
    engine = Engine(ENVELOPE, Operator())
    loaded_s = under_load_s(ENVELOPE.plan.procedure, ENVELOPE.bounds.loop_s)
    assert engine._adopt(Measured(0.6, 2.0 / loaded_s)) is None
    assert engine.limits.noise_n == pytest.approx(math.hypot(0.6, 0.05 / math.sqrt(12.0)))
    first = engine.limits
    hidden_n = cross_blind_n(ENVELOPE.plan.rig, first.noise_n)
    assert first.allowed_n == pytest.approx((0.95 * 727.0 - 11.0 - hidden_n - 2.0) / 1.05)
    assert engine._adopt(Measured(0.4, 5.0 / loaded_s)) is None
    assert engine.limits.noise_n == first.noise_n
    assert engine.limits.allowed_n == pytest.approx((0.95 * 727.0 - 11.0 - hidden_n - 5.0) / 1.05)
    assert engine._adopt(Measured(0.4, 1.0 / loaded_s)) is None
    assert engine.limits.allowed_n == pytest.approx((0.95 * 727.0 - 11.0 - hidden_n - 5.0) / 1.05)
    kept = engine.limits
    refusal = engine._adopt(Measured(80.0, 0.0))
    assert refusal is not None
    assert engine.limits is engine.course.limits is engine.supervisor._limits is kept


def test_safing_sends_the_arms_actions_first_and_every_one_of_them() -> None:
    called: list[str] = []

    def broken() -> None:
        called.append("retract")
        raise OSError("unplugged")

    actions = [
        Action("sensor", lambda: called.append("sensor"), 1.0),
        Action("retract", broken, 1.0, arm=True),
        Action("stop", lambda: called.append("stop"), 1.0, arm=True),
    ]
    results = make_safe(actions, Operator())
    assert called == ["retract", "stop", "sensor"]
    assert [(r.name, r.sent, r.error) for r in results] == [
        ("retract", True, "OSError: unplugged"), ("stop", True, ""), ("sensor", True, ""),
    ]  # fmt: skip
    assert all(r.duration_s >= 0.0 and r.start_s > 0.0 for r in results)


def test_an_action_that_hangs_is_left_behind_after_its_deadline() -> None:
    release, called = threading.Event(), []
    actions = [
        Action("retract", lambda: release.wait(30.0), 0.05, arm=True),
        Action("stop", lambda: called.append("stop"), 1.0, arm=True),
    ]
    try:
        results = make_safe(actions, Operator())
        assert results[0].sent
        assert results[0].error.startswith("no answer within")
        assert results[0].duration_s >= 0.05
        assert called == ["stop"]
    finally:
        release.set()


@pytest.mark.parametrize("level", list(StopLevel))
def test_the_third_ctrl_c_leaves_out_the_sensors_and_no_other_level_does(level: StopLevel) -> None:
    operator, called = Operator(), []
    operator.request_stop(level)
    results = make_safe(
        [Action("sensor", lambda: called.append("sensor"), 1.0),
         Action("stop", lambda: called.append("stop"), 1.0, arm=True)], operator,
    )  # fmt: skip
    skipped = level is StopLevel.ARM_ONLY
    assert called == (["stop"] if skipped else ["stop", "sensor"])
    assert results[1].sent is not skipped
    assert results[1].start_s > 0.0
    if skipped:
        reason = "skipped on the operator's request"
        assert (results[1].name, results[1].error) == ("sensor", reason)
        assert results[1].duration_s == 0.0


def test_the_third_ctrl_c_ends_the_wait_for_a_sensor_but_not_for_the_arm() -> None:
    operator, release = Operator(), threading.Event()

    def ask() -> None:
        operator.request_stop(StopLevel.ARM_ONLY)
        release.wait(30.0)

    try:
        (sensor,) = make_safe([Action("sensor", ask, 20.0)], operator)
        assert "left behind" in sensor.error
        assert sensor.duration_s < 10.0
        (arm,) = make_safe([Action("stop", lambda: release.wait(0.1), 20.0, arm=True)], operator)
        assert arm.error == ""
    finally:
        release.set()


def test_an_action_is_sent_where_no_thread_can_be_had(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_thread(_: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", no_thread)
    called: list[str] = []
    (result,) = make_safe(
        [Action("stop", lambda: called.append("stop"), 1.0, arm=True)], Operator()
    )
    assert called == ["stop"]
    assert (result.name, result.sent, result.error) == ("stop", True, "")
    assert result.start_s > 0.0
    assert 0.0 <= result.duration_s < result.start_s


def test_a_thread_that_is_left_behind_does_not_keep_the_process() -> None:
    seen: list[threading.Thread] = []
    make_safe([Action("stop", lambda: seen.append(threading.current_thread()), 1.0)], Operator())
    assert seen[0].daemon
    assert seen[0].name == "safing stop"
