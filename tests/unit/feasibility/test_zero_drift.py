"""A zero that moves during a press: the stated drift counts, and a short tare is named."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from run_plans import preflight_for, stvf_plan

from stepload.feasibility.reason import Severity
from stepload.feasibility.schedule import LOAD_STEP, Stage
from stepload.feasibility.zero_drift import (
    counted_shift_n,
    longest_under_load_s,
    unchecked_drift,
    under_load_s,
)
from stepload.feasibility.zero_reasons import zero_drift_reasons
from stepload.plan.model import Plan, SecondForceSource

LOOP_S = 0.02


def one_channel(drift_n_per_s: float = 0.0, noise_n: float = 0.5, **procedure: Any) -> Plan:
    plan = stvf_plan(**procedure)
    second = replace(plan.rig.second_force, source=SecondForceSource.NONE)
    force = replace(plan.rig.force, drift_n_per_s=drift_n_per_s, noise_n=noise_n)
    return replace(plan, rig=replace(plan.rig, second_force=second, force=force))


def test_the_stated_drift_counts_over_the_longest_time_under_load() -> None:
    plan = one_channel(cycles=3, lift_off=False)
    allowed_n = plan.procedure.max_drift_n
    longest_s = longest_under_load_s(plan.procedure, LOOP_S)
    steps = 3 * 2 * len(plan.procedure.levels_n) + 2  # some force is kept between two cycles
    waits_s = longest_s - under_load_s(plan.procedure, LOOP_S)
    assert waits_s == pytest.approx(steps * plan.procedure.settle_timeout_s)
    assert counted_shift_n(plan, LOOP_S) == allowed_n
    touch_n = plan.procedure.touch_force_n
    for loaded_n in (0.4 * allowed_n, 0.6 * allowed_n, 3.0 * allowed_n):
        drifting = one_channel(loaded_n / longest_s, cycles=3, lift_off=False)
        counted_n = max(allowed_n, loaded_n + min(loaded_n, touch_n))
        assert counted_shift_n(drifting, LOOP_S) == pytest.approx(counted_n)


def test_a_second_channel_disagrees_before_the_zero_has_moved_so_far() -> None:
    alone = one_channel(1.0)
    second = replace(alone.rig.second_force, source=SecondForceSource.ARM)
    plan = replace(alone, rig=replace(alone.rig, second_force=second))
    assert (
        counted_shift_n(plan, LOOP_S) == plan.procedure.max_drift_n < counted_shift_n(alone, LOOP_S)
    )
    short = replace(plan, procedure=replace(plan.procedure, tare_s=0.5))
    for each, named in ((one_channel(tare_s=0.5), True), (short, False)):
        codes = {reason.code for reason in zero_drift_reasons(each, LOOP_S, ())}
        assert ("short_tare" in codes) == named


def test_what_moves_both_zeros_alike_is_counted_as_the_second_sensor_states_it() -> None:
    """No comparison shows it, and the gain of the main channel may be wrong by what R5 accepts."""
    alone = one_channel(0.2)
    sensor = replace(alone.rig.force, drift_n_per_s=0.1)
    second = replace(alone.rig.second_force, source=SecondForceSource.SENSOR, sensor=sensor)
    plan = replace(alone, rig=replace(alone.rig, second_force=second))
    assert counted_shift_n(plan, LOOP_S) == counted_shift_n(one_channel(0.1), LOOP_S)
    assert unchecked_drift(plan, measured_n_per_s=5.0) == 0.1
    long = replace(plan, procedure=replace(plan.procedure, hold_s=100.0, settle_timeout_s=0.1))
    loading = Stage(LOAD_STEP, 1000.0, 12)
    [reason] = [r for r in zero_drift_reasons(long, LOOP_S, [loading]) if r.code == "old_zero"]
    assert reason.value > reason.limit


def test_what_the_zero_may_move_is_taken_off_the_force_that_is_allowed() -> None:
    steady, drifting = preflight_for(one_channel()), preflight_for(one_channel(0.2))
    assert steady.limits is not None
    loop_s = steady.bounds.loop_s
    moved_n = counted_shift_n(drifting.plan, loop_s) - steady.plan.procedure.max_drift_n
    assert moved_n > 5.0
    less_n = steady.largest_safe_force_n - drifting.largest_safe_force_n
    assert less_n == pytest.approx(moved_n)


def test_a_reading_that_is_too_low_and_has_moved_leaves_the_true_force_below_f_c() -> None:
    """The gain as low as it may be, and the zero by all that is counted on."""
    found = preflight_for(one_channel(0.5, max_drift_n=3.0))
    assert found.limits is not None
    rig, limits = found.plan.rig, found.limits
    reads_of_true = (1.0 - rig.common_force_error) * (1.0 - 3.0 * rig.force.gain_uncertainty)
    true_n = (limits.allowed_n + limits.zero_shift_n) / reads_of_true
    assert limits.zero_shift_n > 20.0
    assert true_n == pytest.approx(limits.used_limit_n)


def test_a_drift_that_would_carry_the_payload_beyond_its_limit_is_refused() -> None:
    preflight = preflight_for(one_channel(0.25, hold_s=20.0, cycles=7, lift_off=False), 450.0)
    calm = preflight_for(one_channel(0.01, hold_s=20.0, cycles=7, lift_off=False), 450.0)
    refusing = {r.code for r in preflight.reasons if r.severity is Severity.REFUSE}
    assert "top_force_above_safe_limit" in refusing
    assert calm.largest_safe_force_n > preflight.largest_safe_force_n


def test_a_tare_that_is_too_short_to_show_a_drift_is_named_with_one_that_is_not() -> None:
    plan = one_channel(tare_s=0.5)
    [reason] = zero_drift_reasons(plan, LOOP_S, ())
    assert reason.code == "short_tare"
    assert reason.severity is Severity.WARN
    assert reason.value > reason.limit == plan.procedure.max_drift_n
    tare_s = float(reason.remedy.removeprefix("tare: ").split()[0])
    assert not list(zero_drift_reasons(one_channel(tare_s=tare_s), LOOP_S, ()))
    assert list(zero_drift_reasons(one_channel(tare_s=tare_s - 1.5), LOOP_S, ()))


def test_r5_leaves_room_for_the_stated_drift_and_f_allowed_counts_it() -> None:
    """What the user wrote of either holds up to what a sound rig may show by the next zero."""
    steady = stvf_plan(top_force_n=100.0, max_drift_n=1.0)
    second = replace(steady.rig.second_force, tolerance_n=2.0, zero_error_n=None)
    steady = replace(steady, rig=replace(steady.rig, second_force=second))
    drifting = replace(
        steady, rig=replace(steady.rig, force=replace(steady.rig.force, drift_n_per_s=0.2))
    )
    calm, found = preflight_for(steady), preflight_for(drifting)
    assert calm.run_limits.cross_tolerance_n == 2.0
    moved_n = found.plan.procedure.max_drift_n
    assert moved_n > 1.2 * 0.2 * under_load_s(steady.procedure, found.bounds.loop_s)
    assert found.run_limits.cross_tolerance_n == pytest.approx(1.0 + moved_n)
    both_n = (1.0 + moved_n - 2.0) + (moved_n - 1.0)  # tolerance, and the zero itself
    less_n = calm.largest_safe_force_n - found.largest_safe_force_n
    assert less_n == pytest.approx(both_n / (1.0 + second.tolerance_relative), rel=1e-6)
    written = replace(drifting, procedure=replace(drifting.procedure, max_drift_n=1.5))
    assert preflight_for(written).run_limits.cross_tolerance_n == pytest.approx(1.0 + 1.5)
