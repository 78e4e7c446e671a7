"""What the arm's own wrench stops: force across the press that a load cell does not see."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from run_plans import limits_for, stvf_plan

from stepload.engine.supervisor import Supervisor
from stepload.feasibility.lateral import arm_error_n
from stepload.feasibility.limits import RunLimits
from stepload.record.outcome import Cause
from stepload.record.rows import Phase
from stepload.rig.samples import NOT_TOLD, ArmSample, ForceSample, SixFloats

HOLD, SEARCH, RETRACT = int(Phase.HOLD), int(Phase.GUARDED_APPROACH), int(Phase.RETRACT)
TOLERANCE_N, RELATIVE = 11.0, 0.03
LIMITS = replace(
    limits_for(stvf_plan()), cross_check="arm", cross_tolerance_n=TOLERANCE_N,
    cross_relative=RELATIVE, second_limit_n=1e9, second_noise_n=1.0,
)  # fmt: skip
NAN = math.nan


class Feed:
    """A load cell along +fz, and an arm that tells its wrench, tick by tick."""

    def __init__(self, limits: RunLimits = LIMITS, zero: Any = (0.0, 0.0, 0.0)) -> None:
        self.supervisor = Supervisor(limits, "+fz")
        self.tick = 0
        self.press(0.0, zero, 300, SEARCH)
        self.supervisor.tare(0.0, zero[2])

    def press(self, force_n: float, arm_n: Any, ticks: int = 1, phase: int = HOLD) -> Cause | None:
        """So many ticks in which the cell and the arm read this."""
        cause = None
        for _ in range(ticks):
            self.tick += 1
            now_s, live_n = self.tick * LIMITS.period_s, 1e-6 * (self.tick % 5)
            force = ForceSample(self.tick, now_s, now_s, 0, (0, 0, force_n + live_n, 0, 0, 0), 20.0)
            x, y, z = arm_n
            told: SixFloats = (x, y, z + live_n, NAN, NAN, NAN) if x == x else NOT_TOLD
            arm = ArmSample(self.tick, now_s, now_s, 0, 0.0, z + live_n, (0.0,) * 6, told)
            cause = self.supervisor.check(now_s, [force], [arm], [], 0.0, 1e-6, phase)
        return cause

    def ramp(
        self, force_n: float, arm_n: Any, phase: int = HOLD, ticks: int = 3000
    ) -> Cause | None:
        """Up to these as slowly as no other rule minds."""
        cause = None
        for step in range(ticks):
            part = step / ticks
            cause = cause or self.press(part * force_n, [part * n for n in arm_n], 1, phase)
        return cause or self.press(force_n, arm_n, 200, phase)


ERROR_N = arm_error_n(TOLERANCE_N, RELATIVE, 200.0)


def test_each_component_may_err_by_the_tolerance_of_the_second_channel() -> None:
    assert arm_error_n(11.0, 0.03, -100.0) == pytest.approx(math.hypot(14.0, 14.0))


@pytest.mark.parametrize("turn", [(1.0, 0.0), (0.0, -1.0), (-0.6, 0.8)])
@pytest.mark.parametrize(("beyond_n", "stops"), [(-2.0, False), (2.0, True)])
def test_the_share_that_the_arm_surely_feels_stops_the_run(
    turn: tuple[float, float], beyond_n: float, stops: bool
) -> None:
    across_n = 0.3 * 200.0 + ERROR_N + beyond_n
    cause = Feed().ramp(200.0, (across_n * turn[0], across_n * turn[1], 200.0))
    assert (cause is not None) is stops
    if cause is not None:
        assert (cause.rule, cause.unit) == ("R12", "%")
        assert "by the arm's own wrench" in cause.message


@pytest.mark.parametrize(("beyond_n", "stops"), [(-2.0, False), (2.0, True)])
def test_the_whole_force_that_the_arm_surely_feels_stops_the_run(
    beyond_n: float, stops: bool
) -> None:
    """In an approach no share is judged, and no share limits the resultant."""
    across_n = math.sqrt(LIMITS.force_limit_n**2 - 200.0**2) + ERROR_N + beyond_n
    assert across_n - ERROR_N > LIMITS.touch_force_n
    cause = Feed().ramp(200.0, (across_n, 0.0, 200.0), SEARCH, ticks=800)
    assert (cause is not None) is stops
    if cause is not None:
        assert cause.rule in ("R1", "R2")
        assert "the whole force" in cause.message


def test_the_zero_of_the_arm_is_taken_with_the_others() -> None:
    zero = (40.0, -30.0, 5.0)
    feed = Feed(zero=zero)
    assert feed.supervisor.arm.side.across_n == pytest.approx(0.0, abs=1e-6)
    assert feed.press(0.0, zero, 50) is None


def test_a_share_of_the_arm_alone_does_not_stop_a_retract() -> None:
    feed = Feed()
    assert feed.ramp(20.0, (20.0, 0.0, 20.0)) is None
    for step in range(100):
        force_n = 20.0 - 0.1 * step
        assert feed.press(force_n, (20.0 + 0.1 * step, 0.0, force_n), 1, RETRACT) is None
    assert feed.press(10.0, (30.0, 0.0, 10.0), 300, RETRACT) is None
    cause = feed.press(10.0, (30.0, 0.0, 10.0), 300, HOLD)
    assert cause is not None
    assert cause.rule == "R12"


def test_an_arm_that_tells_its_force_along_the_press_alone_is_judged_as_ever() -> None:
    feed = Feed(zero=(NAN, NAN, 0.0))
    assert feed.ramp(200.0, (NAN, NAN, 200.0)) is None
    assert not feed.supervisor.arm.side.told


def test_a_wrench_that_was_told_and_is_no_number_stops_the_run() -> None:
    cause = Feed().press(0.0, (NAN, 0.0, 0.0))
    assert cause is not None
    assert cause.rule == "R4"


def test_an_arm_that_is_not_the_second_channel_is_not_believed() -> None:
    feed = Feed(replace(LIMITS, cross_check=""))
    assert feed.ramp(200.0, (300.0, 0.0, 0.0)) is None
