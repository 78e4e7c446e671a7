"""Whole runs in which the force zero moves on the way, or a contact is so slow that it looks so."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from long_ones import long
from run_bench import Bench, bench_for, run, spec_for
from run_plans import stvf_plan

from stepload.engine.tick import Engine
from stepload.plan.model import Plan, SecondForceSource
from stepload.rig.world import WorldFault, WorldSpec

SLOW = {
    "touches": 1, "tare_s": 0.3, "hold_s": 0.2, "settle_timeout_s": 0.3, "retract_m": 3e-4,
    "top_force_n": 100.0,
}  # fmt: skip


def long_way(**procedure: Any) -> Plan:
    """A plan whose arm is so slow that its way to the surface takes half a minute."""
    far = {"surface_distance_m": 3e-3, "surface_uncertainty_m": 5e-4}
    plan = stvf_plan(**(SLOW | far | procedure))
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


@pytest.mark.long
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


@pytest.mark.parametrize("sign", [1.0, *long([-1.0])])
def test_a_zero_that_drifts_as_stated_stops_no_sound_run(sign: float) -> None:
    """By the end of the press it has moved by more than the plan's tolerance of R5."""
    plan = stvf_plan(**(SLOW | {"hold_s": 8.0, "max_drift_n": 1.0}))
    second = replace(plan.rig.second_force, tolerance_n=1.5, noise_n=0.3)
    force = replace(plan.rig.force, drift_n_per_s=0.1)
    plan = replace(plan, rig=replace(plan.rig, force=force, second_force=second))
    bench = bench_for(plan, 727.0, spec_for(plan, force_drift_n_per_s=sign * 0.1))
    engine = run(bench)
    assert engine.course.done
    assert engine.cause is None
    assert abs(engine.course.zero_shift_n) > 1.5


@pytest.mark.long
def test_r11_leaves_room_for_the_stated_drift_beside_a_second_channel() -> None:
    """On the way that ends by R11 above, where the rig file states no drift."""
    plan = long_way(max_drift_n=6.0, surface_distance_m=4.5e-3, retract_m=1.5e-4)
    force = replace(plan.rig.force, drift_n_per_s=0.1)
    plan = replace(plan, rig=replace(plan.rig, force=force))
    spec = spec_for(plan, 4, force_drift_n_per_s=-0.1)
    engine = pressed(plan, spec, False).engine
    assert engine.cause is None
    assert engine.course.levels_done == 2


def test_a_zero_that_moves_beyond_the_drift_allowed_still_ends_the_run() -> None:
    plan = long_way(max_drift_n=2.0, surface_distance_m=6e-3, retract_m=1.5e-4)
    engine = pressed(plan, spec_for(plan, 4, force_drift_n_per_s=-0.1), True).engine
    assert engine.cause is not None
    assert engine.cause.rule == "R11"
    tares = engine.course.tares
    assert 0.5 < tares[0].mean_n - tares[-1].mean_n < 2.1


@pytest.mark.parametrize("wrong", ["nearer", *long(("soft", "gain", "wrong sign"))])
def test_a_slow_contact_is_no_moved_zero(wrong: str) -> None:
    """Contact that grows over seconds: the proof is made, no zero is taken, the force as before."""
    plan = long_way(max_drift_n=3.0)
    faults = [WorldFault("force_gain", 0.0, 600.0, 0.3)] if wrong == "gain" else []
    nearer_m_s = 3e-5 if wrong == "nearer" else 0.0
    spec = spec_for(plan, 4, faults, drift_m_s=nearer_m_s)
    spec = replace(spec, payload=replace(spec.payload, k=1e5))
    if wrong == "wrong sign":
        force = replace(plan.rig.force, axis="+fz")
        plan = replace(plan, rig=replace(plan.rig, force=force))
    peaks_n = []
    for mended in (False, True):
        bench = bench_for(plan, 727.0, spec)
        engine = bench.engine
        course = engine.course
        if not mended:
            course.limits = replace(course.limits, moved_zero_n=1e9)
        while not (course.touches or engine.cause) and engine._last_s != 60.0:
            run(bench, 0.5)
        assert count(engine, "tare") == 1
        assert count(engine, "free_air") == 1 + mended
        assert course.touches or engine.cause
        if wrong in ("wrong sign", "gain"):
            assert engine.cause is not None
        peaks_n.append(bench.peak_n)
    assert peaks_n[1] < 1.05 * peaks_n[0]


def test_a_press_that_lasts_too_long_for_its_only_zero_is_ended_below_f_c() -> None:
    """The drift is as stated; less of it is counted on than the press takes."""
    plan = stvf_plan(**(SLOW | {"hold_s": 4.0, "cycles": 3, "lift_off": False}))
    second = replace(plan.rig.second_force, source=SecondForceSource.NONE)
    force = replace(plan.rig.force, drift_n_per_s=0.1)
    plan = replace(plan, rig=replace(plan.rig, second_force=second, force=force))
    bench = bench_for(plan, 260.0, spec_for(plan, 4, force_drift_n_per_s=-0.1))
    course = bench.engine.course
    counted_n = course.limits.zero_shift_n
    course.limits = replace(course.limits, zero_shift_n=0.3 * counted_n)
    run(bench, 200.0)
    assert bench.engine.cause is not None
    assert bench.engine.cause.rule == "old_zero"
    assert bench.engine.safe_reached
    assert bench.peak_n < plan.procedure.top_force_n + counted_n < 260.0
