"""A wrong sign makes "back" a push: it ends at once, at the least force, and is said."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from long_ones import long
from run_bench import bench_for, run, spec_for
from run_plans import stvf_plan, ur_plan

from stepload.engine.loop import run_loop
from stepload.record.rows import Phase
from stepload.rig.world import WorldFault
from stepload_verify.campaign.incidents import NullRecorder

QUICK = {"touches": 1, "tare_s": 0.2, "hold_s": 0.2, "top_force_n": 50.0, "step_n": 50.0}


def wrong(*kinds: str) -> list[WorldFault]:
    return [WorldFault(kind, 0.0, 600.0, 0.0) for kind in kinds]


def end_of(plan: Any, spec: Any) -> tuple[Any, Any]:
    bench = bench_for(plan, 727.0, spec)
    for device in (bench.rig.arm, bench.rig.force):
        device.open(1.0)
    outcome = run_loop(bench.engine, bench.rig, NullRecorder())
    assert outcome.cause is not None
    return bench, outcome.cause


@pytest.mark.parametrize("make", [stvf_plan, *long([ur_plan])])
@pytest.mark.parametrize("softness", [0.3, 30.0])
@pytest.mark.parametrize("distance_m", [1e-5, 2e-4])
def test_an_arm_that_is_turned_round_is_led_back_to_the_start(
    distance_m: float, softness: float, make: Any
) -> None:
    plan = make(**QUICK, retract_m=1e-3)
    spec = spec_for(plan)
    spec = spec_for(plan, 3, wrong("arm_turned"), surface_m=distance_m,
                    payload=replace(spec.payload, k=spec.payload.k / softness))  # fmt: skip
    bench, cause = end_of(plan, spec)
    assert cause.rule == "pressed_back"
    assert cause.value > cause.limit
    assert bench.rig.world.true_force_n == 0.0
    assert bench.engine.target_m == pytest.approx(bench.engine.course.start_m, abs=1e-9)
    assert bench.peak_n < 0.8 * bench.limits.force_limit_n


@pytest.mark.parametrize("make", [ur_plan, *long([stvf_plan])])
def test_an_arm_and_a_sensor_turned_round_touch_nothing(make: Any) -> None:
    plan = make(**QUICK, retract_m=1e-3)
    least_m = plan.procedure.surface_distance_m - plan.procedure.surface_uncertainty_m
    spec = spec_for(plan, 3, wrong("arm_turned", "force_reversed"), surface_m=1.001 * least_m)
    bench, cause = end_of(plan, spec)
    assert cause.rule == "R8"
    assert bench.peak_n == 0.0


def test_a_start_in_contact_is_left_and_not_gone_back_to() -> None:
    """294 N at the start once read as an arm turned round: the arm pressed again."""
    plan = stvf_plan(**QUICK, retract_m=1e-3)
    spec = replace(spec_for(plan, 3), surface_m=-1e-4)
    bench, cause = end_of(plan, spec)
    assert cause.rule == "not_free"
    assert bench.rig.world.true_force_n == 0.0


@pytest.mark.parametrize("make", [stvf_plan, *long([ur_plan])])
def test_nothing_goes_back_beyond_the_free_way_before_the_first_touch(make: Any) -> None:
    plan = make(**QUICK, retract_m=6e-3)
    bench = bench_for(plan, 727.0)
    rows: list[Any] = []
    while bench.engine.course.phase != Phase.TARE:
        run(bench, 0.05, rows)
    targets_m = [row.target_m for row in rows if row.target_m == row.target_m]
    course, limits = bench.engine.course, bench.limits
    assert course.surface_m != course.surface_m
    assert min(targets_m) == pytest.approx(course.start_m - course.free_m, abs=1e-9)
    steps = pairwise(targets_m)
    fastest_m_s = max(a - b for a, b in steps) / bench.rig.arm.period_s
    assert 0.0 < fastest_m_s <= limits.guarded_speed_m_s * 1.001 < limits.retract_speed_m_s
