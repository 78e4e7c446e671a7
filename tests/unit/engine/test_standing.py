"""A second sensor that stands while the main one moves: it is frozen."""

from __future__ import annotations

import math
from dataclasses import replace
from random import Random

import pytest
from long_ones import long
from run_bench import bench_for, run, run_to, spec_for
from run_plans import COARSE_F_C_N, coarse_plan, limits_for

from stepload.engine.cross_check import Standing
from stepload.engine.supervisor import Supervisor
from stepload.engine.watch import Breach, Found
from stepload.envelope.limits import RunLimits, identical_counts, second_stands_n
from stepload.plan.model import Plan
from stepload.record.rows import Phase
from stepload.rig.samples import ForceSample
from stepload.rig.world import WorldFault


@pytest.mark.parametrize("loaded_s", [0.24, 0.6, *long((0.54, 0.66))])
def test_a_main_channel_that_reads_too_little_and_a_frozen_second_one(loaded_s: float) -> None:
    """Found by a search: 1.5 F_c before the rule, since R5 compared with what was read long ago."""
    plan = coarse_plan()
    load_s = run_to(bench_for(plan, COARSE_F_C_N, spec_for(plan, 3)), Phase.LOAD, 1)
    faults = (
        WorldFault("force_gain", 1.87, 600.0, 0.35),
        WorldFault("second_freeze", load_s + loaded_s, 600.0, 0.0),
    )
    bench = bench_for(plan, COARSE_F_C_N, spec_for(plan, 3, faults))
    engine = run(bench, 25.0)
    assert engine.cause is not None
    assert bench.peak_n < 0.7 * COARSE_F_C_N


def test_a_rule_that_is_left_out_takes_no_other_one_with_it() -> None:
    """Without R4 a standing channel is still compared; without R1 the whole force still judged."""

    def without(left_out: str) -> Found:
        return lambda rule, *rest: None if rule == left_out else Breach(rule, *rest)

    limits = limits_for(coarse_plan(), COARSE_F_C_N)
    supervisor = Supervisor(limits, "-fz", "+fz", without("R4"))
    assert supervisor.second is not None
    supervisor.force.raw_n = supervisor.second.raw_n = 0.0
    supervisor.tare(0.0, 0.0)
    found = []
    for tick in range(800):
        supervisor.second.fresh = supervisor.force.fresh = True
        supervisor.force.raw_n = min(0.02 * tick, 8.0)
        found.append(supervisor._judge_force(0.0, 0.0, int(Phase.HOLD)))
    assert "R5" in {breach.rule for breach in found if breach}

    supervisor = Supervisor(limits, "-fz", "", without("R1"))
    sideways = ForceSample(1, 0.0, 0.0, 0, (0.0,) * 6, 20.0)
    supervisor.force.take([sideways], 0.0)
    supervisor.tare(0.0, 0.0)
    wrench = (2.0 * limits.force_limit_n, 0.0, 0.0, 0.0, 0.0, 0.0)
    sample = sideways._replace(sequence=2, wrench=wrench)
    supervisor.force.take([sample], 0.0)
    breach = supervisor._judge_force(0.0, 0.0, int(Phase.HOLD))
    assert breach is not None
    assert breach.rule == "R2"


def test_the_same_rig_without_faults_completes() -> None:
    bench = bench_for(coarse_plan(), COARSE_F_C_N)
    assert run(bench, 40.0).cause is None


def read(truth_n: list[float], limits: RunLimits, plan: Plan, seed: int) -> float:
    """Largest `moved_n` for sound sensors of this plan that see this force, tick by tick."""
    chance, second = Random(seed), plan.rig.second_force
    assert second.sensor is not None
    standing = Standing(limits.period_s, limits.channel_skew_s, limits.cross_filter_s)
    lag = math.floor(second.sensor.delay_s / limits.period_s)
    largest_n = 0.0
    for tick, force_n in enumerate(truth_n):
        main_n = force_n + chance.gauss(0.0, plan.rig.force.noise_n)
        late_n = truth_n[max(0, tick - lag)] + chance.gauss(0.0, second.noise_n)
        quantum_n = second.sensor.resolution_n
        standing.add(main_n, quantum_n * math.floor(late_n / quantum_n + 0.5))
        largest_n = max(largest_n, standing.moved_n)
    return largest_n


def ramps(seed: int, ticks: int) -> list[float]:
    """A force that creeps, ramps and rests."""
    chance, force_n, truth = Random(seed), 5.0, []
    while len(truth) < ticks:
        rate_n = chance.choice((0.0, 0.0, 1e-4, -1e-4, 0.01, 0.12, -0.12))
        for _ in range(chance.randrange(20, 400)):
            force_n += rate_n
            truth.append(force_n)
    return truth[:ticks]


@pytest.mark.parametrize("seed", range(8))
def test_a_sound_coarse_sensor_never_stands_too_long(seed: int) -> None:
    plan = coarse_plan()
    limits = limits_for(plan, COARSE_F_C_N)
    assert read(ramps(seed, 6000), limits, plan, seed) < limits.second_stands_n


def test_a_frozen_one_is_found_when_the_force_has_moved_by_the_threshold() -> None:
    limits = limits_for(coarse_plan(), COARSE_F_C_N)
    standing = Standing(limits.period_s, limits.channel_skew_s, limits.cross_filter_s)
    ticks = 0
    while standing.moved_n <= limits.second_stands_n:
        standing.add(0.002 * ticks, 7.0)
        ticks += 1
    assert 0.002 * ticks < 1.4 * limits.second_stands_n
    standing.add(0.002 * ticks, 7.3)
    assert (standing.moved_n, standing.ticks) == (0.0, 0)
    standing.restart()
    assert standing.second_n != standing.second_n


def test_a_force_that_falls_at_once_leaves_no_trace_in_the_filter() -> None:
    """A stiff contact that opens: the second reads zero, the main one's filter still falls."""
    limits = limits_for(coarse_plan(), COARSE_F_C_N)
    standing = Standing(limits.period_s, limits.channel_skew_s, limits.cross_filter_s)
    largest_n = 0.0
    for tick in range(400):
        force_n = 300.0 if tick < 100 else 0.0
        standing.add(force_n, force_n)
        largest_n = max(largest_n, standing.moved_n)
    assert largest_n < 0.2


def test_what_came_and_went_between_two_looks_is_not_held_against_the_second_sensor() -> None:
    """A touch that bounces for 30 ms beside a sensor of 25 Hz."""
    standing = Standing(0.002, 0.048, 0.005)
    for tick in range(2000):
        standing.add(8.0 if tick % 500 < 15 else 0.0, 0.0)
        assert standing.moved_n < 0.1
    for _ in range(60):
        standing.add(8.0, 0.0)
    assert standing.moved_n > 7.0


def test_a_noise_of_zero_has_no_count_that_tells_a_frozen_sensor() -> None:
    sensor = coarse_plan().rig.second_force.sensor
    assert sensor is not None
    assert identical_counts(sensor, 0.0) == 0


def test_the_threshold_holds_every_term() -> None:
    plan = coarse_plan()
    whole_n = second_stands_n(plan, plan.rig.force.noise_n)
    rig, second = plan.rig, plan.rig.second_force
    assert second.sensor is not None

    def with_(**parts: object) -> float:
        return second_stands_n(replace(plan, rig=replace(rig, **parts)), 0.0556)  # type: ignore[arg-type]

    finer = replace(second.sensor, resolution_n=0.15)
    assert with_(force=replace(rig.force, resolution_n=0.0)) == pytest.approx(whole_n - 0.0475)
    assert with_(force=replace(rig.force, drift_n_per_s=1e-3)) > whole_n
    assert with_(second_force=replace(second, sensor=finer)) < whole_n - 0.1
    assert with_(second_force=replace(second, tolerance_relative=0.1)) > whole_n
    assert second_stands_n(plan, 0.0) < whole_n
    assert with_(second_force=replace(second, sensor=None)) == 0.0
