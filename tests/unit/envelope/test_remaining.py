"""The time left of a run whose loading was ended early is that of a plan with so many levels."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from run_plans import envelope_for, stvf_plan

from stepload.envelope.remaining import Remaining
from stepload.plan.model import Procedure
from stepload.record.rows import Phase, TickRow

STEP_S = 4.0
ENDED = 4


def row(time_s: float, phase: Phase, step: int, cycle: int = 1) -> TickRow:
    return TickRow(time_s, 0.0, 1.0, 1.0, 1.0, 99.0, 1e-7, 1.0, 0.0, int(phase), cycle, step)


def shorter(procedure: Procedure, levels: int) -> Procedure:
    kept = procedure.levels_n[:levels]
    return replace(procedure, levels_n=kept, top_force_n=kept[-1])


@pytest.mark.parametrize("unload", [True, False])
def test_an_early_end_shortens_every_later_cycle(unload: bool) -> None:
    plan = stvf_plan(cycles=3, unload=unload, lift_off=False, step_n=10.0, top_force_n=100.0)
    stages = envelope_for(plan).stages
    ended, planned = (
        Remaining(stages, procedure)
        for procedure in (plan.procedure, shorter(plan.procedure, ENDED))
    )
    up = [row(10.0 + STEP_S * step, Phase.LOAD, step) for step in range(1, ENDED + 1)]
    for each in up:
        assert ended.at(each) > planned.at(each) + STEP_S
    down = row(10.0 + STEP_S * (ENDED + 1), Phase.UNLOAD, ENDED - 1 if unload else 0)
    left_s = ended.at(down)
    assert math.isfinite(left_s)
    assert left_s == pytest.approx(planned.at(down))


def test_the_last_touch_counts_down_where_its_retract_was_not_shown() -> None:
    plan = stvf_plan(cycles=1, unload=False, step_n=100.0, top_force_n=300.0)
    left = Remaining(envelope_for(plan).stages, plan.procedure)
    for step in (1, 2, 3):
        left.at(row(10.0 + STEP_S * step, Phase.LOAD, step))
    begun_s = left.at(row(30.0, Phase.FAST_APPROACH, 0))
    assert left.at(row(31.0, Phase.FAST_APPROACH, 0)) == pytest.approx(begun_s - 1.0)
