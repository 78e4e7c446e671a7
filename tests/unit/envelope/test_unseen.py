"""How long a frozen force channel goes unseen, and the force that can build up beside it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from run_plans import (
    COARSE_F_C_N,
    coarse_plan,
    envelope_for,
    limits_for,
    stvf_plan,
    ur_plan,
)

from stepload.envelope.bounds import cross_blind_n
from stepload.envelope.envelope import envelope_of
from stepload.envelope.limits import RunLimits
from stepload.envelope.reason import PlanVerdict, Reason, Severity
from stepload.envelope.unseen import (
    GAINS,
    Unseen,
    both_silent_reasons,
    dead_drift_reasons,
    deaf_approach_reasons,
    silent_reasons,
    tells_of,
    unseen,
    unseen_reasons,
)
from stepload.plan.model import Plan, SecondForce, SecondForceSource

PLAN = coarse_plan()
LIMITS = limits_for(PLAN, COARSE_F_C_N)
BLIND = replace(LIMITS, second_stands_n=1e12)
"""Without the rule for a second sensor that stands."""


def of(plan: Plan, limits: RunLimits) -> Unseen:
    found = unseen(plan, limits)
    assert found is not None
    return found


def said(plan: Plan, limits: RunLimits) -> Reason:
    [reason] = unseen_reasons(plan, limits)
    return reason


def test_times_are_counts_over_the_rate_of_each_channel() -> None:
    found = of(PLAN, LIMITS)
    assert found.main_s == LIMITS.identical_counts / 500.0
    assert found.second_s == LIMITS.second_identical_counts / 500.0 > 14.0
    arm = ur_plan()
    assert of(arm, limits_for(arm)).second_s == 100 / arm.rig.arm.rate_hz
    never = replace(LIMITS, identical_counts=0, second_identical_counts=0)
    assert of(PLAN, never).main_s == of(PLAN, never).second_s == math.inf
    assert math.isfinite(of(PLAN, never).force_n)


def test_a_hole_that_a_search_found_is_refused_without_the_rule_that_closes_it() -> None:
    """Main channel 0.37, coarse second one frozen: 1.53 F_c in a run of that plan."""
    sound = said(PLAN, LIMITS)
    assert sound.severity is Severity.NOTE
    assert sound.value < sound.limit == LIMITS.counted_limit_n
    assert "after 14.8 s" in sound.message
    hole = said(PLAN, BLIND)
    assert hole.severity is Severity.REFUSE
    assert hole.value > 1.53 * COARSE_F_C_N
    assert "lower load_rate" in hole.remedy


def test_a_refusal_is_a_verdict_of_preflight(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stepload.envelope.limits.second_stands_n", lambda *_: 1e12)
    assert envelope_for(PLAN, COARSE_F_C_N).verdict is PlanVerdict.REFUSED
    monkeypatch.undo()
    codes = {reason.code: reason.severity for reason in envelope_for(PLAN, COARSE_F_C_N).reasons}
    assert codes["frozen_channel"] is Severity.NOTE


def test_with_one_channel_nothing_is_compared() -> None:
    rig = replace(PLAN.rig, second_force=SecondForce(SecondForceSource.NONE, 0.0, 0.0, 0.0, 0.0))
    alone = replace(PLAN, rig=rig)
    assert unseen(alone, limits_for(alone, COARSE_F_C_N)) is None
    assert not list(unseen_reasons(alone, limits_for(alone, COARSE_F_C_N)))


def test_a_channel_that_is_right_comes_to_the_top_force_and_no_further() -> None:
    assert of(PLAN, BLIND).forces_n[-1] == pytest.approx(LIMITS.top_force_n)
    assert GAINS[-1] == pytest.approx(1.0)


def test_each_of_the_rules_ends_it() -> None:
    """The least gain, term by term: F = tol / (1 - g - g tol_rel), and what comes on top of it."""
    gain = GAINS[0]
    relative = LIMITS.cross_relative
    tolerance_n = LIMITS.cross_tolerance_n + cross_blind_n(PLAN.rig, LIMITS.noise_n)
    frozen_n = tolerance_n / (1.0 - gain - gain * relative)

    def beyond_n(limits: RunLimits) -> float:
        return of(PLAN, limits).forces_n[0] - frozen_n

    cap = LIMITS.stiffness_n_per_m * (LIMITS.force_limit_n - gain * frozen_n)
    slow = replace(BLIND, load_rate_n_per_s=0.1)
    assert cap / LIMITS.contact_n_s_per_m > 0.1 / gain
    rate = 0.1 / gain
    assert beyond_n(slow) == pytest.approx(rate * (of(PLAN, slow).second_s + LIMITS.reaction_s))
    stands = replace(LIMITS, second_identical_counts=0, load_rate_n_per_s=0.1)
    forgets_s = 2.0 * LIMITS.channel_skew_s + 8.0 * LIMITS.cross_filter_s
    assert beyond_n(stands) == pytest.approx(
        LIMITS.second_stands_n / gain + rate * (forgets_s + LIMITS.reaction_s)
    )
    ever = replace(slow, second_identical_counts=0)
    most_n = ((frozen_n + tolerance_n) / (1.0 - relative) - gain * frozen_n) / gain
    assert beyond_n(ever) == pytest.approx(most_n + rate * (0.02 + LIMITS.reaction_s))
    low = replace(ever, top_force_n=gain * frozen_n + 1.0)
    assert beyond_n(low) == pytest.approx(1.0 / gain)
    fast = replace(BLIND, load_rate_n_per_s=1e4, second_identical_counts=25)
    rate = cap / LIMITS.contact_n_s_per_m
    assert beyond_n(fast) == pytest.approx(rate * (25 / 500.0 + LIMITS.reaction_s))


@pytest.mark.parametrize(
    ("counts", "second", "told"),
    [(25, 100, (True, True)), (0, 100, (False, True)), (25, 0, (True, False)),
     (10_000, 10_000, (True, True)), (10_001, 100, (False, True)), (25, 10_001, (True, False))],
)  # fmt: skip
def test_an_approach_waits_for_a_channel_that_speaks_within_20_s(
    counts: int, second: int, told: tuple[bool, bool]
) -> None:
    limits = replace(LIMITS, identical_counts=counts, second_identical_counts=second)
    tells = tells_of(PLAN, limits)
    assert (tells.main, tells.second) == told
    alone = tells_of(PLAN, replace(limits, cross_check=""))
    assert (alone.main, alone.second) == (told[0], False)


def test_no_channel_that_is_waited_for_stands_for_longer_than_equal_samples_tell() -> None:
    """500 Hz; one that is not waited for does not count."""
    for counts, second, patience_s in ((50, 100, 0.2), (200, 100, 0.4), (200, 10_001, 0.4)):
        limits = replace(LIMITS, identical_counts=counts, second_identical_counts=second)
        assert tells_of(PLAN, limits).patience_s == pytest.approx(patience_s)


def test_a_channel_that_an_approach_cannot_wait_for_is_named() -> None:
    way_m = PLAN.procedure.search_distance_m
    reach_n = LIMITS.stiffness_n_per_m * way_m + LIMITS.cross_tolerance_n
    assert not list(silent_reasons(PLAN, LIMITS))
    for limits, name in (
        (replace(LIMITS, identical_counts=0), "a sound force may"),
        (replace(LIMITS, second_identical_counts=0), "a sound second_force may"),
    ):
        [reason] = silent_reasons(PLAN, limits)
        assert reason.code == "silent_channel"
        assert reason.severity is Severity.NOTE
        assert reason.value == pytest.approx(reach_n)
        assert name in reason.message
        assert "the other dead" in reason.message
        softer = replace(limits, counted_limit_n=1.01 * reach_n)
        assert not list(silent_reasons(PLAN, softer))
    alone = replace(LIMITS, identical_counts=0, cross_check="", cross_tolerance_n=0.0)
    [reason] = silent_reasons(PLAN, alone)
    assert reason.severity is Severity.WARN
    assert "the other" not in reason.message


def test_two_silent_channels_are_named_where_a_soft_payload_gets_more_of_the_leash() -> None:
    """As far as it bears itself is more than something rigid does."""
    soft = replace(LIMITS, leash_proved=1.6)
    step_n = LIMITS.stiffness_n_per_m * LIMITS.position_resolution_m
    most_n = 1.6 * LIMITS.force_limit_n + step_n
    held_n = most_n + LIMITS.stiffness_n_per_m * LIMITS.lead_m
    assert held_n > most_n > 1.6 * LIMITS.force_limit_n
    [reason] = both_silent_reasons(replace(soft, counted_limit_n=0.999 * most_n))
    assert reason.value == pytest.approx(most_n)
    assert reason.severity is Severity.WARN
    assert "both force channels" in reason.message
    [held] = both_silent_reasons(replace(soft, counted_limit_n=0.5 * (most_n + held_n)))
    assert held.severity is Severity.NOTE
    one = replace(soft, cross_check="", counted_limit_n=0.5 * (most_n + held_n))
    assert [each.severity for each in both_silent_reasons(one)] == [Severity.WARN]
    assert not list(both_silent_reasons(replace(soft, counted_limit_n=1.001 * held_n)))
    assert not list(both_silent_reasons(replace(LIMITS, leash_proved=1.0)))
    [alone] = both_silent_reasons(replace(soft, cross_check="", counted_limit_n=1.0))
    assert "the force channel falls" in alone.message


def test_an_approach_with_dead_channels_comes_to_what_the_search_allows() -> None:
    """Or to what the arm can push; one channel that dies is enough where there is one."""
    reach_n = LIMITS.stiffness_n_per_m * PLAN.procedure.search_distance_m
    assert reach_n < PLAN.rig.arm.max_push_n
    below, above = (replace(LIMITS, counted_limit_n=each * reach_n) for each in (0.999, 1.001))
    [reason] = deaf_approach_reasons(PLAN, below, shaken=False)
    assert (reason.code, reason.severity) == ("deaf_approach", Severity.NOTE)
    assert reason.value == pytest.approx(reach_n)
    assert "both force channels" in reason.message
    assert "push by hand" in reason.message
    assert "tool_mass" in reason.remedy
    [reason] = deaf_approach_reasons(PLAN, below, shaken=True)
    assert "shake" in reason.message
    assert "tool_mass" not in reason.remedy
    assert not list(deaf_approach_reasons(PLAN, above, shaken=False))
    weak_n = 0.5 * reach_n
    weak = replace(PLAN, rig=replace(PLAN.rig, arm=replace(PLAN.rig.arm, max_push_n=weak_n)))
    alone = replace(LIMITS, cross_check="", counted_limit_n=0.999 * weak_n)
    [reason] = deaf_approach_reasons(weak, alone, shaken=False)
    assert (reason.value, reason.severity) == (pytest.approx(weak_n), Severity.WARN)
    assert "the only force channel" in reason.message


def test_the_drift_of_dead_channels_that_passes_for_an_answer_is_named() -> None:
    """An answer in the time that a leash takes near a level, or a step before R6 has waited, and
    less than a third of that for what small steps came to."""
    [reason] = dead_drift_reasons(PLAN, LIMITS)
    room_n = LIMITS.force_limit_n - LIMITS.top_force_n - 6.0 * LIMITS.noise_n
    leash_n = LIMITS.leash_proved * room_n
    answer_n = LIMITS.answer_top_n_per_m * leash_n / LIMITS.stiffness_n_per_m
    a_leash = 2.0 * LIMITS.step_rate_per_s * answer_n**2 / leash_n
    a_step = 0.5 * PLAN.procedure.step_n / 6.0
    assert reason.value == pytest.approx(0.3 * min(a_leash, a_step))
    assert f"jumps of {answer_n:.2g} N" in reason.message
    assert reason.severity is Severity.NOTE
    small = replace(PLAN, procedure=replace(PLAN.procedure, step_n=1e-3))
    [reason] = dead_drift_reasons(small, LIMITS)
    assert reason.value == pytest.approx(0.3 * 0.5e-3 / 6.0)
    stops = replace(LIMITS, leash_share=0.5, leash_proved=1.0, answer_top_n_per_m=1e-3)
    [reason] = dead_drift_reasons(PLAN, stops)
    assert reason.value == pytest.approx(0.3 * a_step)
    [alone] = dead_drift_reasons(PLAN, replace(LIMITS, cross_check=""))
    assert alone.severity is Severity.WARN
    assert "dead_drift" in {each.code for each in envelope_for(PLAN, COARSE_F_C_N).reasons}


def test_the_envelope_hands_down_whom_an_approach_listens_to() -> None:
    envelope = envelope_for(PLAN, COARSE_F_C_N)
    assert (envelope.tells.main, envelope.tells.second) == (True, True)
    codes = {reason.code for reason in envelope.reasons}
    assert "silent_channel" not in codes
    assert "deaf_approach" in codes
    sensor = PLAN.rig.second_force.sensor
    assert sensor is not None
    second = replace(PLAN.rig.second_force, noise_n=1e-4, sensor=replace(sensor, noise_n=1e-4))
    silent = envelope_for(replace(PLAN, rig=replace(PLAN.rig, second_force=second)), COARSE_F_C_N)
    assert (silent.tells.main, silent.tells.second) == (True, False)
    assert "silent_channel" in {reason.code for reason in silent.reasons}


@pytest.mark.parametrize("plan", [ur_plan(), stvf_plan()])
def test_usual_rigs_pass(plan: Plan) -> None:
    assert said(plan, limits_for(plan)).severity is Severity.NOTE
    assert "frozen_channel" in {reason.code for reason in envelope_of(plan).reasons}
