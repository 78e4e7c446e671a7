"""Every bound of the preflight from the numbers of a plan, term by term."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from run_plans import limits_for, preflight_for, stvf_plan, ur_plan

from stepload.contact.power_law import ContactLaw
from stepload.errors import DomainError, RefusedError
from stepload.feasibility.bounds import (
    ARM_STUCK_RATIO,
    Measured,
    age_limit_s,
    channel_skew_s,
    comparison_period_s,
    cross_blind_n,
    follow_travel,
    largest_sliding_stiffness,
    largest_stiffness,
    press_rig,
    retract_speed_m_s,
    step_patience_s,
    step_rate_per_s,
)
from stepload.feasibility.command_backlog import catch_up_force, largest_catch_up
from stepload.feasibility.force_limits import ForceLimits, force_limits
from stepload.feasibility.hazards import hazards_of
from stepload.feasibility.limits import MODEL_LAG_S, TRAVEL_LIMIT_TIME_S, identical_counts
from stepload.feasibility.load_times import LoadTimes
from stepload.feasibility.preflight import preflight_of
from stepload.feasibility.press import (
    OLD_S,
    PressRig,
    largest_speed,
    series_stiffness,
    speed_terms,
    travel_limit,
)
from stepload.feasibility.pressing import (
    HARD_STOP_N_PER_M,
    LONGEST_STALL_S,
    TOP_SPEED_SHARE,
    Pressing,
    largest_top_force,
    pressing_for,
)
from stepload.feasibility.schedule import renewals, schedule
from stepload.feasibility.theory import theory_of
from stepload.feasibility.zero_drift import under_load_s
from stepload.plan.model import ArmSpec, Plan, Provenance, SecondForce, SecondForceSource, Structure

F_C = 727.0
PLAN = stvf_plan()
LAW = theory_of(PLAN.payload).law
ALONE = SecondForce(SecondForceSource.NONE, 0, 0, 0, 0)
LADDER: dict[str, float] = {
    "top_force_n": 100.0, "step_n": 10.0, "noise_n": 0.5, "tolerance_n": 8.0,
    "tolerance_relative": 0.1, "common_relative": 0.0, "bias_n": 2.0, "capacity_n": 1e4,
}  # fmt: skip


def on_rig(plan: Plan = PLAN, **changes: Any) -> Plan:
    return replace(plan, rig=replace(plan.rig, **changes))


def with_arm(plan: Plan = PLAN, **changes: Any) -> Plan:
    return on_rig(plan, arm=replace(plan.rig.arm, **changes))


def with_force(plan: Plan = PLAN, **changes: Any) -> Plan:
    return on_rig(plan, force=replace(plan.rig.force, **changes))


def with_second(plan: Plan = PLAN, **changes: Any) -> Plan:
    return on_rig(plan, second_force=replace(plan.rig.second_force, **changes))


def with_stiffness(**changes: Any) -> Plan:
    return on_rig(system_stiffness=replace(PLAN.rig.system_stiffness, **changes))


def with_sensor(hz: float = 1000.0, delay_s: float = 0.001) -> Plan:
    sensor = replace(PLAN.rig.force, rate_hz=hz, delay_s=delay_s, max_age_s=None)
    return with_second(source=SecondForceSource.SENSOR, sensor=sensor)


def pressing(plan: Plan = PLAN, elastic_limit_n: float = F_C, **options: Any) -> Pressing:
    return pressing_for(plan, LAW, LAW, elastic_limit_n, **options)


def ladder(elastic_limit_n: float = 300.0, **changes: float) -> ForceLimits:
    return force_limits(elastic_limit_n, **(LADDER | changes))


def test_the_largest_reading_allowed_leaves_room_for_all_that_cannot_be_seen() -> None:
    assert ladder().allowed_n == pytest.approx((300.0 - 2.0 - 8.0) / 1.1)
    assert ladder(bias_n=5.0).allowed_n == pytest.approx((300.0 - 5.0 - 8.0) / 1.1)
    assert ladder(tolerance_relative=0.0).allowed_n == pytest.approx(300.0 - 8.0 - 2.0)
    assert ladder(tolerance_n=0.0).allowed_n == pytest.approx((300.0 - 2.0) / 1.1)
    assert ladder(capacity_n=200.0).allowed_n == 200.0
    assert ladder(common_relative=0.2).allowed_n == pytest.approx((240.0 - 2.0 - 8.0) / 1.1)


def test_the_headroom_is_eight_sigma_and_some() -> None:
    limits, coarse = ladder(), ladder(step_n=50.0)
    assert limits.largest_top_n == pytest.approx(limits.allowed_n - (8.0 * 0.5 + 0.5))
    assert coarse.largest_top_n == pytest.approx(coarse.allowed_n - (8.0 * 0.5 + 1.0))
    ladder(top_force_n=0.9999 * limits.largest_top_n)
    with pytest.raises(RefusedError, match="above the largest safe top force"):
        ladder(top_force_n=1.0001 * limits.largest_top_n)
    with pytest.raises(RefusedError, match="leaves no room"):
        ladder(elastic_limit_n=14.9)
    ladder(elastic_limit_n=16.5, top_force_n=0.5)


def test_the_force_limit_is_a_quarter_above_the_top_force_and_never_above_what_is_allowed() -> None:
    assert ladder().limit_n == pytest.approx(125.0)
    assert ladder(top_force_n=10.0).limit_n == pytest.approx(14.5)
    high = ladder(top_force_n=0.999 * ladder().largest_top_n)
    assert high.limit_n == high.allowed_n < 1.25 * 0.999 * high.largest_top_n


@pytest.mark.parametrize(
    ("provenance", "sigma", "expected"),
    [
        (Provenance.MEASURED, 1e4, 1.03e6),
        (Provenance.DECLARED, 1e4, 1.1e6),
        (Provenance.DECLARED, 1e5, 1.3e6),
        (Provenance.INDICATIVE, 1e4, 1.3e6),
    ],
)
def test_stiffness_is_doubted_upwards(
    provenance: Provenance, sigma: float, expected: float
) -> None:
    system = replace(
        PLAN.rig.system_stiffness, stiffness_n_per_m=1e6, sigma_n_per_m=sigma,
        provenance=provenance,
    )  # fmt: skip
    rig = replace(PLAN.rig, system_stiffness=system)
    assert largest_stiffness(rig) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("structure", "stated", "ratio"),
    [
        (Structure.MACHINE, None, 1.0),
        (Structure.ARM, None, ARM_STUCK_RATIO),
        (Structure.ARM, 2.4, 2.4),
        (Structure.MACHINE, 1.5, 1.5),
    ],
)
def test_friction_that_holds_the_tip_stiffens_what_bounds_force(
    structure: Structure, stated: float | None, ratio: float
) -> None:
    rig = replace(
        PLAN.rig,
        arm=replace(PLAN.rig.arm, structure=structure),
        system_stiffness=replace(PLAN.rig.system_stiffness, stuck_ratio=stated),
    )
    sliding = largest_sliding_stiffness(rig.system_stiffness)
    assert largest_stiffness(rig) == pytest.approx(ratio * sliding)
    assert press_rig(rig, 0.1).stiffness_n_per_m == pytest.approx(ratio * sliding)


def test_an_arm_is_a_serial_one_unless_it_is_said_to_be_guided() -> None:
    fields = ArmSpec.__dataclass_fields__
    assert fields["structure"].default is Structure.ARM


def test_data_stop_a_run_at_their_age_and_never_before_four_periods() -> None:
    force = PLAN.rig.force
    assert age_limit_s(force) == 0.012
    assert age_limit_s(replace(force, rate_hz=100.0)) == pytest.approx(0.04)
    assert age_limit_s(replace(force, max_age_s=0.3)) == 0.3
    assert age_limit_s(replace(force, max_age_s=0.001)) == pytest.approx(0.004)


def test_channels_are_compared_at_the_slower_ones_period() -> None:
    assert comparison_period_s(PLAN.rig) == 1e-3
    assert comparison_period_s(with_force(rate_hz=50.0).rig) == 0.02
    assert comparison_period_s(with_arm(rate_hz=125.0).rig) == 0.008
    assert comparison_period_s(with_sensor(hz=40.0).rig) == 0.025


def test_the_skew_of_the_channels_counts_delay_period_and_two_ticks() -> None:
    assert channel_skew_s(PLAN.rig) == pytest.approx(0.001 + 0.001 + 0.002)
    assert channel_skew_s(with_force(rate_hz=25.0).rig) == pytest.approx(0.001 + 0.04 + 0.002)
    assert channel_skew_s(with_sensor(40.0, 0.008).rig) == pytest.approx(0.008 + 0.025 + 0.002)
    assert channel_skew_s(with_arm(rate_hz=500.0).rig) == pytest.approx(0.001 + 0.002 + 0.004)


def test_the_reaction_is_the_sum_of_all_delays() -> None:
    plan = with_arm(rate_hz=500.0, command_delay_s=0.01, lag_s=0.02)
    rig = press_rig(with_force(plan, delay_s=0.003, rate_hz=200.0).rig, 0.1)
    total_s = 0.003 + 0.005 + 0.002 + 0.002 + 0.01 + 0.02
    assert rig.reaction_s == rig.loop_s == pytest.approx(total_s)
    shorter = press_rig(on_rig(plan, loop_delay_s=0.001).rig, 0.1)
    assert shorter.loop_s == 0.001
    assert shorter.reaction_s > 0.03
    longer = press_rig(on_rig(plan, loop_delay_s=0.5).rig, 0.1)
    assert longer.loop_s == longer.reaction_s == 0.5


def test_the_second_channel_speaks_later_by_all_that_it_waits_for() -> None:
    rig = PLAN.rig
    expected_s = 0.02 + 0.005 + channel_skew_s(rig) + comparison_period_s(rig)
    assert press_rig(rig, 0.3).cross_check_s == pytest.approx(expected_s)
    assert press_rig(on_rig(second_force=ALONE).rig, 0.3).cross_check_s == 0.0


def test_speeds_rates_and_patience() -> None:
    assert step_rate_per_s(0.05) == pytest.approx(5.0)
    assert retract_speed_m_s(PLAN.rig) == 0.02
    assert retract_speed_m_s(with_arm(max_speed_m_s=0.01).rig) == 0.005
    assert step_patience_s(PLAN.procedure) == 60.0
    arm = replace(
        PLAN.rig.arm, position_resolution_m=1e-6, position_noise_m=2e-6, lost_motion_m=5e-6
    )
    assert follow_travel(arm) == pytest.approx(2e-6 + 8e-6 + 5e-6)


def hand(**changes: Any) -> PressRig:
    values: dict[str, Any] = {
        "stiffness_n_per_m": 1e6, "damping_n_s_per_m": 300.0, "mass_kg": 10.0,
        "acceleration_m_s2": 2.0, "lag_s": 0.004, "noise_n": 0.5,
        "reaction_s": 0.01, "loop_s": 0.01, "cross_check_s": 0.02,
    }  # fmt: skip
    return PressRig(**(values | changes))


def test_the_terms_of_the_force_budget() -> None:
    tangent = 4e6
    k_eff = series_stiffness(1e6, tangent)
    assert k_eff == pytest.approx(1e6 * tangent / 5e6)
    omega = math.sqrt(5e6 / 10.0)
    named = {term.name: term.value for term in speed_terms(hand(), tangent, 0.03)}
    assert named == {
        "travel during reaction": pytest.approx(k_eff * 0.03),
        "damping": 300.0,
        "impact": pytest.approx(3.0 * math.sqrt(10.0 * tangent) * math.sqrt(tangent / 5e6)),
        "ringing": pytest.approx(k_eff * min(2.0 / (omega**2 * 0.004), 1.0 / omega)),
    }
    for lag_s, ringing_s in ((0.0, 1.0 / omega), (1e-5, 1.0 / omega)):
        term = speed_terms(hand(lag_s=lag_s), tangent, 0.03)[3]
        assert term.value == pytest.approx(k_eff * ringing_s)


def test_the_largest_speed_leaves_room_for_touch_noise_and_braking() -> None:
    tangent, force_n, touch_n = 4e6, 50.0, 3.0
    speed = largest_speed(
        hand(), force_n=force_n, threshold_n=touch_n, tangent_n_per_m=tangent, delay_s=0.03
    )
    linear = sum(term.value for term in speed_terms(hand(), tangent, 0.03))
    braking = series_stiffness(1e6, tangent) * speed**2 / (2.0 * 2.0)
    assert touch_n + 6.0 * 0.5 + linear * speed + braking == pytest.approx(force_n)
    none = largest_speed(
        hand(), force_n=6.0, threshold_n=3.0, tangent_n_per_m=tangent, delay_s=0.03
    )
    assert none == 0.0


def test_a_catch_up_hits_with_travel_damping_and_impact() -> None:
    rig, tangent, travel_m = hand(), 4e6, 1e-5
    speed = min(math.sqrt(2.0 * travel_m), travel_m / 0.004)
    impact = 3.0 * math.sqrt(10.0 * tangent * (tangent / 5e6))
    expected_n = series_stiffness(1e6, tangent) * travel_m + (300.0 + impact) * speed
    assert catch_up_force(rig, travel_m, tangent) == pytest.approx(expected_n)


def rigid(found: Pressing, factor: float) -> float:
    """Force per speed against a hidden hard stop, in N s/m."""
    rig = found.rig
    linear = (
        1.1 * rig.stiffness_n_per_m * (rig.reaction_s + rig.cross_check_s)
        + rig.damping_n_s_per_m
        + factor * math.sqrt(rig.mass_kg * HARD_STOP_N_PER_M)
    )
    braking = rig.stiffness_n_per_m * found.forces.limit_n / linear / (2.0 * rig.acceleration_m_s2)
    return linear + braking


def test_in_contact_a_hidden_hard_stop_is_counted_with() -> None:
    found = pressing()
    assert found.contact_n_s_per_m == pytest.approx(rigid(found, 3.0))


def test_no_approach_is_faster_than_a_rigid_obstacle_could_bear() -> None:
    """A plan whose budget against its soft payload would let it go faster."""
    soft = ContactLaw(2e5, 1.0, "(3)")
    plan = with_second(with_arm(effective_mass_kg=20.0), tolerance_n=1.0, time_s=0.001)
    found = pressing_for(plan, soft, soft, F_C)
    room_n = found.forces.allowed_n - 3.0 - 6.0 * 0.3
    bound = room_n / rigid(found, 3.0)
    assert found.fast_speed_m_s == pytest.approx(bound)
    assert found.guarded_speed_m_s <= bound
    budget = largest_speed(
        found.rig, force_n=found.forces.limit_n, threshold_n=3.0,
        tangent_n_per_m=found.tangent_n_per_m, delay_s=found.rig.reaction_s,
    )  # fmt: skip
    assert budget > 1.5 * bound


def budgeted(found: Pressing, force_n: float, threshold_n: float, delay_s: float) -> float:
    return largest_speed(
        found.rig, force_n=force_n, threshold_n=threshold_n,
        tangent_n_per_m=found.tangent_n_per_m, delay_s=delay_s,
    )  # fmt: skip


def test_the_guarded_approach_spends_its_share_of_the_limit_or_what_a_dead_channel_leaves() -> None:
    quick = with_second(tolerance_n=2.0, time_s=1e-4)
    for plan in (PLAN, quick, on_rig(second_force=ALONE)):
        found = pressing(plan)
        bounds = [budgeted(found, 0.4 * found.forces.limit_n, 3.0, found.rig.reaction_s),
                  (found.forces.allowed_n - 3.0 - 6.0 * 0.3) / rigid(found, 3.0)]  # fmt: skip
        if plan.rig.second_force is ALONE:
            bounds.append(found.travel_limit_free_m / (OLD_S + found.rig.reaction_s))
        if found.ahead_m == found.follow_m:
            catch_m = largest_catch_up(found.rig, found.forces.allowed_n, found.tangent_n_per_m)
            bounds.append(catch_m / LONGEST_STALL_S)
        assert found.guarded_speed_m_s == pytest.approx(min(bounds))


def test_where_following_cannot_be_seen_the_approach_is_slow() -> None:
    coarse = pressing(with_arm(lost_motion_m=1e-3))
    catch_m = largest_catch_up(coarse.rig, coarse.forces.allowed_n, coarse.tangent_n_per_m)
    assert coarse.follow_m > catch_m
    assert coarse.ahead_m == coarse.follow_m
    assert coarse.guarded_speed_m_s == pytest.approx(catch_m / LONGEST_STALL_S)
    fine = pressing()
    assert fine.ahead_m > fine.follow_m


def test_no_speed_is_above_four_fifths_of_the_arms() -> None:
    slow = pressing(with_arm(max_speed_m_s=1e-4))
    assert slow.guarded_speed_m_s == slow.fast_speed_m_s == pytest.approx(TOP_SPEED_SHARE * 1e-4)


def test_the_leash_and_the_noise_of_a_reading() -> None:
    found = pressing()
    assert found.reading_noise_n == pytest.approx(math.hypot(0.3, 0.05 / math.sqrt(12.0)))
    assert found.travel_limit_free_m == pytest.approx(
        travel_limit(375.0, 3.0, found.reading_noise_n, found.rig.stiffness_n_per_m)
    )
    assert found.tangent_n_per_m == pytest.approx(LAW.tangent(375.0))


def test_noise_and_drift_found_in_the_run_count_where_they_are_worse() -> None:
    procedure, loop_s = stvf_plan().procedure, pressing().rig.loop_s
    worse = pressing(measured=Measured(0.7, 4.0 / under_load_s(procedure, loop_s)))
    assert worse.rig.noise_n == 0.7
    headroom_n = worse.forces.allowed_n - worse.forces.largest_top_n
    assert headroom_n == pytest.approx(8.0 * 0.7 + 1.0)
    assert worse.forces.allowed_n == pytest.approx(
        (0.95 * F_C - 11.0 - cross_blind_n(stvf_plan().rig, 0.7) - 4.0) / 1.05
    )
    better = pressing(measured=Measured(0.01, 0.0))
    assert better == pressing()
    with pytest.raises(RefusedError, match="noise would be taken for a touch"):
        pressing(measured=Measured(0.76, 0.0), plan=stvf_plan(touch_force_n=3.0))


def test_one_channel_alone_pays_with_three_times_its_gain_and_capacity_bounds_all() -> None:
    alone = on_rig(second_force=ALONE)
    assert pressing(alone).forces.allowed_n == pytest.approx(0.95 * F_C * 0.985 - 1.0)
    assert pressing(with_arm(max_push_n=500.0)).forces.allowed_n == 500.0
    assert pressing(with_force(range_n=500.0)).forces.allowed_n == pytest.approx(475.0)
    with pytest.raises(RefusedError, match="nothing checks"):
        pressing(alone, 14.99)
    assert largest_top_force(alone, 300.0) == pytest.approx(
        0.95 * 300.0 * 0.985 - 1.0 - 8.0 * 0.3 - 1.0
    )
    assert largest_top_force(alone, 2.0) == 0.0
    unknown = replace(alone.rig.force, gain_uncertainty=0.34)
    with pytest.raises(RefusedError, match="all of the reading"):
        pressing(replace(alone, rig=replace(alone.rig, force=unknown)))


def test_the_limits_of_a_run_are_made_of_the_plan() -> None:
    limits, found = limits_for(PLAN), pressing()
    noise_n = found.reading_noise_n
    assert limits.elastic_limit_n == F_C
    assert limits.full_scale_n == 1000.0
    assert limits.reaction_s == found.rig.reaction_s
    assert limits.jump_n == pytest.approx(10.0 * noise_n + 2.0 * 0.05)
    assert limits.search_end_m == pytest.approx(0.002 - 0.0002 + 0.002)
    assert limits.still_m == pytest.approx(2.0 * (2e-6 + 6.0 * 3e-7))
    assert limits.band_n == pytest.approx(0.6)
    assert limits_for(with_force(noise_n=0.1)).band_n == 0.25
    assert limits.model_lag_s == MODEL_LAG_S
    assert (limits.travel_limit_time_s, limits.undetected_s) == (0.0, 0.0)
    alone = limits_for(on_rig(second_force=ALONE))
    assert (alone.travel_limit_time_s, alone.undetected_s) == (TRAVEL_LIMIT_TIME_S + OLD_S, OLD_S)
    assert alone.second_limit_n == 0.0
    assert limits.second_limit_n == pytest.approx(1.05 * limits.force_limit_n + 11.0)
    least, most = limits.answer_n_per_m, limits.answer_top_n_per_m
    touch_n, top_n = limits.touch_force_n, limits.top_force_n
    assert 0.0 < least < most
    assert limits.answer_at(0.0) == limits.answer_at(touch_n) == least
    assert limits.answer_at(0.5 * (touch_n + top_n)) == pytest.approx(0.5 * (least + most))
    assert limits.answer_at(top_n) == limits.answer_at(2.0 * top_n) == pytest.approx(most)
    assert limits.acceleration_m_s2 == 1.0
    assert limits.arm_acceleration_m_s2 == 2.0
    assert limits.period_s == 1e-3
    assert limits.channel_skew_s == channel_skew_s(PLAN.rig)
    assert limits.step_rate_per_s == pytest.approx(0.25 / found.rig.loop_s)
    assert limits.ahead_m == found.ahead_m
    assert limits.fast_speed_m_s == found.fast_speed_m_s
    assert limits.guarded_speed_m_s == min(found.guarded_speed_m_s, limits.fast_speed_m_s)
    assert (limits.cross_tolerance_n, limits.cross_relative, limits.cross_time_s) == (
        11,
        0.05,
        0.02,
    )
    lost = limits_for(with_arm(lost_motion_m=1e-5))
    assert lost.still_m == pytest.approx(2.0 * (2e-6 + 6.0 * 3e-7 + 1e-5))


def test_the_travel_is_that_of_a_rigid_surface_or_what_the_softest_payload_needs() -> None:
    for plan, slack_m in ((PLAN, 5.2e-6), (on_rig(second_force=ALONE), 0.0)):
        limits = limits_for(plan)
        for force_n in (3.0, 300.0):
            room_n = limits.force_limit_n - force_n - 6.0 * limits.noise_n
            rigid_m = room_n / limits.stiffness_n_per_m
            assert limits.travel_m(force_n) == pytest.approx(rigid_m + slack_m)
            soft = replace(limits, answer_n_per_m=1e3, answer_top_n_per_m=1e3)
            soft_m = limits.answers_n / 1e3
            assert soft.travel_m(force_n) == pytest.approx(soft_m + slack_m)


@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0, -1.0])
def test_an_elastic_limit_that_is_no_number_has_no_ladder(value: float) -> None:
    with pytest.raises(DomainError, match="elastic limit F_c"):
        ladder(elastic_limit_n=value)


def test_a_sensor_that_is_found_noisier_is_not_called_frozen_later() -> None:
    coarse = with_force(resolution_n=0.9)
    planned = limits_for(coarse).identical_counts
    assert limits_for(coarse, measured=Measured(0.6, 0.0)).identical_counts == planned


def test_a_hazard_is_named_where_it_applies() -> None:
    def named(plan: Plan) -> set[str]:
        return {each.code for each in hazards_of(plan.rig)}

    alone = on_rig(second_force=ALONE)
    assert "both_channels_alike" in named(PLAN) - named(alone)
    assert "one_force_channel" in named(alone) - named(PLAN)
    guided = on_rig(arm=replace(PLAN.rig.arm, structure=Structure.MACHINE))
    arm = on_rig(arm=replace(PLAN.rig.arm, structure=Structure.ARM))
    assert named(arm) - named(guided) >= {"clings_on_the_way_back", "friction_stiffens"}
    one = on_rig(arm, force=replace(PLAN.rig.force, components="one"))
    assert "sideways_unseen" in named(one) - named(arm)


def codes(plan: Plan) -> set[str]:
    return {reason.code for reason in preflight_of(plan).reasons}


@pytest.mark.parametrize(
    ("code", "there", "not_there"),
    [
        ("arm_too_weak", with_arm(max_push_n=299.0), with_arm(max_push_n=400.0)),
        ("sensor_range", with_force(range_n=299.0), with_force(range_n=400.0)),
        ("patient", with_arm(max_age_s=0.013), with_arm(max_age_s=0.012)),
        ("patient", with_force(max_age_s=0.013), with_force(max_age_s=0.012)),
        ("stiffness_uncertain", with_stiffness(sigma_n_per_m=0.051 * 3.49e6),
         with_stiffness(sigma_n_per_m=0.049 * 3.49e6)),
        ("stiffness_indicative", with_stiffness(provenance=Provenance.INDICATIVE), PLAN),
        ("calibration_simulated", with_stiffness(simulated=True, record=Path("ks.json")), PLAN),
        ("calibration_record", with_stiffness(validity_problem="expired"), PLAN),
    ],
)  # fmt: skip
def test_each_reason_is_given_where_it_holds_and_nowhere_else(
    code: str, there: Plan, not_there: Plan
) -> None:
    assert code in codes(there)
    assert code not in codes(not_there)


def test_a_refused_plan_is_shown_at_the_largest_safe_force() -> None:
    preflight = preflight_for(stvf_plan(), 250.0)
    assert preflight.limits is None
    assert preflight.verdict == "refused"
    assert 0.0 < preflight.force_limit_n < 250.0
    assert preflight.guarded_speed_m_s > 0.0
    with pytest.raises(RefusedError):
        _ = preflight.run_limits
    hopeless = preflight_for(stvf_plan(), 5.0)
    assert hopeless.guarded_speed_m_s == hopeless.force_limit_n == 0.0
    assert hopeless.stages == ()


def test_the_schedule_adds_up() -> None:
    plan = stvf_plan(cycles=2, surface_distance_m=3e-3, surface_uncertainty_m=5e-4)
    procedure = plan.procedure
    limits = replace(
        limits_for(plan), fast_speed_m_s=0.01, guarded_speed_m_s=0.001, step_rate_per_s=10.0,
        reaction_s=0.005, position_resolution_m=1e-6, lost_motion_m=0.0,
    )  # fmt: skip
    loading_times = LoadTimes(0.0, (0.5,) * 5 + (2.0,), (0.4,) * 4 + (0.6,))
    stages = {s.name: s for s in schedule(procedure, limits, loading_times)}
    way_m = 2.5e-3 + procedure.retract_m - 1e-4
    hold_s = 0.4 + 1.2
    up, down = stages["load step with hold"], stages["unload step with hold"]
    assert up.total_s == pytest.approx(2 * 4.5 + 12 * hold_s)
    assert up.parts_s == pytest.approx((0.5 + hold_s,) * 5 + (2.0 + hold_s,))
    assert down.total_s == pytest.approx(2 * 2.2 + 10 * hold_s)
    assert down.parts_s == pytest.approx((0.6 + hold_s,) + (0.4 + hold_s,) * 4)
    assert stages["fast approach"].total_s == pytest.approx(way_m / 0.01)
    assert stages["guarded approach"].total_s == pytest.approx(0.6 + 0.2)
    assert stages["tare and drift check"].total_s == pytest.approx(1.0)
    assert stages["touch again"].repeats == 1
    assert preflight_of(ur_plan()).duration_s == pytest.approx(
        sum(stage.total_s for stage in preflight_of(ur_plan()).stages)
    )


def test_a_zero_is_renewed_when_it_has_moved_and_two_retracts_of_way_are_gained() -> None:
    limits = replace(
        limits_for(PLAN), fast_speed_m_s=1e-3, guarded_speed_m_s=1e-4, moved_zero_n=1.0,
    )  # fmt: skip

    def times(usual_n_per_s: float, way_m: float = 9.5e-3, retract_m: float = 1e-3) -> int:
        drifting = replace(limits, drift_n_per_s=3.0 * usual_n_per_s)
        return renewals(drifting, 9e-3, way_m, retract_m)

    assert times(0.0) == times(1.0 / 14.1) == 0  # 9 s fast, 5 s guarded
    assert times(1.0 / 13.9) == 1
    assert times(1e9) == 4  # at 2, 4, 6 and 8 mm
    assert times(1e9, retract_m=4.8e-3) == 0
    assert times(0.2) == 2  # 5 s: at 5 mm, then from 4 mm on at 9 mm


def test_a_frozen_value_is_as_many_as_a_quantised_sensor_never_repeats() -> None:
    sensor = PLAN.rig.force
    for quantum, noise in ((0.5, 0.2), (0.9, 0.3)):
        stays = math.erf(quantum / (2.0 * math.sqrt(2.0) * noise))
        counts = math.ceil(math.log(1e-11) / math.log(stays))
        assert identical_counts(replace(sensor, resolution_n=quantum), noise) == max(25, counts)
        assert counts > 25
    assert identical_counts(replace(sensor, resolution_n=1.5), 0.01) == 0
    assert identical_counts(replace(sensor, resolution_n=0.0), 0.3) == 25
    assert identical_counts(replace(sensor, resolution_n=1e-300), 0.3, 7) == 7
