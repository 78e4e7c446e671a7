"""The zero of force is only taken in free air, and what it shows of the sensor is used."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from long_ones import long
from run_bench import Bench, bench_for, run, spec_for
from run_plans import stvf_plan, ur_plan

from stepload.engine.operator import StopLevel
from stepload.engine.tare import TareWindow
from stepload.engine.tick import Engine
from stepload.plan.model import Plan
from stepload.record.rows import Phase, TickRow

F_C = 727.0
QUICK = {"touches": 1, "tare_s": 0.3, "hold_s": 0.2, "settle_timeout_s": 0.3, "top_force_n": 100.0}


def _bench(plan: Plan, **truth: Any) -> Bench:
    return bench_for(plan, F_C, spec_for(plan, 4, **truth))


def _pressed(plan: Plan, force_n: float, softness: float) -> Bench:
    """A rig whose start pose presses about `force_n` onto a payload `softness` times softer."""
    spec = spec_for(plan, 4)
    payload = replace(spec.payload, k=spec.payload.k / softness)
    depth_m = (force_n / payload.k) ** (1.0 / payload.n) + force_n / spec.system_stiffness_n_per_m
    return bench_for(plan, F_C, replace(spec, payload=payload, surface_m=-depth_m))


def _phases(engine: Engine) -> list[str]:
    return [str(data["phase"]) for _, kind, data in engine.events if kind == "phase"]


def _last(engine: Engine, kind: str) -> Mapping[str, Any]:
    return [data for _, name, data in engine.events if name == kind][-1]


@pytest.mark.parametrize("make", [stvf_plan, ur_plan])
@pytest.mark.parametrize("softness", [0.1, *long([1.0]), 300.0])
@pytest.mark.parametrize("force_n", [1.5, 20.0, 50.0, 150.0])
def test_a_start_pose_in_contact_is_found(make: Any, softness: float, force_n: float) -> None:
    bench = _pressed(make(**QUICK), force_n, softness)
    engine = run(bench, 20.0)
    assert engine.cause is not None
    assert engine.cause.rule == "not_free"
    assert engine.cause.value < -engine.cause.limit
    assert "TARE" not in _phases(engine)
    assert engine.safe_reached
    assert bench.peak_n == pytest.approx(force_n, rel=0.02)
    left_n = bench.rig.world.true_force_n
    assert left_n < 0.5 * force_n if softness == 300.0 else left_n == 0.0


def test_room_for_the_drift_of_a_long_cycle_hides_no_start_in_contact() -> None:
    bench = _pressed(ur_plan(**QUICK, max_drift_n=50.0), 20.0, 1.0)
    engine = run(bench, 20.0)
    assert engine.cause is not None
    assert engine.cause.rule == "not_free"
    assert engine.cause.limit == engine.limits.touch_force_n


def test_a_contact_that_the_free_way_cannot_show_is_found_after_the_first_touch() -> None:
    """The back-off of 10 um takes too little off 60 N: they go into the zero."""
    short = {"surface_distance_m": 2e-5, "surface_uncertainty_m": 1e-5, "retract_m": 3e-2}
    bench = _pressed(ur_plan(**QUICK, **short, search_distance_m=2e-2), 60.0, 300.0)
    engine = run(bench, 60.0)
    assert engine.cause is not None
    assert engine.cause.rule == "not_open"
    assert engine.cause.value == pytest.approx(-60.0, abs=1.0)
    assert bench.peak_n < 65.0
    assert bench.rig.world.true_force_n == 0.0


@pytest.mark.parametrize("make", [stvf_plan, ur_plan])
def test_a_surface_just_at_the_start_pose_is_none_and_is_met_within_the_limit(make: Any) -> None:
    bench = _bench(make(**QUICK), surface_m=0.0)
    engine = run(bench, 40.0)
    assert engine.cause is None or engine.cause.rule in ("R1", "R2", "R9")
    assert bench.peak_n < engine.limits.force_limit_n


def test_the_start_pose_is_left_backwards_by_the_stated_distance() -> None:
    rows: list[TickRow] = []
    bench = _bench(stvf_plan(**QUICK))
    engine = run(bench, 3.0, rows)
    backed_off_m = _last(engine, "free_air")["backed_off_m"]
    assert backed_off_m == bench.plan.procedure.retract_m
    free = [row.target_m for row in rows if row.phase == Phase.FREE_AIR]
    assert free == sorted(free, reverse=True)
    assert free[-1] == pytest.approx(free[0] - backed_off_m, abs=1e-9)
    assert next(row.target_m for row in rows if row.phase == Phase.TARE) == free[-1]


def test_contact_that_came_during_a_pause_is_found_on_the_way_back() -> None:
    bench = _bench(stvf_plan(**QUICK))
    plant: Any = bench.rig.world.plant  # type: ignore[attr-defined]
    engine = bench.engine
    real_step = engine.course.step
    moved = [0]

    def step(now_s: float, step_s: float) -> float:
        phase = engine.course.phase
        bench.operator.paused = phase in (Phase.LOAD, Phase.HOLD, Phase.RETRACT, Phase.PAUSED)
        if phase == Phase.PAUSED:
            if plant.force_n < 6.0:
                plant.surface_m -= 2e-8 if plant.force_n else 1e-6
                plant._contact_m = plant.surface_m
                if plant.tip_m > plant.surface_m:
                    plant._begin_in_contact()
            else:
                moved[0] += 1
                bench.operator.paused = moved[0] < 500
        return real_step(now_s, step_s)

    engine.course.step = step  # type: ignore[method-assign]
    run(bench, 30.0)
    assert _phases(engine)[-2:] == ["PAUSED", "FREE_AIR"]
    assert engine.cause is not None
    assert engine.cause.rule == "not_free"
    assert engine.cause.value == pytest.approx(-6.0, abs=1.0)


def test_more_noise_than_planned_moves_every_threshold() -> None:
    bench = _bench(stvf_plan(**QUICK), force_noise_n=0.6)
    engine = run(bench, 30.0)
    planned, found = bench.limits, engine.limits
    assert engine.cause is None
    assert engine.course.levels_done == 2
    assert found.noise_n == pytest.approx(0.6, rel=0.15)
    assert found.jump_n == pytest.approx(10.0 * found.noise_n + 0.1)
    assert found.largest_top_n < planned.largest_top_n
    assert found.guarded_speed_m_s < planned.guarded_speed_m_s
    assert engine.course.limits is found is engine.supervisor._limits
    assert engine.steps.controller._limits is found
    assert _last(engine, "limits")["noise_n"] == found.noise_n


def test_a_plan_that_no_longer_fits_ends_before_the_approach() -> None:
    top_n = 630.0
    plan = stvf_plan(**(QUICK | {"top_force_n": top_n, "step_n": top_n}))
    bench = _bench(plan, force_noise_n=0.6)
    assert bench.limits.largest_top_n > top_n
    engine = run(bench, 30.0)
    assert engine.cause is not None
    assert engine.cause.rule == "no_room"
    assert engine.cause.value == pytest.approx(0.6, rel=0.15)
    assert "628.4 N" in engine.cause.message
    assert "reduce the top force to" in engine.cause.message
    assert _phases(engine)[-1] == "TARE"
    assert bench.peak_n == 0.0


def test_between_cycles_the_new_zero_counts() -> None:
    bench = _bench(stvf_plan(**QUICK, cycles=2, max_drift_n=2.0), force_drift_n_per_s=0.25)
    engine = run(bench, 30.0)
    assert engine.cause is None
    tares = engine.course.tares
    assert len(tares) == 3
    assert engine.supervisor.zero_n == tares[2].mean_n
    assert tares[2].mean_n > tares[1].mean_n + 0.5 > tares[0].mean_n + 1.0


def test_a_zero_that_moves_too_far_within_a_cycle_ends_the_run() -> None:
    bench = _bench(stvf_plan(**QUICK, cycles=2), force_drift_n_per_s=0.3)
    engine = run(bench, 30.0)
    assert engine.cause is not None
    assert engine.cause.rule == "drift"
    assert "within one cycle" in engine.cause.message
    assert engine.course.cycle == 1


def test_a_stop_before_the_approach_backs_off_as_well() -> None:
    for phase in (Phase.WARM_UP, Phase.FREE_AIR, Phase.TARE):
        bench = _bench(stvf_plan(**QUICK))
        course = bench.engine.course
        while course.phase != phase or course.target_m != course.target_m:
            run(bench, 0.01)
        bench.operator.request_stop(StopLevel.AFTER_STEP)
        assert run(bench, 5.0).course.done
        assert course.interrupted
        assert bench.engine.cause is None
        assert _phases(bench.engine)[-2:] == ["RETRACT", "DONE"]
        assert course.target_m <= -bench.plan.procedure.retract_m


def test_long_tares_cost_no_long_tick_and_give_the_regression_line() -> None:
    window, chance = TareWindow(), random.Random(1)
    times = [1000.0 + 1e-3 * i for i in range(2000)]
    values = [5.0 + 0.02 * (t - 1000.0) + chance.gauss(0.0, 0.3) for t in times]
    for time_s, value in zip(times, values, strict=True):
        window.add(time_s, value, math.nan)
    tare = window.result()
    slope, start = np.polyfit(np.array(times) - 1000.0, values, 1)
    rest = np.array(values) - np.polyval([slope, start], np.array(times) - 1000.0)
    assert tare.mean_n == pytest.approx(np.mean(values), rel=1e-12)
    assert tare.slope_n_per_s == pytest.approx(slope, rel=1e-9)
    assert tare.noise_n == pytest.approx(np.sqrt(np.sum(rest**2) / 1998), rel=1e-9)
    assert (tare.samples, tare.duration_s) == (2000, pytest.approx(1.999))
    assert math.isnan(tare.second_mean_n)
    assert tare.sure_slope_n_per_s == 0.0
    assert tare.sure_noise_n < tare.noise_n
