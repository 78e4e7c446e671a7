"""The doctor's motions: slow, short, away from the plate; what does not stop is found."""

from __future__ import annotations

import math
from itertools import pairwise
from types import SimpleNamespace

import pytest
from bench_fakes import FakeArm, Rig
from run_plans import ur_plan

from stepload.errors import DeviceError
from stepload.record.lag import Lag
from stepload.rig.device import StopProof
from stepload.setup import motion
from stepload.setup.check_line import Mark


class StopArm(FakeArm):
    """Comes to rest so far and so late after it was told to stop, and creeps on."""

    def __init__(self, rig, took_s=0.02, on_m=0.0, creep_m_s=0.0, noise_m=5e-6, silent=False):
        super().__init__(rig)
        self.took_s, self.on_m, self.creep_m_s = took_s, on_m, creep_m_s
        self.noise_m, self.silent, self.safe_at_s = noise_m, silent, math.inf

    def drain(self):
        now_s = self.rig.clock.now_s()
        crept_m = self.creep_m_s * max(0.0, now_s - self.safe_at_s)
        off_m = self.rig.random.gauss(0.0, self.noise_m) - crept_m
        if self.silent and self.safe_at_s < math.inf:
            return []
        return [s._replace(position_m=s.position_m + off_m) for s in super().drain()]

    def safe(self, timeout_s):
        super().safe(timeout_s)
        clock = self.rig.clock
        clock.sleep_until(clock.now_s() + self.took_s)
        self.safe_at_s = clock.now_s()
        self.rig.position_m -= self.on_m


def opened(arm):
    return SimpleNamespace(arm=arm, clock=arm.rig.clock)


def stopped(**how):
    rig = Rig()
    return motion.check_stop(opened(StopArm(rig, **how))), rig


def test_the_arm_is_stopped_on_a_slow_way_back():
    line, rig = stopped(noise_m=0.0)
    assert line.mark is Mark.OK
    assert rig.safe_calls == 1
    assert max(rig.targets) <= 0.0
    assert min(rig.targets) == pytest.approx(-1e-3, abs=2e-5)
    assert max(a - b for a, b in pairwise(rig.targets)) * rig.rate_hz == pytest.approx(4e-3)


@pytest.mark.parametrize(
    ("how", "mark", "what"),
    [
        ({}, Mark.OK, "confirmed after 20 ms"),
        ({"noise_m": 2e-5}, Mark.OK, "confirmed"),
        ({"creep_m_s": 5e-4}, Mark.FAIL, "still moving"),
        ({"creep_m_s": -5e-4}, Mark.FAIL, "still moving"),
        ({"on_m": 1e-3}, Mark.WARN, "travelled on"),
        ({"on_m": 3e-3}, Mark.FAIL, "travelled on"),
        ({"took_s": 1.0}, Mark.WARN, "confirmed after 1000 ms"),
        ({"took_s": 2.5}, Mark.FAIL, "confirmed after 2500 ms"),
        ({"took_s": 2.5, "on_m": 1e-3}, Mark.FAIL, "confirmed after 2500 ms"),
        ({"silent": True}, Mark.FAIL, "too few positions"),
    ],
)
def test_a_stop_is_judged_by_way_time_and_rest(how, mark, what):
    line, _ = stopped(**how)
    assert (line.name, line.mark) == ("arm: stop", mark)
    assert what in line.message


def test_a_stop_that_is_not_confirmed_fails(monkeypatch):
    def deaf(arm, timeout_s):
        raise DeviceError("no answer", code="refused_command", hint="")

    monkeypatch.setattr(StopArm, "safe", deaf)
    line, _ = stopped()
    assert line.mark is Mark.FAIL
    assert "not confirmed: no answer" in line.message


@pytest.mark.parametrize(
    ("still_s", "mark"), [(1.0, Mark.OK), (2.0, Mark.WARN), (4.0, Mark.FAIL), (math.nan, Mark.FAIL)]
)
def test_the_watchdog_is_proven_on_a_short_slow_way(still_s, mark):
    requested = []

    def prove_stop(*how):
        requested.append(how)
        return StopProof(0.5, still_s, 1e-3)

    line = motion.check_watchdog(opened(SimpleNamespace(prove_stop=prove_stop, rig=Rig())))
    assert line.mark is mark
    [(way_m, speed_m_s, _)] = requested
    assert way_m == pytest.approx(2e-3)
    assert speed_m_s == pytest.approx(4e-3)


def test_a_watchdog_that_does_not_act_fails():
    def prove_stop(*how):
        raise DeviceError("it goes on", code="driver", hint="see the pendant")

    line = motion.check_watchdog(opened(SimpleNamespace(prove_stop=prove_stop, rig=Rig())))
    assert (line.mark, line.message) == (Mark.FAIL, "it goes on")


@pytest.mark.parametrize(
    ("times", "mark"), [(1.0, Mark.OK), (1.2, Mark.WARN), (1.5, Mark.FAIL), (math.nan, Mark.FAIL)]
)
def test_the_response_is_the_plans(monkeypatch, times, mark):
    plan = ur_plan()
    arm = plan.rig.arm
    planned_s = arm.command_delay_s + arm.lag_s + 2.0 / arm.rate_hz
    lag = Lag(times * planned_s, 1e-5, "no ramp tells")
    monkeypatch.setattr(motion, "response_lag", lambda rig: lag)
    line, told_s = motion.check_response(plan, opened(StopArm(Rig())))
    assert line.mark is mark
    assert (told_s is None) == math.isnan(times)
