"""Limits are finite, below F_c, and refuse what leaves no room."""

from __future__ import annotations

import math
import random
import statistics
from dataclasses import fields, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from run_plans import limits_for, stvf_plan, ur_plan

from stepload.errors import DomainError, RefusedError
from stepload.feasibility.bounds import Measured, press_rig, shown_noise_n
from stepload.feasibility.force_limits import force_limits
from stepload.feasibility.press import force_budget, largest_speed
from stepload.plan.model import SecondForce, SecondForceSource


@given(
    elastic=st.floats(5.0, 5000.0),
    top=st.floats(1.0, 2000.0),
    step=st.floats(0.5, 100.0),
    noise=st.floats(0.001, 2.0),
    tolerance=st.floats(0.0, 20.0),
    relative=st.floats(0.0, 0.3),
    common=st.floats(0.0, 0.5),
    bias=st.floats(0.0, 3.0),
    capacity=st.floats(5.0, 5000.0),
)
def test_an_unseen_error_at_the_force_limit_stays_below_the_elastic_limit(
    elastic: float,
    top: float,
    step: float,
    noise: float,
    tolerance: float,
    relative: float,
    common: float,
    bias: float,
    capacity: float,
) -> None:
    try:
        limits = force_limits(
            elastic,
            top_force_n=top,
            step_n=step,
            noise_n=noise,
            tolerance_n=tolerance,
            tolerance_relative=relative,
            common_relative=common,
            bias_n=bias,
            capacity_n=capacity,
        )
    except RefusedError:
        return
    agreed_n = limits.limit_n * (1.0 + relative) + tolerance + bias
    assert agreed_n / (1.0 - common) <= elastic * (1.0 + 1e-12)
    assert top + 8.0 * noise < limits.limit_n <= capacity
    assert top <= limits.largest_top_n


@given(
    tangent=st.floats(1e3, 1e9),
    force=st.floats(5.0, 1000.0),
    share=st.floats(0.01, 0.9),
    stvf=st.booleans(),
)
def test_the_largest_speed_spends_the_whole_force_budget(
    tangent: float, force: float, share: float, stvf: bool
) -> None:
    plan = stvf_plan() if stvf else ur_plan()
    rig = press_rig(plan.rig, plan.rig.force.noise_n)
    threshold = share * force
    speed = largest_speed(
        rig, force_n=force, threshold_n=threshold, tangent_n_per_m=tangent, delay_s=0.02
    )
    if speed == 0.0:
        assert threshold + 6.0 * rig.noise_n >= force
        return
    terms = force_budget(
        rig, speed_m_s=speed, threshold_n=threshold, tangent_n_per_m=tangent, delay_s=0.02
    )
    assert sum(t.value for t in terms) == pytest.approx(force, rel=1e-9)


def test_plastic_sphere_on_the_paper_machine_leaves_room() -> None:
    limits = limits_for(stvf_plan(), 727.0)
    assert limits.force_limit_n == pytest.approx(375.0)
    assert limits.allowed_n == pytest.approx((0.95 * 727.0 - 11.0 - 0.4196 - 1.0) / 1.05, abs=1e-3)
    named = {term.name: term for term in limits.terms}
    for field in fields(limits):
        if field.name not in ("terms", "cross_check") and "identical" not in field.name:
            assert named[field.name].value == getattr(limits, field.name)
            assert named[field.name].source


@pytest.mark.parametrize("elastic_limit", [9.6, 1.2, 20.0, math.nan, math.inf, -1.0, 0.0])
def test_no_room_or_no_number_is_refused(elastic_limit: float) -> None:
    with pytest.raises((RefusedError, DomainError)):
        limits_for(stvf_plan(), elastic_limit)


@pytest.mark.parametrize("field", ["force_limit_n", "reaction_s", "stale_force_s", "jump_n"])
@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0, -1.0])
def test_a_limit_that_could_never_trip_is_refused(field: str, value: float) -> None:
    limits = limits_for(stvf_plan(), 727.0)
    with pytest.raises(DomainError, match=field):
        replace(limits, **{field: value})


def test_measured_noise_and_bias_only_tighten() -> None:
    planned = limits_for(stvf_plan(), 727.0)
    noisy = limits_for(stvf_plan(), 727.0, measured=Measured(0.7, 5.0))
    quiet = limits_for(stvf_plan(), 727.0, measured=Measured(0.01, 0.0))
    assert noisy.allowed_n < planned.allowed_n
    assert noisy.largest_top_n < planned.largest_top_n
    assert quiet.allowed_n == planned.allowed_n
    assert quiet.largest_top_n == planned.largest_top_n


def test_the_second_zero_may_be_off_by_half_of_the_tolerance_or_as_far_as_stated() -> None:
    plan = stvf_plan()
    second = replace(plan.rig.second_force, tolerance_n=8.0)
    for stated_n, allowed_n in ((None, 4.0), (1.0, 4.0), (6.0, 6.0)):
        rig = replace(plan.rig, second_force=replace(second, zero_error_n=stated_n))
        assert limits_for(replace(plan, rig=rig), 727.0).second_zero_n == allowed_n


def test_small_limits_need_a_second_channel_or_a_fuse() -> None:
    plan = ur_plan(top_force_n=5.0, step_n=2.5, max_drift_n=0.1, touch_force_n=1.5)
    alone = SecondForce(SecondForceSource.NONE, 0, 0, 0, 0)
    quiet = replace(plan.rig.force, noise_n=0.05)
    rig = replace(plan.rig, second_force=alone, force=quiet)
    with pytest.raises(RefusedError, match="nothing checks"):
        limits_for(replace(plan, rig=rig), 14.9)
    fused = replace(plan, rig=replace(rig, mechanical_fuse_n=12.0))
    assert limits_for(fused, 14.9).force_limit_n < 14.9


def test_a_touch_force_in_the_noise_is_refused() -> None:
    with pytest.raises(RefusedError, match=r"raise the touch force to 1\.2 N"):
        limits_for(stvf_plan(touch_force_n=1.0), 727.0)


def test_a_coarse_sensor_shows_more_noise_at_the_edge_of_its_quantum() -> None:
    chance = random.Random(1)
    for quantum_n in (0.1, 1.0, 1.5, 3.0):
        shown = []
        for at in (0.0, 0.25, 0.5):
            readings = [
                quantum_n * round(chance.gauss(at * quantum_n, 0.5) / quantum_n)
                for _ in range(20_000)
            ]
            shown.append(statistics.pstdev(readings))
        assert shown_noise_n(0.5, quantum_n) == pytest.approx(max(shown), rel=0.02)
    assert shown_noise_n(0.5, 0.0) == 0.5
    assert shown_noise_n(0.5, 0.50001) == pytest.approx(shown_noise_n(0.5, 0.5), rel=1e-4)


def test_limits_know_what_a_sound_sensor_shows_and_where_its_zero_has_moved() -> None:
    plan = stvf_plan()
    force = replace(plan.rig.force, resolution_n=0.9)
    limits = limits_for(replace(plan, rig=replace(plan.rig, force=force)))
    assert limits.shown_noise_n == shown_noise_n(0.3, 0.9) > 1.1 * limits.noise_n
    assert limits.moved_zero_n == 0.25 * limits.touch_force_n


def test_rules_that_judge_nothing_on_a_rig_are_named() -> None:
    plan = stvf_plan()
    lone = replace(plan.rig, second_force=SecondForce(SecondForceSource.NONE))
    assert {"R13", "R14"} <= set(limits_for(plan).off)
    assert "R5" not in limits_for(ur_plan()).off
    alone = limits_for(replace(plan, rig=lone))
    assert "R5" in alone.off
    assert not {rule for rule, _ in alone.judged} & set(alone.off)
