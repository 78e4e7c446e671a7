"""Between its motions the doctor goes back to where it began: their ways do not add up."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from run_plans import stvf_plan

from stepload.envelope.envelope import envelope_of
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
    exam = checkup._Examination(envelope_of(plan), lambda line: None)
    checkup._motion(exam, SimpleNamespace(arm=arm))
    assert [line.mark for line in exam.lines] == [Mark.FAIL, Mark.SKIPPED]
    assert exam.lines[0].value == pytest.approx(0.06e-3)
    assert exam.lines[0].limit == plan.rig.arm.model_tolerance_m


@pytest.mark.parametrize(
    ("off_m", "mark"), [(0.02e-3, Mark.OK), (-0.04e-3, Mark.WARN), (float("nan"), Mark.FAIL)]
)
def test_where_it_is_held_is_graded(monkeypatch, off_m, mark):
    arm = SimpleNamespace(held_m=lambda: START_M + off_m)
    monkeypatch.setattr(motion, "position_now", lambda rig: START_M)
    assert motion.check_held(stvf_plan(), SimpleNamespace(arm=arm)).mark is mark
