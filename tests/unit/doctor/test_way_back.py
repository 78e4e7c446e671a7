"""Between its motions the doctor goes back to where it began: their ways do not add up."""

from __future__ import annotations

from types import SimpleNamespace

from stepload.doctor import checkup, motion
from stepload.doctor.line import Line, Mark

START_M = 1e-3
OK = Line("arm: motion", Mark.OK, 0.0, 0.0, "", "")


def test_it_goes_back_after_each_motion(monkeypatch):
    done = []
    monkeypatch.setattr(motion, "position_now", lambda rig: START_M)
    for name in ("check_stop", "check_watchdog"):
        monkeypatch.setattr(motion, name, lambda rig, name=name: done.append(name) or OK)
    monkeypatch.setattr(
        motion, "check_response", lambda plan, rig: done.append("swing") or (OK, None)
    )
    monkeypatch.setattr(motion, "return_to", lambda rig, to_m: done.append(to_m))
    exam = SimpleNamespace(plan=None, add=lambda line: None, failed=lambda *names: False)
    checkup._motion(exam, None)
    assert done == ["check_stop", START_M, "check_watchdog", START_M, "swing", START_M]
