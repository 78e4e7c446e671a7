"""After the doctor's motions the arm stands where the examination began."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest
from bench_fakes import FakeArm, Rig, VirtualClock

from stepload.setup import checkup, motion
from stepload.setup.check_line import CheckLine, Mark


def test_the_arm_is_brought_back_to_where_the_examination_began(monkeypatch):
    truth = Rig(position_m=2e-4)
    rig = SimpleNamespace(arm=FakeArm(truth), clock=truth.clock)
    assert isinstance(truth.clock, VirtualClock)
    ok = CheckLine("moved", Mark.OK, math.nan, math.nan, "", "")

    def back(_rig):
        truth.position_m -= 2e-3
        return ok

    monkeypatch.setattr(motion, "check_stop", back)
    monkeypatch.setattr(motion, "check_held", lambda _plan, _rig: ok)
    monkeypatch.setattr(motion, "check_watchdog", back)
    monkeypatch.setattr(motion, "check_response", lambda plan, rig: (ok, None))
    exam = checkup._Examination(SimpleNamespace(plan=None), lambda line: None)
    checkup._motion(exam, rig)
    assert truth.position_m == pytest.approx(2e-4, abs=1e-6)
    assert max(truth.targets) <= 2e-4 + 1e-9
    steps = [b - a for a, b in zip(truth.targets, truth.targets[1:], strict=False)]
    assert max(steps) <= motion.SPEED_M_S * FakeArm(truth).period_s * 1.01
