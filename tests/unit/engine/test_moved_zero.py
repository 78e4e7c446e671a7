"""A zero that has moved on a long way to the surface is taken again, and nothing else is."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from course_feed import PERIOD_S, PLAN, PLANNED, Stage
from run_bench import Bench, bench_for, run, spec_for
from run_plans import stvf_plan

from stepload.engine.approach import MEAN_S, WORTH, Approach
from stepload.engine.course import ZERO_SHARE
from stepload.engine.free_air import LOOK_S, FreeAir
from stepload.engine.tick import Engine
from stepload.envelope.unseen import Tells
from stepload.plan.model import Plan
from stepload.record.outcome import Tare
from stepload.record.rows import Phase
from stepload.rig.world import WorldFault, WorldSpec

MOVED_N = PLANNED.moved_zero_n
ZERO = Tare(9.0, 0.3, 300, 0.0, 0.1, 0.0, 0.0, 0.1)
LOOK = round(LOOK_S / PERIOD_S) + 1
TICKS = round(3.0 * MEAN_S / PLANNED.period_s)
"""So long that the mean is 95 % of the force."""
NONE = Tells(main=False, second=False)


def approach(limits: dict[str, Any] | None = None, **procedure: Any) -> tuple[Stage, Approach]:
    stage = Stage(limits, {"max_drift_n": 10.0, "retract_m": 1e-4, **procedure})
    stage.course.tares.append(ZERO)
    part = Approach(stage.course, stage.stopped.append, stage.zero, NONE)
    part.begin(stage.now_s, "first", 1, stage.then.append)
    return stage, part


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_zero_that_has_moved_is_taken_again_on_the_way(sign: float) -> None:
    stage, _ = approach()
    stage.ticks(TICKS, sign * 0.99 * MOVED_N)
    assert not stage.zeroing
    stage.ticks(TICKS, sign * 1.1 * MOVED_N)
    assert len(stage.zeroing) == 1
    assert stage.course.failure is None


def test_a_force_that_has_not_stood_for_long_is_no_moved_zero() -> None:
    stage, _ = approach()
    ticks_s = MEAN_S * math.log(2.0)  # until the mean of a step is half of it
    stage.ticks(round(0.98 * ticks_s / PLANNED.period_s), 2.0 * MOVED_N)
    assert not stage.zeroing
    stage.ticks(round(0.04 * ticks_s / PLANNED.period_s), 2.0 * MOVED_N)
    assert len(stage.zeroing) == 1


def test_the_way_gained_is_worth_what_backing_off_loses() -> None:
    """Two retracts of way from where the approach began, and from where a zero was taken."""
    worth_m, leash_m = WORTH * 1e-4, 1e-6
    stage, _ = approach({"leash_free_m": leash_m, "ahead_m": 1.0})
    for start_m in (0.0, worth_m):
        taken = len(stage.zeroing)
        stage.position_m = start_m + 0.99 * worth_m - leash_m
        stage.ticks(TICKS, 2.0 * MOVED_N)
        assert len(stage.zeroing) == taken
        stage.position_m = start_m + 1.001 * worth_m - leash_m
        stage.ticks(100, 2.0 * MOVED_N)
        assert len(stage.zeroing) == taken + 1
        stage.course.tares.append(ZERO)
        stage.zeroing[-1](stage.now_s)


def test_no_more_than_the_allowed_drift_since_the_first_zero_is_taken_for_one() -> None:
    for share, taken in ((0.99, True), (1.01, False)):
        stage, _ = approach(max_drift_n=2.0)
        stage.course.tares.append(replace(ZERO, mean_n=share * 2.0 - 2.0 * MOVED_N))
        stage.ticks(TICKS, 2.0 * MOVED_N)
        assert bool(stage.zeroing) == taken


def test_the_second_channel_is_the_witness() -> None:
    """What it has moved by since its first zero: more than half its tolerance is no drift."""
    for share, there, taken in ((0.99, "arm", True), (1.01, "arm", False), (1.01, "", True)):
        stage, _ = approach({"cross_check": there})
        shift_n = share * ZERO_SHARE * PLANNED.cross_tolerance_n
        stage.course.tares.append(replace(ZERO, second_mean_n=0.5 * shift_n))
        stage.sup.second_n = 0.5 * shift_n
        stage.ticks(TICKS, 1.5 * MOVED_N)
        assert bool(stage.zeroing) == taken


def test_after_a_moved_zero_the_approach_begins_again_and_so_does_the_mean() -> None:
    stage, _ = approach()
    stage.ticks(TICKS, 2.0 * MOVED_N)
    stage.course.tares.append(replace(ZERO, mean_n=2.0 * MOVED_N))
    stage.zeroing[0](stage.now_s)
    assert stage.course.phase == Phase.FAST_APPROACH
    stage.ticks(round(0.1 * TICKS), 2.0 * MOVED_N)
    assert len(stage.zeroing) == 1
    stage.ticks(TICKS, 2.0 * MOVED_N)
    assert len(stage.zeroing) == 2


def test_what_goes_away_by_backing_off_is_met_with_the_old_zero_and_not_proved_again() -> None:
    stage, part = approach()
    stage.ticks(TICKS, 2.0 * MOVED_N)
    (meet,) = stage.touching
    assert meet is not None
    meet(stage.now_s)
    assert stage.course.phase == Phase.GUARDED_APPROACH
    stage.ticks(TICKS, 2.0 * MOVED_N)
    assert len(stage.zeroing) == 1
    part.begin(stage.now_s, "cycle", 1, stage.then.append)
    stage.ticks(TICKS, 2.0 * MOVED_N)
    assert len(stage.zeroing) == 2


@pytest.mark.parametrize("second", [False, True])
def test_on_the_way_a_little_that_goes_with_the_way_is_contact(second: bool) -> None:
    """Where the start pose is left, half of the drift or of the tolerance passes."""
    noise_free = [0.0] * LOOK
    for share, on_the_way, free in ((0.49, True, True), (0.51, True, False), (0.51, False, True)):
        stage = Stage()
        met: list[float] = []
        proof = FreeAir(stage.course, stage.stopped.append)
        proof.prove(stage.now_s, stage.then.append, met.append if on_the_way else None)
        stage.readings(noise_free, noise_free)
        while stage.course.act.__name__ != "_look_again":
            stage.ticks()
        change = [-share * 0.5 * PLAN.max_drift_n if not on_the_way else -share * MOVED_N] * LOOK
        stage.readings(noise_free if second else change, change if second else noise_free)
        assert stage.course.failure is None
        assert bool(stage.then) == free == (not met)


SLOW = {
    "touches": 1, "tare_s": 0.3, "hold_s": 0.2, "settle_timeout_s": 0.3, "retract_m": 3e-4,
    "top_force_n": 100.0,
}  # fmt: skip


def long_way(**procedure: Any) -> Plan:
    """A plan whose arm is so slow that its way to the surface takes half a minute."""
    plan = stvf_plan(**(SLOW | procedure))
    return replace(plan, rig=replace(plan.rig, arm=replace(plan.rig.arm, max_speed_m_s=1.5e-4)))


def pressed(plan: Plan, spec: WorldSpec, mended: bool, until_s: float = 200.0) -> Bench:
    """A run in such a world; `mended` False: where no zero is ever taken for a moved one."""
    bench = bench_for(plan, 727.0, spec)
    if not mended:
        course = bench.engine.course
        course.limits = replace(course.limits, moved_zero_n=1e9)
    run(bench, until_s)
    return bench


def count(engine: Engine, kind: str) -> int:
    return sum(name == kind for _, name, _ in engine.events)


@pytest.mark.parametrize(("drift_n_per_s", "rule"), [(0.1, "R6"), (-0.1, "R11")])
def test_a_run_with_a_moving_zero_and_a_long_way_completes(drift_n_per_s: float, rule: str) -> None:
    plan = long_way(max_drift_n=6.0, surface_distance_m=4.5e-3, retract_m=1.5e-4)
    spec = spec_for(plan, 4, force_drift_n_per_s=drift_n_per_s)
    cause = pressed(plan, spec, False).engine.cause
    assert cause is not None
    assert cause.rule == rule
    engine = pressed(plan, spec, True).engine
    assert engine.cause is None
    assert engine.course.levels_done == 2
    assert count(engine, "tare") > 1
    assert engine.course.touches[0].position_m == pytest.approx(spec.surface_m, abs=1e-5)


def test_a_zero_that_moves_beyond_the_drift_allowed_still_ends_the_run() -> None:
    plan = long_way(max_drift_n=2.0, surface_distance_m=6e-3, retract_m=1.5e-4)
    engine = pressed(plan, spec_for(plan, 4, force_drift_n_per_s=-0.1), True).engine
    assert engine.cause is not None
    assert engine.cause.rule == "R11"
    tares = engine.course.tares
    assert 0.5 < tares[0].mean_n - tares[-1].mean_n < 2.1


@pytest.mark.parametrize("wrong", ["soft", "wrong sign", "gain", "nearer"])
def test_a_slow_contact_is_no_moved_zero(wrong: str) -> None:
    """Contact that grows over seconds: the proof is made, no zero is taken, the force as before."""
    plan = long_way(max_drift_n=3.0)
    faults = [WorldFault("force_gain", 0.0, 600.0, 0.3)] if wrong == "gain" else []
    spec = spec_for(plan, 4, faults)
    spec = replace(spec, payload=replace(spec.payload, k=1e5))
    if wrong == "wrong sign":
        force = replace(plan.rig.force, axis="+fz")
        plan = replace(plan, rig=replace(plan.rig, force=force))
    peaks_n = []
    for mended in (False, True):
        bench = bench_for(plan, 727.0, spec)
        engine, plant = bench.engine, bench.rig.world.plant  # type: ignore[attr-defined]
        course, real = engine.course, engine.course.step
        if not mended:
            course.limits = replace(course.limits, moved_zero_n=1e9)

        def step(now_s: float, step_s: float, real: Any = real, plant: Any = plant) -> float:
            plant._surface -= 3e-5 * step_s
            plant._contact_m = plant._surface
            return float(real(now_s, step_s))

        if wrong == "nearer":
            course.step = step  # type: ignore[method-assign]
        while not (course.touches or engine.cause) and engine._last_s != 60.0:
            run(bench, 0.5)
        assert count(engine, "tare") == 1
        assert count(engine, "free_air") == 1 + mended
        assert course.touches or engine.cause
        if wrong in ("wrong sign", "gain"):
            assert engine.cause is not None
        peaks_n.append(bench.peak_n)
    assert peaks_n[1] < 1.05 * peaks_n[0]
