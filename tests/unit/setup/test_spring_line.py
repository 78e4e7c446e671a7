"""T against a spring: only of a plan that may be pressed, only of a run that was completed."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest
from run_plans import stvf_plan

from stepload.engine.operator import Operator
from stepload.feasibility.preflight import preflight_of
from stepload.feasibility.reason import PlanVerdict
from stepload.record.lag import Lag
from stepload.record.outcome import RunStatus
from stepload.setup import loop_delay
from stepload.setup.check_line import Mark

ENVELOPE = preflight_of(stvf_plan())
RIG = SimpleNamespace(arm=SimpleNamespace(period_s=1e-3), identities={})


def checked(monkeypatch, status=RunStatus.COMPLETED, lag=None, refused=False):
    lag = lag or Lag(ENVELOPE.bounds.loop_s - 2e-3, 1e-3, "no ramp tells")
    runs = []

    def run_loop(engine, rig, memory, identities):
        runs.append(engine)
        return SimpleNamespace(status=status, why="stopped: R1")

    if refused:
        gentle = SimpleNamespace(verdict=PlanVerdict.REFUSED, reasons=())
        monkeypatch.setattr(loop_delay, "preflight_of", lambda plan: gentle)
    monkeypatch.setattr(loop_delay, "run_loop", run_loop)
    monkeypatch.setattr(loop_delay, "Engine", lambda preflight, operator: preflight)
    monkeypatch.setattr(loop_delay, "force_lag", lambda memory, axis: lag)
    return *loop_delay.check_spring(ENVELOPE, RIG, Operator()), runs


def test_what_is_offered_is_an_upper_bound(monkeypatch):
    line, loop_s, _ = checked(monkeypatch)
    assert line.mark is Mark.OK
    assert line.value == pytest.approx(ENVELOPE.bounds.loop_s - 1e-3)
    assert loop_s == pytest.approx(line.value + 2e-3)


def test_what_is_pressed_is_the_plans_top_force_in_small_steps(monkeypatch):
    _, _, [pressed] = checked(monkeypatch)
    planned = ENVELOPE.plan.procedure
    assert pressed.plan.procedure.top_force_n == planned.top_force_n
    assert max(pressed.plan.procedure.levels_n) == pytest.approx(planned.top_force_n)


def test_a_plan_that_preflight_refuses_is_not_pressed(monkeypatch):
    line, loop_s, runs = checked(monkeypatch, refused=True)
    assert (line.mark, loop_s, runs) == (Mark.FAIL, None, [])


@pytest.mark.parametrize(
    "how", [{"status": RunStatus.STOPPED}, {"lag": Lag(math.nan, math.inf, "no ramp tells")}]
)
def test_nothing_is_offered_of_a_run_that_tells_nothing(monkeypatch, how):
    line, loop_s, _ = checked(monkeypatch, **how)
    assert (line.mark, loop_s) == (Mark.FAIL, None)
