"""Sensors from 25 Hz on: sound rigs are not stopped by the cross-check, wrong gains are."""

from __future__ import annotations

from dataclasses import replace

import pytest
from long_ones import long, long_rows
from run_bench import bench_for, run, spec_for
from run_plans import stvf_plan, ur_plan

from stepload.plan.model import Plan, SecondForce, SecondForceSource
from stepload.rig.world import WorldFault

TOLERANCE_N = 2.0


def rated(plan: Plan, hz: float, second_hz: float) -> Plan:
    """The plan with a main sensor of this rate; `second_hz` 0: the arm is the second channel."""
    force = replace(plan.rig.force, rate_hz=hz)
    second = SecondForce(SecondForceSource.ARM, TOLERANCE_N, 0.02, 0.02, 0.2)
    if second_hz:
        sensor = replace(plan.rig.force, axis="+fz", rate_hz=second_hz, noise_n=0.2, delay_s=0.002)
        second = SecondForce(SecondForceSource.SENSOR, TOLERANCE_N, 0.02, 0.02, 0.2, sensor)
    procedure = replace(
        plan.procedure, touch_force_n=2.0, load_rate_n_per_s=100.0, levels_n=(60.0, 120.0),
        top_force_n=120.0, step_n=60.0, hold_s=0.2, unload=False,
    )  # fmt: skip
    rig = replace(plan.rig, force=force, second_force=second)
    return replace(plan, rig=rig, procedure=procedure)


@pytest.mark.parametrize(
    ("hz", "second_hz"),
    [
        (25.0, 50.0), (50.0, 0.0),
        *long_rows(
            (hz, second_hz)
            for hz in (25.0, 50.0, 100.0, 500.0)
            for second_hz in (0.0, 500.0, 50.0)
        ),
    ],
)  # fmt: skip
@pytest.mark.parametrize("base", [ur_plan, *long([stvf_plan])])
def test_a_healthy_run_completes(base, hz: float, second_hz: float) -> None:
    plan = rated(base(), hz, second_hz)
    for seed in (1, 4):
        engine = run(bench_for(plan, spec=spec_for(plan, seed)))
        assert engine.course.done, engine.cause
        assert engine.cause is None


@pytest.mark.parametrize("second_hz", [0.0, 50.0])
@pytest.mark.parametrize("hz", [25.0, 100.0])
def test_a_wrong_gain_is_seen_all_the_same(hz: float, second_hz: float) -> None:
    plan = rated(ur_plan(), hz, second_hz)
    wrong = WorldFault("force_gain", 0.0, 600.0, 0.5)
    bench = bench_for(plan, spec=spec_for(plan, 1, [wrong]))
    engine = run(bench)
    assert engine.cause is not None
    assert engine.cause.rule == "R5"
    assert bench.peak_n < 60.0


def alone(base: Plan) -> Plan:
    plan = rated(base, 1000.0, 0.0)
    procedure = replace(plan.procedure, levels_n=(60.0, 120.0), hold_s=0.3)
    none = SecondForce(SecondForceSource.NONE, 0.0, 0.0, 0.0, 0.0)
    return replace(plan, procedure=procedure, rig=replace(plan.rig, second_force=none))


def test_an_only_channel_that_rises_in_a_hold_lags_and_ends_the_run() -> None:
    """A low-pass of 0.6 s once let the next step begin from a force that had passed long before."""
    plan = alone(stvf_plan())
    wrong = WorldFault("force_filter", 0.0, 600.0, 0.6)
    engine = run(bench_for(plan, spec=spec_for(plan, 1, [wrong])))
    assert engine.cause is not None
    assert engine.cause.rule == "R9"
    assert engine.cause.value > engine.cause.limit
    assert engine.course.step_number == 1


@pytest.mark.parametrize("base", [ur_plan, *long([stvf_plan])])
@pytest.mark.parametrize("seed", [1, 4])
def test_a_healthy_only_channel_rests_in_its_holds(base, seed: int) -> None:
    plan = alone(base())
    engine = run(bench_for(plan, spec=spec_for(plan, seed)))
    assert engine.course.done, engine.cause
    assert engine.cause is None
