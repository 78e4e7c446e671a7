"""R12, R13 and R14: dragged sideways, near a rating, touched beside the pressing axis."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from run_plans import limits_for, stvf_plan

from stepload.contact.lateral import left_of_limit
from stepload.engine.supervisor import Supervisor
from stepload.engine.tare import TareWindow
from stepload.engine.watch import ForceWatch, Trip
from stepload.engine.wrench import LATERAL_TIME_S, WrenchRules
from stepload.feasibility.bounds import Measured
from stepload.feasibility.lateral import (
    dragged_left,
    lateral_limits,
    lateral_reasons,
    yielding_ratios,
)
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.preflight import preflight_of
from stepload.feasibility.pressing import largest_top_force
from stepload.plan.model import Alignment, Plan, Structure
from stepload.record.outcome import Cause
from stepload.record.rows import Phase
from stepload.rig.samples import ArmSample, ForceSample

HOLD, SEARCH = int(Phase.HOLD), int(Phase.GUARDED_APPROACH)
RETRACT = int(Phase.RETRACT)
PLAN = stvf_plan()
LIMITS = replace(limits_for(PLAN), cross_check="")
PERIOD_S = LIMITS.period_s


class Feed:
    """A supervisor that gets the wrench it is told, tick by tick, with a little noise."""

    def __init__(self, limits: RunLimits = LIMITS, axis: str = "+fz") -> None:
        self.supervisor = Supervisor(limits, axis)
        self.tick = 0
        self.press([0.0] * 6, 3, SEARCH)
        self.supervisor.tare(0.0, 0.0)

    def press(self, wrench: Any, ticks: int = 1, phase: int = HOLD) -> Cause | None:
        """So many ticks of this wrench; the cause that the supervisor latched, if any."""
        cause = None
        for _ in range(ticks):
            self.tick += 1
            now_s = self.tick * PERIOD_S
            live = [float(value) + 1e-6 * (self.tick % 5) for value in wrench]
            force = ForceSample(self.tick, now_s, now_s, 0, tuple(live), 20.0)  # type: ignore[arg-type]
            arm = ArmSample(self.tick, now_s, now_s, 0, 0.0, math.nan, (0.0,) * 6)
            cause = self.supervisor.check(now_s, [force], [arm], [], 0.0, 1e-6, phase)
        return cause

    def ramp(self, wrench: Any, phase: int = HOLD) -> Cause | None:
        """Up to this wrench as slowly as no other rule minds."""
        cause = None
        for part in np.linspace(0.0, 1.0, 3000):
            cause = cause or self.press(part * np.asarray(wrench), 1, phase)
        return cause or self.press(wrench, 200, phase)


@pytest.mark.parametrize(("share", "stops"), [(0.27, False), (0.33, True), (-0.33, True)])
def test_too_much_force_across_the_axis_stops_the_run(share: float, stops: bool) -> None:
    cause = Feed().ramp([share * 100.0, 0.0, 100.0, 0.0, 0.0, 0.0])
    assert (cause is not None and cause.rule == "R12") is stops
    if cause is not None:
        assert (cause.limit, cause.unit) == (100.0 * PLAN.procedure.max_lateral_share, "%")
        assert cause.value > cause.limit


def dying_across(axis: str, *, dead_from: int, steps_of: int = 1) -> list[Trip]:
    """Breaches of a noisy sensor pressed at 50 N from sample 100 on, zeroed there, whose components
    across the axis read 0 from some sample on; they change every `steps_of` samples."""
    watch = ForceWatch(
        "force", axis, full_scale_n=1e3, stale_s=1.0, identical_counts=25, clock_s=1.0
    )
    noise = np.random.default_rng(1).normal(0.0, 0.1, (400, 6))
    found = []
    for number in range(400):
        wrench = noise[number // steps_of * steps_of]
        press = watch.axis[0]
        wrench[press] = noise[number][press] + (50.0 if number >= 100 else 0.0)
        if number >= dead_from:
            wrench[[i for i in range(6) if i != press]] = 0.0
        if number == 100:
            watch.tare()
        now_s = 0.002 * number
        sample = ForceSample(number, now_s, now_s, 0, tuple(wrench.tolist()), 20.0)
        trip = watch.take([sample], now_s)
        if trip is not None:
            found.append(trip)
    return found


@pytest.mark.parametrize("axis", ["+fz", "-fx", "+fy"])
def test_a_sensor_that_dies_across_the_axis_stops_the_run(axis: str) -> None:
    """Nothing else would tell: what it no longer shows is what R12 judges."""
    first, *_ = dying_across(axis, dead_from=200)
    assert (first.rule, first.value, first.limit) == ("R4", 26.0, 25.0)
    assert "across the axis" in first.message
    assert dying_across(axis, dead_from=400) == []
    assert dying_across(axis, dead_from=0) == []  # a load cell
    assert dying_across(axis, dead_from=400, steps_of=20) == []  # coarse, and sound


@pytest.mark.parametrize("noise_steps", [0.1, 0.2, 0.3, 0.4, 0.6])
@pytest.mark.parametrize("between", [0.0, 0.3, 0.5])
def test_a_sensor_of_little_noise_beside_its_resolution_may_stand_across(
    noise_steps: float, between: float
) -> None:
    """It flickers between two steps in free air, and stands as soon as a force moves its mean."""
    watch = ForceWatch(
        "force", "+fz", full_scale_n=1e3, stale_s=1.0, identical_counts=25, clock_s=1.0
    )
    step_n, noise = 0.1, np.random.default_rng(1).normal(0.0, noise_steps, (5000, 3))
    for number, row in enumerate(noise):
        pressed = number > 1000
        across = np.floor(row[:2] + (0.0 if pressed else between) + 0.5) * step_n
        wrench = (*across.tolist(), float(row[2]), 0.0, 0.0, 0.0)
        if number == 1000:
            watch.tare()
        now_s = 0.002 * number
        assert watch.take([ForceSample(number, now_s, now_s, 0, wrench, 20.0)], now_s) is None


def test_a_coarse_sensor_that_dies_across_is_given_longer() -> None:
    watch = ForceWatch(
        "force", "+fz", full_scale_n=1e3, stale_s=1.0, identical_counts=25, clock_s=1.0
    )
    noise, found = np.random.default_rng(2).normal(0.0, 0.35, (2000, 3)), []
    for number, row in enumerate(noise):
        across = np.floor(row[:2] + 0.5) if number < 1500 else np.zeros(2)
        if number == 1000:
            watch.tare()
        now_s = 0.002 * number
        wrench = (*across.tolist(), float(row[2]), 0.0, 0.0, 0.0)
        found.append(watch.take([ForceSample(number, now_s, now_s, 0, wrench, 20.0)], now_s))
    [first, *_] = [trip for trip in found if trip is not None]
    assert (first.rule, first.limit) == ("R4", 150.0)
    assert 1500 < found.index(first) < 1660


def test_both_components_across_the_axis_count() -> None:
    cause = Feed().ramp([25.0, 25.0, 100.0, 0.0, 0.0, 0.0])
    assert cause is not None
    assert cause.rule == "R12"


def test_at_small_force_the_share_says_nothing() -> None:
    assert LIMITS.lateral_from_n >= 5.0
    assert (
        Feed().ramp([0.5 * LIMITS.lateral_from_n, 0.0, 0.8 * LIMITS.lateral_from_n, 0, 0, 0])
        is None
    )


def test_a_payload_that_bears_little_is_not_dragged_by_little() -> None:
    """F_allowed of 7 N: 2 N along and 1.2 N across are less than 5 N, and too much."""
    foot_n = lateral_limits(PLAN, 0.01, 7.0)["lateral_from_n"]
    load = [1.2, 0.0, 2.0, 0.0, 0.0, 0.0]
    assert foot_n < math.hypot(*load[:3]) < 5.0
    assert Feed().ramp(load) is None
    cause = Feed(replace(LIMITS, lateral_from_n=foot_n)).ramp(load)
    assert cause is not None
    assert cause.rule == "R12"


def test_a_short_push_sideways_is_forgiven() -> None:
    feed = Feed()
    assert feed.ramp([0.0, 0.0, 100.0, 0.0, 0.0, 0.0]) is None
    for _ in range(6):
        assert feed.press([45.0, 0.0, 100.0, 0.0, 0.0, 0.0], round(0.015 / PERIOD_S)) is None
        assert feed.supervisor.wrench.share > PLAN.procedure.max_lateral_share
        assert feed.press([0.0, 0.0, 100.0, 0.0, 0.0, 0.0], 200) is None
    cause = feed.press([45.0, 0.0, 100.0, 0.0, 0.0, 0.0], round(0.06 / PERIOD_S))
    assert cause is not None
    assert cause.rule == "R12"


def test_a_force_that_falls_fast_makes_no_share_of_its_own() -> None:
    feed, load = Feed(replace(LIMITS, jump_n=1e9)), np.array([20.0, 0.0, 100.0, 0.0, 0.0, 0.0])
    assert feed.ramp(load) is None
    for tick in range(round(0.1 / PERIOD_S)):
        feed.press(math.exp(-tick * PERIOD_S / 0.03) * load)
        if feed.supervisor.wrench.share:
            assert feed.supervisor.wrench.share == pytest.approx(0.2, rel=0.02)


def test_in_a_retract_the_whole_force_counts_and_the_share_alone_does_not() -> None:
    dragged = [45.0, 0.0, 100.0, 0.0, 0.0, 0.0]
    assert Feed().ramp(dragged, RETRACT) is None
    held = Feed().ramp(dragged, HOLD)
    assert held is not None
    assert held.rule == "R12"
    less = replace(LIMITS, allowed_n=100.0)
    leaving = Feed(less).ramp(dragged, RETRACT)
    assert leaving is not None
    assert (leaving.rule, leaving.unit) == ("R12", "N")


def test_in_an_approach_it_is_r11_that_judges() -> None:
    feed = Feed()
    for part in np.linspace(0.0, 1.0, 1000):
        assert feed.press(part * np.array([40.0, 0.0, 60.0, 0.0, 0.0, 0.0]), 1, SEARCH) is None


def test_a_payload_that_is_dragged_is_pressed_less() -> None:
    """F_lim at F_allowed; at a share of 0.25 the whole force may be F_allowed (1 - a t²) only."""
    limits = replace(LIMITS, force_limit_n=LIMITS.allowed_n)
    share = 0.25
    worse = share * (share + 2.0 * limits.lateral_askew)
    left_n = limits.allowed_n * (1.0 - limits.lateral_weakening * worse)
    assert left_n < 0.9 * limits.allowed_n
    along_n = left_n / math.hypot(1.0, share)
    just_below, above = 0.97 * along_n, 1.01 * along_n
    for force_n, stops in ((just_below, False), (above, True)):
        cause = Feed(limits).ramp([share * force_n, 0.0, force_n, 0.0, 0.0, 0.0])
        assert (cause is not None) is stops
        if cause is not None:
            assert cause.rule == "R12"
            assert cause.limit == pytest.approx(left_n, rel=0.01)


@pytest.mark.parametrize(
    ("measured_deg", "mounted_deg", "hidden_deg"),
    [(None, None, 5.0), (1.0, None, 3.0), (1.0, 0.0, 1.0)],
)
def test_what_tilt_mounting_and_cross_talk_hide_of_the_share_is_counted(
    measured_deg: float | None, mounted_deg: float | None, hidden_deg: float
) -> None:
    alignment = None if measured_deg is None else Alignment(max_tilt_rad=math.radians(measured_deg))
    mounted_rad = None if mounted_deg is None else math.radians(mounted_deg)
    force = replace(PLAN.rig.force, misalignment_rad=mounted_rad)
    plan = replace(
        PLAN,
        procedure=replace(PLAN.procedure, alignment=alignment),
        rig=replace(PLAN.rig, force=force),
    )
    found = lateral_limits(plan, 0.3, 400.0)
    askew = found["lateral_askew"]
    assert askew == pytest.approx(math.tan(math.radians(hidden_deg)) + 0.01)
    for share in (0.05, 0.1, 0.2, 0.25, 0.3):
        left = 1.0 - found["lateral_weakening"] * share * (share + 2.0 * askew)
        for nu in yielding_ratios(plan.payload):
            most = left_of_limit(nu, share + askew)
            assert left <= most + found["lateral_weakening"] * askew**2 + 2e-5


def test_what_is_lost_follows_from_the_body_that_yields() -> None:
    plastic = lateral_limits(PLAN, 0.3, 400.0)["lateral_weakening"]
    body = replace(PLAN.payload.material, poisson_ratio=0.2)
    brittle = replace(PLAN, payload=replace(PLAN.payload, material=body))
    assert lateral_limits(brittle, 0.3, 400.0)["lateral_weakening"] > 1.2 * plastic > 0.0


def rated(limits: RunLimits = LIMITS, **other: float) -> RunLimits:
    return replace(limits, **other)


@pytest.mark.parametrize(
    ("name", "place"),
    [("fx_n", 0), ("fy_n", 1), ("fz_n", 2), ("tx_n_m", 3), ("ty_n_m", 4), ("tz_n_m", 5)],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_component_comes_near_its_rating(name: str, place: int, sign: float) -> None:
    feed = Feed(rated(**{f"overload_{name}": 2.0}))  # type: ignore[arg-type]
    wrench = [0.0] * 6
    wrench[place] = 1.9 * sign
    assert feed.press(wrench, 5, SEARCH) is None
    wrench[place] = 2.1 * sign
    assert feed.press(wrench, 1, SEARCH) is None
    cause = feed.press(wrench, 1, SEARCH)
    assert cause is not None
    assert (cause.rule, cause.limit) == ("R13", 2.0)
    assert cause.value == pytest.approx(2.1, abs=1e-4)


@pytest.mark.parametrize("second", [False, True])
def test_a_rating_is_judged_by_new_readings_of_either_sensor(second: bool) -> None:
    limits = rated(**{"second_overload_fy_n" if second else "overload_fy_n": 2.0})  # type: ignore[arg-type]
    wrenches = [(1e-6 * tick, 2.1, 0.0, 0.0, 0.0, 0.0) for tick in range(3)]
    loaded = [ForceSample(tick, 1.0, 1.0, 0, wrenches[tick], 20.0) for tick in range(3)]
    calm = ForceSample(9, 1.0, 1.0, 0, (0.0,) * 6, 20.0)
    arm = ArmSample(9, 1.0, 1.0, 0, 0.0, math.nan, (0.0,) * 6)
    supervisor = Supervisor(replace(limits, cross_check="sensor"), "+fz", "+fz")
    for tick, fresh in enumerate((True, False, True)):  # a reading that is missing counts as none
        new, tick_s = loaded[tick : tick + 1] if fresh else [], 1.0 + 1e-3 * tick
        others = [calm._replace(sequence=9 + tick)]
        force, beside = (others, new) if second else (new, others)
        arms = [arm._replace(sequence=9 + tick)]
        cause = supervisor.check(tick_s, force, arms, beside, 0.0, 0.0, HOLD)
        assert (cause is not None) == (tick == 2)
    assert cause is not None
    assert cause.rule == "R13"


def test_one_reading_beyond_a_rating_may_be_a_spike() -> None:
    feed = Feed(rated(overload_tx_n_m=2.0))
    for torque in (2.1, 0.0, 2.1, 0.0):
        assert feed.press([0.0, 0.0, 0.0, torque, 0.0, 0.0]) is None


def test_the_overload_is_not_tared_away() -> None:
    supervisor = Supervisor(rated(overload_tx_n_m=2.0), "+fz")
    assert supervisor.overload.judge([0, 0, 0, 2.1, 0, 0]) is None
    supervisor.force.tare([0.0, 0.0, 0.0, 2.1, 0.0, 0.0])
    assert supervisor.overload.judge([0, 0, 0, 2.1, 0, 0]) is not None


def test_a_second_sensor_has_ratings_of_its_own() -> None:
    supervisor = Supervisor(rated(second_overload_fy_n=10.0), "+fz", "+fz")
    for _ in range(2):
        assert supervisor.overload.judge([0, 11.0, 0, 0, 0, 0]) is None
    assert supervisor.second_overload.judge([0, 11.0, 0, 0, 0, 0]) is None
    found = supervisor.second_overload.judge([0, 11.0, 0, 0, 0, 0])
    assert found is not None
    assert "second force sensor's fy" in found.message


def test_a_force_across_alone_is_all_share() -> None:
    rules = WrenchRules(LIMITS, Trip)
    across_n = 1.1 * LIMITS.lateral_from_n
    found = [rules.judge_across(across_n, 0.0, 0.0, 0.0) for _ in range(50)]
    assert found[0] is None
    assert found[-1] is not None
    assert found[-1].rule == "R12"


@pytest.mark.parametrize(("peak", "found"), [(0.9, False), (1.1, True)])
def test_r12_counts_the_whole_force_that_is_to_come(peak: float, found: bool) -> None:
    """Across by 0.2 of the force along, below the share; F_allowed is less what that weakens."""
    along_n, limits = 0.5 * LIMITS.allowed_n, replace(LIMITS, lateral_askew=0.0)
    left = 1.0 - limits.lateral_weakening * 0.2**2
    peak_n = peak * left * limits.allowed_n
    trip = WrenchRules(limits, Trip).judge_across(0.2 * along_n, along_n, along_n, peak_n)
    assert (trip is not None) == found
    assert trip is None or trip.rule == "R12"
    assert trip is None or trip.limit == pytest.approx(left * limits.allowed_n)


def test_r14_waits_its_time_and_no_longer() -> None:
    rules = WrenchRules(replace(LIMITS, lever_m=0.1, eccentricity_m=0.01), Trip)
    force_n = 3.0 * LIMITS.lateral_from_n
    beside: Any = SimpleNamespace(torque_beside=lambda lever_m: 0.011 * force_n)
    ticks = 1
    while (trip := rules.judge_centre(beside, force_n)) is None:
        ticks += 1
    assert ticks * PERIOD_S == pytest.approx(LATERAL_TIME_S, abs=1.5 * PERIOD_S)
    assert (trip.rule, trip.value) == ("R14", pytest.approx(0.011))


WAY_N = LIMITS.touch_force_n
"""Force against the axis, or across it, from which R11 stops an approach."""


@pytest.mark.parametrize(
    ("along_n", "across_n", "found"),
    [
        (-1.05 * WAY_N, 0.0, True),
        (-0.95 * WAY_N, 0.0, False),
        (0.0, 10.0 * WAY_N, True),
        (4.9 * WAY_N, -10.0 * WAY_N, True),
        (5.1 * WAY_N, 10.0 * WAY_N, False),
        (0.0, 0.9 * WAY_N, False),
    ],
)
def test_r11_stops_an_approach_that_pulls_or_is_pushed_aside(
    along_n: float, across_n: float, found: bool
) -> None:
    feed = Feed(replace(LIMITS, jump_n=1e9))
    cause = feed.press([across_n, 0.0, along_n, 0.0, 0.0, 0.0], 1, SEARCH)
    assert cause is None  # one reading may be a spike
    cause = feed.press([across_n, 0.0, along_n, 0.0, 0.0, 0.0], 100, SEARCH)
    assert (cause is not None and cause.rule == "R11") == found
    if cause is not None:
        assert cause.value > cause.limit == pytest.approx(WAY_N)


@pytest.mark.parametrize(
    ("waited_s", "over_n", "found"), [(1.0, 0.1, True), (100.0, 0.9, False), (1e4, 1.1, True)]
)
def test_r11_beside_a_second_channel_leaves_room_for_a_zero_that_drifts(
    waited_s: float, over_n: float, found: bool
) -> None:
    """1 N over 50 s, and no more than 1 N."""
    limits = replace(limits_for(PLAN), jump_n=1e9, cross_tolerance_n=1e9, cross_check="sensor")
    feed = Feed(replace(limits, drift_n_per_s=0.02, zero_shift_n=1.0))
    feed.supervisor._zeroed_s -= waited_s
    cause = feed.press([0.0, 0.0, -WAY_N - over_n, 0.0, 0.0, 0.0], 5, SEARCH)
    assert (cause is not None and cause.rule == "R11") == found


class BesideFeed:
    """A supervisor of two sensors; only the second one is loaded, across its axis and along it."""

    def __init__(self) -> None:
        wide = replace(limits_for(PLAN), cross_tolerance_n=1e9, second_limit_n=1e9)
        self.supervisor = Supervisor(replace(wide, cross_check="sensor"), "+fz", "+fz")
        self.tick = 0
        self.press(0.0, 0.0)
        self.supervisor.tare(0.0, 0.0)

    def press(self, across_n: float, along_n: float, phase: int = HOLD) -> Cause | None:
        self.tick += 1
        tick, now_s = self.tick, self.tick * PERIOD_S
        main, beside = (1e-6 * tick, 0.0, 0.0), (1e-6 * tick, across_n, along_n)
        torques = (0.0, 0.0, 0.0)
        forces = [ForceSample(tick, now_s, now_s, 0, (*f, *torques), 20.0) for f in (main, beside)]
        arm = ArmSample(tick, now_s, now_s, 0, 0.0, math.nan, (0.0,) * 6)
        return self.supervisor.check(now_s, forces[:1], [arm], forces[1:], 0.0, 1e-6, phase)


@pytest.mark.parametrize(("sigmas", "rule"), [(-5.0, ""), (-2.0, "R2"), (0.1, "R1")])
def test_the_whole_force_counts_and_what_it_would_grow_to(sigmas: float, rule: str) -> None:
    limit_n, noise_n = LIMITS.force_limit_n, LIMITS.noise_n
    wide = replace(LIMITS, lateral_share=0.0, jump_n=1e9)
    along_n = 0.6 * limit_n + sigmas * noise_n
    cause = Feed(wide).ramp([0.8 * limit_n, 0.0, along_n, 0.0, 0.0, 0.0])
    assert (cause.rule if cause else "") == ("R2" if rule == "R1" else rule)
    feed = Feed(replace(wide, reaction_s=1e-9, noise_n=1e-9))
    cause = feed.press([0.8 * limit_n, 0.0, along_n, 0.0, 0.0, 0.0])
    assert (cause.rule if cause else "") == ("R1" if rule == "R1" else "")


def test_the_whole_force_on_a_second_sensor_counts() -> None:
    side_n = 0.8 * LIMITS.force_limit_n
    for along_n, found in (
        (0.59 * LIMITS.force_limit_n, False),
        (0.61 * LIMITS.force_limit_n, True),
    ):
        cause = BesideFeed().press(side_n, along_n)
        assert (cause is not None) == found
        if cause is not None:
            assert (cause.rule, cause.limit) == ("R1", LIMITS.force_limit_n)
            assert cause.value == pytest.approx(math.hypot(side_n, along_n))


@pytest.mark.parametrize("along", [0.0, 0.4, 0.6])
def test_in_an_approach_a_force_across_a_second_sensor_stops_it(along: float) -> None:
    feed, side_n = BesideFeed(), 10.0 * LIMITS.touch_force_n
    cause = None
    for _ in range(100):
        cause = cause or feed.press(side_n, along * side_n, SEARCH)
    assert (cause is not None) == (along < 0.5)
    assert cause is None or cause.rule == "R11"


@pytest.mark.parametrize("shows", ["the load on the tool", "the load on the plate"])
@pytest.mark.parametrize("axis", ["+fx", "-fx", "+fy", "-fy", "+fz", "-fz"])
def test_the_torque_that_a_lever_explains_is_none(axis: str, shows: str) -> None:
    """Against the cross product, for contacts beside every axis of a sensor."""
    chance = np.random.default_rng(5)
    index, sign = "xyz".index(axis[2]), -1.0 if axis[0] == "-" else 1.0
    for _ in range(20):
        force = chance.normal(size=3) * 10.0
        force[index] = sign * 80.0
        beside = chance.normal(size=3) * 3e-3
        beside[index] = 0.0
        lever_m = 0.12
        place = beside.copy()
        place[index] = -sign * lever_m  # the plate pushes the tool back
        if shows == "the load on the plate":
            place[index] *= -1.0
        watch = ForceWatch("sensor", axis, full_scale_n=1e3, stale_s=1.0, identical_counts=0,
                           clock_s=1.0)  # fmt: skip
        bias = chance.normal(size=6)
        wrench = np.concatenate([force, np.cross(place, force)]) + bias
        watch.take([ForceSample(1, 0.0, 0.0, 0, tuple(wrench.tolist()), 20.0)], 0.0)  # type: ignore[arg-type]
        watch.tare(tuple(bias.tolist()))
        left = np.cross(beside, force)
        left[index] = 0.0
        assert watch.torque_beside(lever_m) == pytest.approx(float(np.linalg.norm(left)), abs=1e-9)


@pytest.mark.parametrize("place", [3, 4])
@pytest.mark.parametrize(("off_m", "stops"), [(0.009, False), (0.011, True), (-0.011, True)])
def test_a_contact_beside_the_axis_stops_the_run(off_m: float, stops: bool, place: int) -> None:
    wrench = [0.0, 0.0, 100.0, 0.0, 0.0, 0.0]
    wrench[place] = off_m * 100.0
    cause = Feed(replace(LIMITS, lever_m=0.1, eccentricity_m=0.01)).ramp(wrench)
    assert (cause is not None and cause.rule == "R14") is stops
    if cause is not None:
        assert cause.value == pytest.approx(abs(off_m), rel=0.02)


def test_without_torques_or_lever_nothing_is_said_of_the_place() -> None:
    limits = replace(LIMITS, lever_m=0.1, eccentricity_m=0.01)
    watch = SimpleNamespace(torque_beside=lambda _lever: 0.0)
    supervisor = Supervisor(limits, "+fz")
    assert supervisor.wrench.judge_centre(watch, 100.0) is None  # type: ignore[arg-type]
    assert lateral_limits(PLAN, 0.3, 400.0)["eccentricity_m"] == 0.0


def test_the_zero_of_all_six_is_a_mean_over_the_tare() -> None:
    window = TareWindow()
    for count in range(1, 101):
        swing = 1.0 if count % 2 else -1.0
        window.add(0.01 * count, 2.0, math.nan, [1.0 + swing, 2.0, 3.0, 4.0 - swing, 5.0, 6.0])
    assert window.result().wrench == pytest.approx([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])


def test_the_zero_across_the_axis_is_that_mean_and_not_the_last_reading() -> None:
    feed = Feed()
    feed.press([9.0, 0.0, 0.0, 0.0, 0.0, 0.0], 20, SEARCH)
    feed.supervisor.tare(0.0, 0.0, [8.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert feed.supervisor.force.across_n == pytest.approx(1.0, abs=1e-4)


def arm(components: str = "six", **procedure: Any) -> Plan:
    """A serial arm that presses the paper's sphere."""
    rig = replace(
        PLAN.rig,
        arm=replace(PLAN.rig.arm, structure=Structure.ARM),
        force=replace(PLAN.rig.force, components=components),
    )
    return replace(PLAN, rig=rig, procedure=replace(PLAN.procedure, **procedure))


def test_where_nothing_sees_sideways_force_less_of_f_c_counts() -> None:
    nu = PLAN.payload.material.poisson_ratio
    assert dragged_left(arm("one")) == left_of_limit(nu, 0.3) < 0.9
    assert dragged_left(arm()) == 1.0
    assert dragged_left(arm(), one_axis=True) == dragged_left(arm("one"))
    assert dragged_left(arm("one", max_lateral_share=0.1)) > dragged_left(arm("one"))
    machine = replace(PLAN.rig, arm=replace(PLAN.rig.arm, structure=Structure.MACHINE))
    assert dragged_left(replace(PLAN, rig=machine), one_axis=True) == 1.0


def test_a_load_cell_on_an_arm_may_press_less() -> None:
    left = dragged_left(arm("one"))
    known, undetected = (largest_top_force(plan, 500.0) for plan in (arm(), arm("one")))
    assert undetected < known
    assert known - undetected == pytest.approx(500.0 * (1.0 - left) * 0.97, rel=0.1)


def test_a_component_that_is_no_number_is_an_overload() -> None:
    supervisor = Supervisor(rated(overload_tx_n_m=8.0, overload_ty_n_m=8.0), "+fz")
    for ty_n_m in (500.0, 0.0, 0.0):  # whatever stands beside it
        found = supervisor.overload.judge([0, 0, 0, math.nan, ty_n_m, 0])
    assert found is not None
    assert found.rule == "R13"
    assert "tx reads nan" in found.message


def test_a_torque_that_is_no_number_stops_the_run() -> None:
    cause = Feed().press([0.0, 0.0, 0.0, math.nan, 0.0, 0.0], 1, SEARCH)
    assert cause is not None
    assert cause.rule == "R4"


def test_a_tare_counts_the_components_that_change() -> None:
    cell, six = TareWindow(), TareWindow()
    for count in range(4):
        cell.add(0.1 * count, 0.0, math.nan, [0.0, 0.0, 0.1 * count, 0.0, 0.0, 0.0])
        six.add(0.1 * count, 0.0, math.nan, [0.1 * count] * 6)
    assert (cell.result().live, six.result().live) == (1, 3)


def test_what_the_run_finds_out_lowers_the_ladder_too() -> None:
    plan = arm(top_force_n=100.0, levels_n=(50.0, 100.0))
    planned = preflight_of(plan).run_limits
    found = preflight_of(plan, Measured(0.0, 0.0, one_axis=True)).run_limits
    assert planned.dragged_left == dragged_left(plan, one_axis=True)
    assert found.allowed_n < planned.allowed_n


def long_tool(torque_n_m: float, lever_m: float = 0.12) -> Plan:
    force = replace(PLAN.rig.force, rated_torque_n_m=(torque_n_m,) * 3, lever_m=lever_m)
    return replace(PLAN, rig=replace(PLAN.rig, force=force))


@pytest.mark.parametrize(("torque_n_m", "severity"), [(30.0, ""), (10.0, "warn"), (0.4, "refuse")])
def test_preflight_names_the_torque_that_a_long_tool_makes(
    torque_n_m: float, severity: str
) -> None:
    found = list(lateral_reasons(long_tool(torque_n_m)))
    assert [str(reason.severity) for reason in found] == ([severity] if severity else [])
