"""The time that is left of a run."""

from __future__ import annotations

import pytest
from run_plans import preflight_for, stvf_plan

from stepload.feasibility.remaining import Remaining
from stepload.record.rows import Phase, TickRow

STEP_S = 4.0


def row(time_s: float, phase: Phase, step: int, cycle: int = 1) -> TickRow:
    return TickRow(time_s, 0.0, 1.0, 1.0, 1.0, 99.0, 1e-7, 1.0, 0.0, int(phase), cycle, step)


def test_the_whole_schedule_is_left_at_the_first_tick() -> None:
    for unload in (True, False):
        plan = stvf_plan(cycles=3, unload=unload, step_n=100.0, top_force_n=300.0)
        preflight = preflight_for(plan)
        left = Remaining(preflight.stages, plan.procedure)
        assert left.at(row(5.0, Phase.WARM_UP, 0)) == pytest.approx(preflight.duration_s)


def test_the_last_touch_counts_down_where_its_retract_was_not_shown() -> None:
    plan = stvf_plan(cycles=1, unload=False, step_n=100.0, top_force_n=300.0)
    left = Remaining(preflight_for(plan).stages, plan.procedure)
    for step in (1, 2, 3):
        left.at(row(10.0 + STEP_S * step, Phase.LOAD, step))
    begun_s = left.at(row(30.0, Phase.FAST_APPROACH, 0))
    assert left.at(row(31.0, Phase.FAST_APPROACH, 0)) == pytest.approx(begun_s - 1.0)
