"""The schedule that preflight prints, beside what a dry run takes."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest
from long_ones import long
from run_bench import Bench, bench_for, run, spec_for
from run_plans import preflight_for, stvf_plan, ur_plan

from stepload.engine.operator import Operator
from stepload.engine.tick import Engine
from stepload.feasibility.preflight import derive
from stepload.feasibility.schedule import AGAIN
from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.plan.shipped import plan_path
from stepload.record.rows import Phase, TickRow
from stepload.rig.world import load_world

QUICK = {"touches": 2, "tare_s": 0.5, "hold_s": 0.5, "top_force_n": 100.0}
WITHIN = 0.1


@pytest.mark.parametrize(
    "procedure",
    [
        {"cycles": 3, "retract_m": 2e-3, "unload": False},
        *long(
            [
                {"cycles": 1, "retract_m": 3e-3},
                {"cycles": 2, "lift_off": False},
            ]
        ),
    ],
    ids=["lift-off", "far retract", "in contact"],
)
def test_a_dry_run_takes_the_time_that_was_told(procedure: dict[str, Any]) -> None:
    plan = stvf_plan(**(QUICK | procedure))
    bench = bench_for(plan, 727.0)
    engine = run(bench)
    assert engine.course.done
    took_s = bench.ticks * bench.rig.arm.period_s
    assert took_s == pytest.approx(preflight_for(plan, 727.0).duration_s, rel=WITHIN)


@pytest.mark.parametrize("touches", [1, *long([3])])
def test_a_short_free_way_costs_a_way_back_and_a_touch_that_are_counted(touches: int) -> None:
    short = {"surface_distance_m": 2e-5, "surface_uncertainty_m": 1e-5, "retract_m": 0.02}
    plan = ur_plan(**(QUICK | short | {"touches": touches, "search_distance_m": 2e-2}))
    bench, preflight = bench_for(plan, 727.0), preflight_for(plan, 727.0)
    stages = preflight.stages
    assert preflight.limits is not None
    way_m = preflight.limits.shows_m(0.02)
    rows: list[TickRow] = []
    engine = run(bench, 600.0, rows)
    assert engine.course.done
    assert engine.cause is None
    [again] = [stage for stage in stages if stage.name == AGAIN]
    touched = [touch.purpose for touch in engine.course.touches]
    assert touched == ["first", *["again"] * again.repeats, "last"]
    assert again.repeats == max(touches, 2) - 1
    back = [row.target_m for row in rows if row.phase == Phase.TOUCH_RETRACT]
    assert min(back) <= engine.course.touches[0].position_m - way_m
    first_s, *_, last_s = (touch.time_s for touch in engine.course.touches[:-1])
    assert again.total_s == pytest.approx(last_s - first_s, rel=WITHIN)


def pressed_s(plan: Plan, seed: int = 1) -> tuple[float, float]:
    """Time of a whole dry run, and of its longest way up to a level."""
    rig, preflight, operator = load_world()(spec_for(plan, seed)), derive(plan), Operator()
    rows: list[TickRow] = []
    bench = Bench(plan, preflight.run_limits, rig, Engine(preflight, operator), operator)
    assert run(bench, 1500.0, rows).course.done
    up = Counter((row.cycle, row.step) for row in rows if row.phase == Phase.LOAD)
    return bench.ticks * rig.arm.period_s, max(up.values()) * rig.arm.period_s


@pytest.mark.parametrize("name", ["campaign", *long(("plastic-sphere", "ur5e-silicone-sphere"))])
def test_a_shipped_plan_takes_the_time_that_preflight_prints(name: str) -> None:
    plan = load_plan(plan_path(name))
    assert pressed_s(plan)[0] == pytest.approx(derive(plan).duration_s, rel=WITHIN)
