"""What fault campaigns found and what was mended: smallest cases, each of which failed before."""

from __future__ import annotations

from dataclasses import replace

import pytest
from run_bench import bench_for, run, spec_for
from run_plans import stvf_plan, ur_plan

from stepload.plan.model import Plan, SecondForce, SecondForceSource
from stepload.run.limits import SECOND_IDENTICAL_COUNTS, derive_limits
from stepload.run.loop import RunStatus, run_loop

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
    assert derive_limits(quiet, elastic_limit_n=727.0).second_identical_counts == 0
    fine = with_second_sensor(plan, resolution_n=0.0, noise_n=0.05)
    assert derive_limits(fine, elastic_limit_n=727.0).second_identical_counts == (
        SECOND_IDENTICAL_COUNTS
    )


def test_an_approach_too_slow_to_see_between_two_looks_is_progress() -> None:
    plan = ur_plan(**QUICK, touch_force_n=2.0)
    arm = replace(plan.rig.arm, position_resolution_m=30e-6)
    limits = derive_limits(replace(plan, rig=replace(plan.rig, arm=arm)), elastic_limit_n=727.0)
    plan = replace(plan, rig=replace(plan.rig, arm=arm))
    bench = bench_for(plan, 727.0, spec_for(plan, 3))
    slow = replace(limits, guarded_speed_m_s=40e-6)
    bench.engine = type(bench.engine)(plan, slow, bench.operator)
    engine = run(bench, 40.0)
    assert engine.cause is None
    assert engine.procedure.touches


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
