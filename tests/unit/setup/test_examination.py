"""The whole examination: nothing moves after what failed, and the arm is always told to stop."""

from __future__ import annotations

import math
from contextlib import contextmanager
from types import SimpleNamespace

import pytest
from run_plans import stvf_plan

from stepload.errors import DeviceError
from stepload.feasibility.preflight import preflight_of
from stepload.rig.samples import ArmSample, ForceSample
from stepload.setup import checkup, host, motion
from stepload.setup.check_line import CheckLine, Mark
from stepload.setup.streams import Watched

ENVELOPE = preflight_of(stvf_plan())
MOVES = ("check_stop", "check_watchdog", "check_response")


def line(name, mark=Mark.OK):
    return CheckLine(name, mark, 0.0, 0.0, "", "")


class Bench:
    """A rig of which everything is sound but the lines of `failing`; says what was done."""

    def __init__(self, monkeypatch, *failing, fault=None, opens=True):
        self.done, self.failing = [], failing
        device = SimpleNamespace(
            safe=lambda timeout_s: self.done.append("safe"), fault=lambda: fault
        )
        rig = SimpleNamespace(
            arm=device, force=device, second_force=None, displacement=None, identities={},
            clock=SimpleNamespace(virtual=True),
        )  # fmt: skip

        @contextmanager
        def opened(preflight, dry_run):
            if not opens:
                raise DeviceError("nobody answers", code="not_connected", hint="power")
            yield rig
            self.done.append("closed")

        def at_rest(exam, rig, seconds):
            names = ("force: data", "arm: data", "arm: status", "arm: longest age")
            exam.add(*(self.line(name) for name in names))

        monkeypatch.setattr(checkup, "opened", opened)
        monkeypatch.setattr(checkup, "_at_rest", at_rest)
        monkeypatch.setattr(host, "check_disk", lambda plan: self.line("disk space"))
        monkeypatch.setattr(motion, "position_now", lambda rig: 0.0)
        monkeypatch.setattr(motion, "return_to", lambda rig, to_m: None)
        monkeypatch.setattr(motion, "check_held", lambda plan, rig: self.line("arm: held"))
        monkeypatch.setattr(motion, "check_stop", lambda rig: self.moved("check_stop"))
        monkeypatch.setattr(motion, "check_watchdog", lambda rig: self.moved("check_watchdog"))
        monkeypatch.setattr(
            motion, "check_response", lambda plan, rig: (self.moved("check_response"), 5e-3)
        )

    def line(self, name):
        return line(name, Mark.FAIL if name in self.failing else Mark.OK)

    def moved(self, what):
        self.done.append(what)
        return self.line(what.replace("check_", "arm: "))

    def examine(self, **how):
        how = {"still": False, "seconds": 1.0, **how}
        return checkup.examine(ENVELOPE, dry_run=False, tell=lambda line: None, **how)


def test_a_sound_rig_is_moved_and_told_to_stop(monkeypatch):
    bench = Bench(monkeypatch)
    assert not bench.examine().failed
    assert bench.done == [*MOVES, "safe", "closed"]


@pytest.mark.parametrize("name", ["arm: data", "arm: status", "arm: longest age", "arm: held"])
def test_nothing_moves_where_the_arm_is_not_sound_at_rest(monkeypatch, name):
    bench = Bench(monkeypatch, name)
    assert bench.examine().failed
    assert bench.done == ["safe", "closed"]


@pytest.mark.parametrize(("name", "moves"), [("arm: stop", 1), ("arm: watchdog", 2)])
def test_an_arm_that_did_not_stop_is_not_moved_again(monkeypatch, name, moves):
    bench = Bench(monkeypatch, name)
    back = []
    monkeypatch.setattr(motion, "return_to", lambda rig, to_m: back.append(to_m))
    assert bench.examine().failed
    assert bench.done == [*MOVES[:moves], "safe", "closed"]
    assert len(back) == moves - 1


def test_still_moves_nothing(monkeypatch):
    bench = Bench(monkeypatch)
    bench.examine(still=True)
    assert bench.done == ["safe", "closed"]


def test_whatever_ends_the_examination_the_arm_is_told_to_stop(monkeypatch):
    bench = Bench(monkeypatch)

    def interrupted(rig):
        raise KeyboardInterrupt

    monkeypatch.setattr(motion, "check_watchdog", interrupted)
    with pytest.raises(KeyboardInterrupt):
        bench.examine()
    assert bench.done[-1] == "safe"


def seen_of(force_n, number=1000):
    """A sensor that reads `force_n` at each index, and an arm at rest."""
    arm = [ArmSample(i, math.nan, 1e-3 * i, 0, 1e-6 * (i % 3), float(i % 7), (0.0,) * 6)
           for i in range(number)]  # fmt: skip
    force = [
        ForceSample(i, math.nan, 1e-3 * i, 0, (0.0, 0.0, force_n(i), 0.0, 0.0, 0.0), math.nan)
        for i in range(number)
    ]
    return Watched(
        samples={"arm": arm, "force": force}, ages_s={"arm": [0.0], "force": [0.0]},
        lost={"arm": 0, "force": 0}, errors={"arm": {}, "force": {}},
    )  # fmt: skip


def figures_of(force_n):
    exam = checkup._Examination(ENVELOPE, lambda line: None)
    checkup._data(exam, seen_of(force_n), 1.0)
    return exam.figures


def test_the_drift_that_is_offered_is_an_upper_bound():
    drift, unit, remark = figures_of(lambda i: 1e-4 * i + 0.5 * (i % 2))["force", "drift"]
    noise = 0.25 / math.sqrt(1000 / 12)  # of the slope, over one second
    assert drift == pytest.approx(0.1 + 2.0 * noise, rel=0.05)
    assert (unit, remark) == ("N/s", "upper bound from 1 s")
