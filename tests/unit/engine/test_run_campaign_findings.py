"""What fault campaigns found and what was mended: smallest cases, each of which failed before."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st
from long_ones import long
from run_bench import bench_for, run, spec_for
from run_plans import STEEL, limits_for, preflight_for, stvf_plan, ur_plan

from stepload.engine.controller import Lead
from stepload.engine.loop import run_loop
from stepload.engine.supervisor import Supervisor
from stepload.engine.tick import Engine
from stepload.feasibility.limits import SECOND_IDENTICAL_COUNTS
from stepload.plan.model import Plan, SecondForce, SecondForceSource
from stepload.record.outcome import RunStatus
from stepload.record.rows import Phase, TickRow
from stepload.rig.samples import ArmSample, ForceSample
from stepload.rig.world import WorldFault

QUICK = {"touches": 1, "tare_s": 0.2, "hold_s": 0.2, "settle_timeout_s": 0.3, "top_force_n": 100.0}


def with_second_sensor(plan: Plan, resolution_n: float, noise_n: float) -> Plan:
    sensor = replace(plan.rig.force, resolution_n=resolution_n, noise_n=noise_n)
    second = SecondForce(SecondForceSource.SENSOR, 4.0, 0.03, 0.02, noise_n, sensor)
    return replace(plan, rig=replace(plan.rig, second_force=second))


def test_a_second_sensor_quieter_than_its_resolution_is_not_called_frozen() -> None:
    plan = with_second_sensor(stvf_plan(**QUICK), resolution_n=0.3, noise_n=0.05)
    bench = bench_for(plan, 727.0)
    assert run(bench, 30.0).cause is None
    assert bench.limits.second_identical_counts > SECOND_IDENTICAL_COUNTS
    quiet = with_second_sensor(plan, resolution_n=0.3, noise_n=0.01)
    assert limits_for(quiet, 727.0).second_identical_counts == 0
    fine = with_second_sensor(plan, resolution_n=0.0, noise_n=0.05)
    assert limits_for(fine, 727.0).second_identical_counts == (SECOND_IDENTICAL_COUNTS)


def test_an_approach_too_slow_to_see_between_two_looks_is_progress() -> None:
    plan = ur_plan(**QUICK, touch_force_n=2.0)
    arm = replace(plan.rig.arm, position_resolution_m=30e-6)
    plan = replace(plan, rig=replace(plan.rig, arm=arm))
    preflight = preflight_for(plan)
    bench = bench_for(plan, 727.0, spec_for(plan, 3))
    slow = replace(preflight.run_limits, guarded_speed_m_s=40e-6)
    bench.engine = Engine(replace(preflight, limits=slow), bench.operator)
    engine = run(bench, 40.0)
    assert engine.cause is None
    assert engine.course.touches


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, MemoryError])
def test_an_exception_while_the_end_is_recorded_does_not_lose_the_outcome(
    error: type[BaseException],
) -> None:
    class Recorder:
        force = second_force = arm = displacement = tick = staticmethod(lambda _: None)

        def event(self, *_: object) -> None:
            raise error

        def problem(self) -> str:
            return ""

    bench = bench_for(stvf_plan(**QUICK))
    for device in (bench.rig.arm, bench.rig.force):
        device.open(1.0)
    outcome = run_loop(bench.engine, bench.rig, Recorder())
    assert outcome.status is RunStatus.STOPPED
    assert [action.name for action in outcome.safing][-2:] == ["arm stop", "force sensor"]


def heavy_plan() -> Plan:
    """A heavy, slow, stiff machine that presses gently."""
    near = {"surface_distance_m": 1e-3, "surface_uncertainty_m": 5e-5, "retract_m": 1e-4}
    plan = stvf_plan(**{**QUICK, **near, "top_force_n": 60.0, "step_n": 30.0, "max_drift_n": 1.0})
    arm = replace(
        plan.rig.arm, effective_mass_kg=40.0, max_acceleration_m_s2=0.65, command_delay_s=0.002,
        lag_s=0.003, position_resolution_m=7e-7, position_noise_m=2.5e-7,
    )  # fmt: skip
    second = SecondForce(SecondForceSource.ARM, 4.0, 0.03, 0.02, 0.3)
    payload = replace(plan.payload, material=STEEL, declared_force_limit_n=95.0)
    return replace(plan, payload=payload, rig=replace(plan.rig, arm=arm, second_force=second))


class Healthy(NamedTuple):
    """How the heavy machine presses where nothing fails: its first touch, all its ticks."""

    touch_s: float
    rows: list[TickRow]


@pytest.fixture(scope="module")
def healthy() -> Healthy:
    plan = heavy_plan()
    rows: list[TickRow] = []
    engine = run(bench_for(plan, 95.0, spec_for(plan, 4)), 60.0, rows)
    return Healthy(engine.course.touches[0].time_s, rows)


@pytest.mark.parametrize("share", [0.6, *long((0.3, 0.9))])
def test_commands_held_back_and_delivered_at_once_do_not_ram_the_surface(
    healthy: Healthy, share: float
) -> None:
    plan = heavy_plan()
    elastic_limit_n = 95.0
    spec = spec_for(plan, 4)
    touch_s = healthy.touch_s
    held_s = 0.2
    fault = WorldFault("command_latency", touch_s - share * held_s, 0.002, held_s)
    bench = bench_for(plan, elastic_limit_n, replace(spec, faults=(fault,)))
    run(bench, 60.0)
    assert bench.peak_n < elastic_limit_n


@pytest.mark.long
def test_an_arm_that_does_not_follow_is_waited_for(healthy: Healthy) -> None:
    plan = heavy_plan()
    spec = spec_for(plan, 4)
    touch_s = healthy.touch_s
    fault = WorldFault("command_latency", touch_s - 0.3, 0.002, 0.25)
    bench = bench_for(plan, 95.0, replace(spec, faults=(fault,)))
    rows: list[TickRow] = []
    run(bench, 60.0, rows)
    still = [row.target_m for row in rows if touch_s - 0.15 < row.time_s < touch_s - 0.06]
    assert max(still) - min(still) < 2e-6  # 11 um at the guarded speed


@pytest.mark.parametrize("eighth", [3, *long((0, 1, 2, 4, 5, 6, 7))])
def test_commands_delivered_at_once_in_contact_stay_below_the_elastic_limit(
    healthy: Healthy, eighth: int
) -> None:
    plan = heavy_plan()
    loading = [row.time_s for row in healthy.rows if row.phase == Phase.LOAD]
    fault = WorldFault("command_latency", loading[len(loading) * eighth // 8], 0.002, 0.2)
    bench = bench_for(plan, 95.0, replace(spec_for(plan, 4), faults=(fault,)))
    run(bench, 60.0)
    assert bench.peak_n < 95.0


@given(steps=st.lists(st.floats(-1e-5, 1e-4), min_size=1, max_size=200))
def test_a_target_is_never_further_ahead_than_allowed(steps: list[float]) -> None:
    lead = Lead(1e-3)
    lead.begin(0.0)
    target_m = 0.0
    for step_m in steps:
        target_m += step_m
        target_m -= lead.excess(target_m, 0.0, 2e-5)
        assert target_m <= 1.5 * 2e-5


def slow_start_after_a_fast_move(fast_ms: int, frozen: bool) -> Supervisor:
    """20 mm/s back, a rest, 0.7 mm/s on; the arm lags 5 ms more than it is believed to."""
    supervisor = Supervisor(limits_for(stvf_plan(), 727.0), "-fz")
    target = position = 0.0
    rows = [(fast_ms, -20e-6), (500, 0.0), (200, 0.7e-6)]
    speeds = [speed for count, speed in rows for _ in range(count)]
    for index, speed in enumerate(speeds):
        target += speed
        if not (frozen and index >= fast_ms + 500):
            position += (target - position) / 12.0
        time_s, wiggle = index * 1e-3, 1e-9 * (index % 7)
        wrench = (0.0, 0.0, 0.01 * (index % 7), 0.0, 0.0, 0.0)
        pose = (0.0, 0.0, -position, 0.0, 0.0, 0.0)
        force = ForceSample(index, time_s, time_s, 0, wrench, math.nan)
        arm = ArmSample(index, time_s, time_s, 0, position + wiggle, wrench[2], pose)
        supervisor.check(time_s, [force], [arm], (), target, 1e-6, Phase.HOLD)
    return supervisor


def test_where_an_arm_was_in_fast_motion_does_not_judge_its_next_slow_start() -> None:
    for fast_ms in range(60, 90):
        assert slow_start_after_a_fast_move(fast_ms, frozen=False).cause is None


def test_an_arm_that_does_not_start_after_a_rest_is_seen() -> None:
    cause = slow_start_after_a_fast_move(75, frozen=True).cause
    assert cause is not None
    assert cause.rule == "R7"
    assert cause.time_s < 0.75
