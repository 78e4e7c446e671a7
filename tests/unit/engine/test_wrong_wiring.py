"""Wrong signs and axes: the run stops at the surface, says which, and never says clear unproven."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from random import Random
from typing import Any

import pytest
from long_ones import long
from run_bench import Bench, bench_for, run, run_to, spec_for
from run_plans import limits_for, stvf_plan, ur_plan

from stepload.engine.loop import run_loop
from stepload.engine.retract import not_open
from stepload.engine.supervisor import Supervisor
from stepload.engine.watch import Trip
from stepload.plan.model import Plan, SecondForce, SecondForceSource
from stepload.record.outcome import RunOutcome, RunStatus
from stepload.record.rows import Phase
from stepload.rig.samples import ForceSample
from stepload.rig.world import WorldFault
from stepload_verify.campaign.incidents import NullRecorder

F_C = 727.0
AXES = [sign + name for sign, name in product("+-", ("fx", "fy", "fz"))]
ALONE = SecondForce(SecondForceSource.NONE, 0.0, 0.0, 0.0, 0.0)
QUICK = {"touches": 1, "tare_s": 0.2, "hold_s": 0.2, "top_force_n": 150.0}


def whole_run(
    plan: Plan, axis: str, second_gain: float = 1.0, **world: Any
) -> tuple[Bench, RunOutcome]:
    """A run of a rig whose sensor is wired as the plan says, by an engine that believes `axis`."""
    faults = [WorldFault("arm_force_gain", 0.0, 600.0, second_gain)] if second_gain != 1.0 else []
    force = replace(plan.rig.force, axis=axis)
    expected = replace(plan, rig=replace(plan.rig, force=force))
    bench = bench_for(expected, F_C, spec_for(plan, 3, faults))
    for device in (bench.rig.arm, bench.rig.force):
        device.open(1.0)
    return bench, run_loop(bench.engine, bench.rig, NullRecorder())


@pytest.mark.parametrize("make", [stvf_plan, *long([ur_plan])])
@pytest.mark.parametrize("second", ["wrong sign", "none", *long(["right"])])
@pytest.mark.parametrize("axis", AXES)
def test_every_wiring_but_the_right_one_stops_at_the_surface(
    axis: str, second: str, make: Any
) -> None:
    plan = make(**QUICK)
    if second == "none":
        plan = replace(plan, rig=replace(plan.rig, second_force=ALONE))
    bench, outcome = whole_run(plan, axis, -1.0 if second == "wrong sign" else 1.0)
    if axis == plan.rig.force.axis and second != "wrong sign":
        assert outcome.status == "completed"
        return
    assert outcome.cause is not None
    rule, message = outcome.cause.rule, outcome.cause.message
    assert bench.peak_n < 0.1 * bench.limits.force_limit_n
    assert bench.rig.world.true_force_n == 0.0
    if axis.endswith("z"):
        assert rule in (("R11",) if second == "none" else ("R11", "R5"))
        assert rule == "R5" or ("sign" in message and "force.axis" in message)
    elif second == "none":  # the simulated cell reads 0 across its axis: that holds the arm back
        assert rule == "R7"
        assert bench.peak_n == 0.0
    else:
        assert rule in ("R11", "R5")


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_force_limit_holds_for_every_direction(axis: int, direction: float) -> None:
    plan = replace(stvf_plan(), rig=replace(stvf_plan().rig, second_force=ALONE))
    limits = limits_for(plan, F_C)
    for share, rule in ((0.5, None), (1.01, "R1")):
        supervisor = Supervisor(limits, plan.rig.force.axis)
        wrench = [0.0] * 6
        supervisor.force.take([_sample(1, wrench)], 0.0)
        supervisor.tare(0.0, 0.0)
        wrench[axis] = direction * share * limits.force_limit_n
        supervisor.force.take([_sample(2, wrench)], 0.001)
        found = supervisor._judge_force(0.0, 0.0, int(Phase.HOLD))
        assert (found.rule if found else None) in ((rule, "R9") if rule is None else (rule,))


@pytest.mark.parametrize("along", [1.0, -1.0])
def test_the_size_of_the_whole_force_is_limited(along: float) -> None:
    """A sensor mounted at 45 degrees shows 0.7 of the force along its axis and 0.7 across it."""
    limits = limits_for(stvf_plan(), F_C)
    supervisor = Supervisor(limits, "+fz", found=all_but_r12)
    supervisor.force.take([_sample(0, [0.0] * 6)], 0.0)
    supervisor.tare(0.0, 0.0)
    tick, found = 0, None
    while found is None:
        tick += 1
        part_n = 0.001 * limits.force_limit_n * tick
        wrench = [part_n, 0.0, along * part_n, 0.0, 0.0, 0.0]
        supervisor.force.take([_sample(tick, wrench)], 1e-3 * tick)
        found = supervisor._judge_force(0.0, 0.0, int(Phase.HOLD))
    assert found.rule == "R2"
    assert "across the pressing axis" in found.message
    assert 2.0**0.5 * part_n < limits.force_limit_n


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), float("-inf")])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_force_across_the_axis_that_is_no_number_is_a_fault(axis: int, bad: float) -> None:
    supervisor = Supervisor(limits_for(stvf_plan(), F_C), "+fz")
    wrench = [0.0] * 6
    wrench[axis] = bad
    found = supervisor.force.take([_sample(1, wrench)], 0.001)
    assert found is not None
    assert found.rule == "R4"
    assert supervisor.force.smooth_across_n == 0.0


@pytest.mark.parametrize("axis", [0, 1])
def test_a_force_that_grows_across_the_axis_in_the_approach_is_of_a_wrong_axis(axis: int) -> None:
    limits = limits_for(stvf_plan(), F_C)
    supervisor = Supervisor(limits, "+fz", found=all_but_r12)
    wrench = [0.0] * 6
    supervisor.force.take([_sample(0, wrench)], 0.0)
    supervisor.tare(0.0, 0.0)
    found = None
    for tick in range(1, 2000):
        wrench[axis] = min(0.01 * tick, 3.0) * limits.touch_force_n
        supervisor.force.take([_sample(tick, wrench)], 1e-3 * tick)
        found = found or supervisor._judge_force(0.0, 0.0, int(Phase.GUARDED_APPROACH))
    assert found is not None
    assert found.rule == "R11"
    assert "names the wrong axis" in found.message


def test_noise_across_the_axis_is_no_wrong_axis() -> None:
    plan = replace(stvf_plan(), rig=replace(stvf_plan().rig, second_force=ALONE))
    limits, chance = limits_for(plan, F_C), Random(4)
    supervisor = Supervisor(limits, "-fz")
    for tick in range(8000):
        wrench = [chance.gauss(5.0, 1.5), chance.gauss(0.0, 1.5), 0.0, 0.0, 0.0, 0.0]
        supervisor.force.take([_sample(tick, wrench)], 1e-3 * tick)
        if tick == 300:
            supervisor.tare(0.0, 0.0)
        if tick > 300:
            assert supervisor._judge_force(0.0, 0.0, int(Phase.GUARDED_APPROACH)) is None


def test_a_stop_before_the_first_zero_is_not_called_clear() -> None:
    """The start pose lies in the surface: nothing was ever seen of the force."""
    plan = ur_plan(**QUICK)
    bench = bench_for(plan, F_C, spec_for(plan, 3, surface_m=-0.003))
    for device in (bench.rig.arm, bench.rig.force):
        device.open(1.0)
    bench.operator.press()
    outcome = run_loop(bench.engine, bench.rig, NullRecorder())
    assert 50.0 < bench.rig.world.true_force_n < bench.peak_n
    assert outcome.status is RunStatus.INTERRUPTED
    assert not bench.engine.safe_reached
    assert "clear of the surface" not in outcome.why


def test_an_offset_across_the_axis_is_tared_away() -> None:
    limits = limits_for(stvf_plan(), F_C)
    supervisor = Supervisor(limits, "-fz")
    offset = [2.0 * limits.force_limit_n, -50.0, 0.0, 0.0, 0.0, 0.0]
    supervisor.force.take([_sample(1, offset)], 0.0)
    supervisor.tare(0.0, 0.0)
    assert supervisor.force.across_n == 0.0
    assert supervisor._judge_force(0.0, 0.0, int(Phase.GUARDED_APPROACH)) is None


def test_a_pull_that_is_left_after_a_retract_is_not_open() -> None:
    """A bias that comes with the last step: the force is gone, and the sensor says the opposite."""
    plan = stvf_plan(**QUICK, max_drift_n=50.0)
    plan = replace(plan, rig=replace(plan.rig, second_force=ALONE))
    bench = bench_for(plan, F_C)
    course = bench.engine.course
    run_to(bench, Phase.RETRACT, len(plan.procedure.levels_n) if not plan.procedure.unload else 1)
    bench.engine.supervisor.zero_n += 20.0
    bench.engine.supervisor._last_n -= 20.0
    run(bench, 5.0)
    assert bench.engine.cause is not None
    assert bench.engine.cause.rule == "not_open"
    assert bench.engine.cause.value == pytest.approx(-20.0, abs=0.2)
    assert course.zero_shift_n != course.zero_shift_n


def test_of_zeros_that_have_moved_alike_the_retract_says_by_how_much() -> None:
    """As the temperature moves them: the second channel is no witness then."""
    bench = bench_for(stvf_plan(**QUICK), F_C)
    course = bench.engine.course
    course.sup.smooth_n = course.sup.second_n = -20.0
    not_open(course, 4.0)
    assert course.failure is not None
    assert (course.failure.rule, course.failure.value) == ("not_open", -20.0)
    assert "about 20 N more than it read" in course.failure.message


def test_a_pull_that_grows_is_foreseen() -> None:
    limits = limits_for(stvf_plan(), F_C)
    supervisor = Supervisor(limits, "+fz")
    supervisor.force.take([_sample(0, [0.0] * 6)], 0.0)
    supervisor.tare(0.0, 0.0)
    rate_n, tick = 0.001 * limits.force_limit_n, 0
    while (found := supervisor._judge_force(0.0, 0.0, int(Phase.HOLD))) is None:
        tick += 1
        supervisor.force.take([_sample(tick, [0, 0, -rate_n * tick, 0, 0, 0])], 1e-3 * tick)
    assert found.rule == "R2"
    assert rate_n * tick < limits.force_limit_n


def test_clear_is_said_only_where_every_channel_shows_it() -> None:
    plan = stvf_plan(**QUICK)
    limits = limits_for(plan, F_C)
    supervisor = Supervisor(limits, "+fz")
    assert "no sound force reading" in supervisor.still_closed(0.0)

    def told(force_n: float, second_n: float, later_s: float = 0.0) -> str:
        supervisor.force.take([_sample(1, [0, 0, force_n, 0, 0, 0])], 0.0)
        supervisor._sound = True
        assert supervisor.tared or "no sound" in supervisor.still_closed(0.0)
        supervisor.tare(0.0, 0.0)
        supervisor.smooth_n, supervisor.second_n = force_n, second_n
        return supervisor.still_closed(later_s)

    assert told(0.0, 0.0) == ""
    for force_n in (133.0, -133.0):
        assert "force sensor still reads" in told(force_n, 0.0)
        assert "second force channel still reads" in told(0.0, force_n)
    assert "no sound" in told(0.0, 0.0, later_s=1.0)
    supervisor._sound = False
    assert "no sound" in supervisor.still_closed(0.0)
    supervisor._sound = True
    supervisor.force.take([_sample(2, [0.0] * 6)], 0.0)
    for tick in range(50):
        supervisor.force.take([_sample(tick + 3, [80.0, 0, 0, 0, 0, 0])], 0.0)
    assert "across the pressing axis still reads" in supervisor.still_closed(0.0)


def test_force_that_stays_leads_back_to_the_start_pose_and_is_told() -> None:
    plan = stvf_plan(**QUICK)
    fault = WorldFault("force_bias", 5.9, 600.0, 100.0)
    bench = bench_for(plan, F_C, spec_for(plan, 3, [fault]))
    start_m: list[float] = []
    for device in (bench.rig.arm, bench.rig.force):
        device.open(1.0)
    outcome = run_loop(
        bench.engine, bench.rig, NullRecorder(),
        on_progress=lambda engine: start_m.append(engine.course.start_m),
    )  # fmt: skip
    assert "still reads +" in outcome.why
    assert "clear of the surface" not in outcome.why
    assert bench.engine.target_m == pytest.approx(start_m[-1], abs=1e-6)


@pytest.mark.parametrize("make", [stvf_plan, ur_plan])
def test_a_second_sensor_of_another_axis_is_seen_beside_a_dead_main_one(make: Any) -> None:
    plan = make(**QUICK)
    sensor = replace(plan.rig.force, axis="+fz")
    second = replace(
        plan.rig.second_force, source=SecondForceSource.SENSOR, sensor=sensor, noise_n=0.3
    )
    plan = replace(plan, rig=replace(plan.rig, second_force=second))
    faults = [WorldFault(kind, 0.0, 600.0, 0.0) for kind in ("force_stuck_mean", "second_swapped")]
    bench = bench_for(plan, F_C, spec_for(plan, 3, faults))
    run(bench, 30.0)
    assert bench.engine.cause is not None
    assert bench.engine.cause.rule == "R11"
    assert "second_force.sensor.axis names the wrong axis" in bench.engine.cause.message
    assert bench.peak_n < 0.2 * bench.limits.force_limit_n


@pytest.mark.parametrize("along", [0.0, 0.8])
def test_the_whole_force_on_a_second_sensor_is_limited(along: float) -> None:
    plan = stvf_plan()
    sensor = replace(plan.rig.force, axis="+fz")
    second = replace(
        plan.rig.second_force, source=SecondForceSource.SENSOR, sensor=sensor, noise_n=0.3
    )
    limits = limits_for(replace(plan, rig=replace(plan.rig, second_force=second)), F_C)
    supervisor = Supervisor(limits, "-fz", "+fz")
    assert supervisor.second is not None
    supervisor.second.take([_sample(1, [3.0, 0, 0, 0, 0, 0])], 0.0)
    supervisor.tare(0.0, 0.0)
    assert supervisor._judge_side(0.0, int(Phase.HOLD)) is None
    for share, rule in ((0.5, None), (1.01, "R1")):
        across_n = share * math.sqrt(1.0 - along**2) * limits.force_limit_n
        supervisor.second_n = share * along * limits.force_limit_n
        supervisor.second.take([_sample(2, [3.0 + across_n, 0, 0, 0, 0, 0])], 0.0)
        found = supervisor._judge_side(0.0, int(Phase.HOLD))
        assert (found.rule if found else None) == rule


def all_but_r12(rule: str, *rest: Any) -> Trip | None:
    """R12 stops a run that is dragged sideways earlier."""
    return None if rule == "R12" else Trip(rule, *rest)


def _sample(index: int, wrench: Any) -> ForceSample:
    return ForceSample(index, 1e-3 * index, 1e-3 * index, 0, tuple(map(float, wrench)), 20.0)
