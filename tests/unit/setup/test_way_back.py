"""Between its motions the doctor goes back to where it began: their ways do not add up."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from bench_fakes import FakeArm, Rig
from run_plans import stvf_plan

from stepload.feasibility.preflight import preflight_of
from stepload.setup import checkup, motion
from stepload.setup.check_line import CheckLine, Mark

START_M = 1e-3
OK = CheckLine("arm: motion", Mark.OK, 0.0, 0.0, "", "")


def test_it_goes_back_after_each_motion(monkeypatch):
    done = []
    monkeypatch.setattr(motion, "position_now", lambda rig: START_M)
    monkeypatch.setattr(motion, "check_held", lambda plan, rig: done.append("check_held") or OK)
    for name in ("check_stop", "check_watchdog"):
        monkeypatch.setattr(motion, name, lambda rig, name=name: done.append(name) or OK)
    monkeypatch.setattr(
        motion, "check_response", lambda plan, rig: done.append("swing") or (OK, None)
    )
    monkeypatch.setattr(motion, "return_to", lambda rig, to_m: done.append(to_m))
    exam = SimpleNamespace(plan=None, add=lambda line: None, failed=lambda *names: False)
    checkup._motion(exam, None)
    assert done == [
        "check_held",
        "check_stop",
        START_M,
        "check_watchdog",
        START_M,
        "swing",
        START_M,
    ]


def test_an_arm_that_is_held_elsewhere_is_not_moved(monkeypatch):
    """The first command would move it by the difference."""
    arm = SimpleNamespace(held_m=lambda: START_M - 0.06e-3)
    monkeypatch.setattr(motion, "position_now", lambda rig: START_M)
    monkeypatch.setattr(motion, "drive", lambda *_: pytest.fail("moved"))
    plan = stvf_plan()
    exam = checkup._Examination(preflight_of(plan), lambda line: None)
    checkup._motion(exam, SimpleNamespace(arm=arm))
    assert [line.mark for line in exam.lines] == [Mark.FAIL, Mark.SKIPPED]
    assert exam.lines[0].value == pytest.approx(0.06e-3)
    assert exam.lines[0].limit == plan.rig.arm.model_tolerance_m


def test_the_arm_is_brought_back_to_where_the_examination_began(monkeypatch):
    truth = Rig(position_m=2e-4)
    rig = SimpleNamespace(arm=FakeArm(truth), clock=truth.clock)

    def back(_rig):
        truth.position_m -= 2e-3
        return OK

    monkeypatch.setattr(motion, "check_stop", back)
    monkeypatch.setattr(motion, "check_held", lambda _plan, _rig: OK)
    monkeypatch.setattr(motion, "check_watchdog", back)
    monkeypatch.setattr(motion, "check_response", lambda plan, rig: (OK, None))
    exam = checkup._Examination(SimpleNamespace(plan=None), lambda line: None)
    checkup._motion(exam, rig)
    assert truth.position_m == pytest.approx(2e-4, abs=1e-6)
    assert max(truth.targets) <= 2e-4 + 1e-9
    steps = [b - a for a, b in zip(truth.targets, truth.targets[1:], strict=False)]
    assert max(steps) <= motion.SPEED_M_S * FakeArm(truth).period_s * 1.01
