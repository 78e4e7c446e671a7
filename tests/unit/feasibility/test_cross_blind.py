"""What noise hides from R5, against the comparison that R5 makes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from run_plans import limits_for, stvf_plan

from stepload.engine.cross_check import CrossCheck
from stepload.feasibility.bounds import (
    CROSS_CHECK_FILTER_S,
    channel_skew_s,
    common_error,
    cross_blind_n,
)
from stepload.plan.model import Plan, Rig, SecondForce, SecondForceSource

PLAN = stvf_plan()
NOISE_N = 0.5
F_C = 727.0


def rig_of(
    tick_hz: float, main_hz: float, second_hz: float, second_n: float, delay_s: float
) -> Rig:
    rig = PLAN.rig
    sensor = replace(rig.force, rate_hz=second_hz)
    return replace(
        rig,
        arm=replace(rig.arm, rate_hz=tick_hz),
        force=replace(rig.force, rate_hz=main_hz, delay_s=delay_s),
        second_force=replace(rig.second_force, noise_n=second_n, sensor=sensor),
    )


def beyond(rig: Rig, difference_n: float) -> float:
    """Share of the ticks in which R5 sees a difference at all, of channels that differ by this."""
    rng = np.random.default_rng(7)
    tick_s, skew_s = 1.0 / rig.arm.rate_hz, channel_skew_s(rig)
    second = rig.second_force
    assert second.sensor is not None
    noises_n = NOISE_N, second.noise_n
    check = CrossCheck(tick_s, skew_s, CROSS_CHECK_FILTER_S, noises_n)
    ticks = 4000

    def read(noise_n: float, rate_hz: float) -> list[float]:
        repeats = max(1, round(rig.arm.rate_hz / rate_hz))
        fresh = rng.normal(0.0, noise_n, ticks // repeats + 1)
        return np.repeat(fresh, repeats)[:ticks].tolist()  # type: ignore[no-any-return]

    seen = 0
    main, other = read(noises_n[0], rig.force.rate_hz), read(noises_n[1], second.sensor.rate_hz)
    for main_n, second_n in zip(main, other, strict=True):
        check.add(main_n, second_n + difference_n)
        seen += check.difference_n > 0.0
    return seen / ticks


RIGS = [
    rig_of(tick_hz, main_hz, second_hz, second_n, delay_s)
    for tick_hz, main_hz, second_hz in (
        (500.0, 1000.0, 500.0),
        (500.0, 100.0, 100.0),
        (500.0, 500.0, 25.0),
        (125.0, 125.0, 125.0),
        (100.0, 1000.0, 50.0),
    )
    for second_n in (0.5, 4.0)
    for delay_s in (0.002, 0.03)
]


@pytest.mark.parametrize("rig", RIGS)
def test_a_difference_that_noise_cannot_hide_is_seen_in_most_ticks(rig: Rig) -> None:
    blind_n = cross_blind_n(rig, NOISE_N)
    assert beyond(rig, blind_n) > 0.55
    assert beyond(rig, 0.2 * blind_n) < 0.7


def test_noise_that_was_found_counts_where_it_is_worse_than_stated() -> None:
    rig = rig_of(500.0, 500.0, 500.0, 1.0, 0.03)
    stated_n = cross_blind_n(rig, 0.0)
    assert cross_blind_n(rig, 0.0, 1.0) == cross_blind_n(rig, 0.2, 0.2) == stated_n
    assert cross_blind_n(rig, 0.0, 2.0) > stated_n + 1.0
    assert cross_blind_n(rig, 1.3, 0.0) > stated_n + 1.0


def noisy(noise_n: float) -> Plan:
    second = replace(PLAN.rig.second_force, noise_n=noise_n)
    return replace(PLAN, rig=replace(PLAN.rig, second_force=second))


def test_the_force_limit_leaves_room_for_what_noise_hides() -> None:
    quiet, loud = (limits_for(noisy(each), F_C).allowed_n for each in (0.0, 8.0))
    hidden_n = cross_blind_n(noisy(8.0).rig, 0.3) - cross_blind_n(noisy(0.0).rig, 0.3)
    assert hidden_n > 1.5
    assert quiet - loud == pytest.approx(hidden_n / 1.05)


def allowed_n(u: float, second_u: float | None, crooked: float | None = None) -> float:
    """F_allowed of sensors with these uncertainties of their gains; None: no second channel."""
    rig = PLAN.rig
    force = replace(rig.force, gain_uncertainty=u, nonlinearity=crooked)
    second = SecondForce()
    if second_u is not None:
        sensor = replace(rig.force, gain_uncertainty=second_u)
        second = replace(rig.second_force, source=SecondForceSource.SENSOR, sensor=sensor)
    plan = replace(PLAN, rig=replace(rig, force=force, second_force=second))
    return limits_for(plan, F_C).allowed_n


def test_two_gains_that_may_both_be_too_low_count_where_that_is_more_than_they_share() -> None:
    shared = allowed_n(0.02, 0.1)
    assert allowed_n(0.1, 0.02) == allowed_n(0.005, 0.005) == shared
    both = allowed_n(0.1, 0.12)
    assert shared - both == pytest.approx(F_C * (0.3 / math.sqrt(2.0) - 0.05) / 1.05)


def test_what_bends_the_only_channel_counts_as_stated() -> None:
    straight = allowed_n(0.01, None)
    assert allowed_n(0.01, None, 0.02) == straight
    assert straight - allowed_n(0.01, None, 0.1) == pytest.approx(0.95 * F_C * 0.07, rel=1e-3)


def test_what_is_said_of_a_common_error_is_what_is_counted() -> None:
    rig = rig_of(500.0, 500.0, 500.0, 0.5, 0.002)
    assert common_error(rig) == (rig.common_force_error, "rig.common_force_error")
    sensor = rig.second_force.sensor
    assert sensor is not None
    second = replace(rig.second_force, sensor=replace(sensor, gain_uncertainty=0.2))
    share, source = common_error(
        replace(rig, force=replace(rig.force, gain_uncertainty=0.1), second_force=second)
    )
    assert share == pytest.approx(0.3 / math.sqrt(2.0))
    assert source == "2.1 times the smaller gain_uncertainty of both sensors"
