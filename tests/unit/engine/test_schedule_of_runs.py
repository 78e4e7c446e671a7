"""The schedule that preflight prints, beside what a dry run takes."""

from __future__ import annotations

from typing import Any

import pytest
from run_bench import bench_for, run
from run_plans import envelope_for, stvf_plan

QUICK = {"touches": 2, "tare_s": 0.5, "hold_s": 0.5, "top_force_n": 100.0}
BAND = (0.85, 1.2)
"""Time of the run over the time told. How a level creeps beyond its hold is not known before."""


@pytest.mark.parametrize(
    "procedure",
    [
        {"cycles": 1, "retract_m": 3e-3},
        {"cycles": 3, "retract_m": 2e-3, "unload": False},
        {"cycles": 2, "lift_off": False},
    ],
    ids=["far retract", "lift-off", "in contact"],
)
def test_a_dry_run_takes_the_time_that_was_told(procedure: dict[str, Any]) -> None:
    plan = stvf_plan(**(QUICK | procedure))
    bench = bench_for(plan, 727.0)
    engine = run(bench)
    assert engine.course.done
    took_s = bench.ticks * bench.rig.arm.period_s
    assert BAND[0] < took_s / envelope_for(plan, 727.0).duration_s < BAND[1]
