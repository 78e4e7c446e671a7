"""The step controller at each of its bounds, tick by tick and without a plant."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from run_plans import limits_for, stvf_plan

from stepload.engine.controller import LOOK_AHEAD, STIFFENING, StepController
from stepload.feasibility.command_backlog import sudden_step
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.press import ANSWER_SIGMAS, NOISE_MULTIPLE
from stepload.feasibility.pressing import LONGEST_STALL_S

PLANNED = limits_for(stvf_plan())
DT = PLANNED.period_s
FLOOR = 1.0 / PLANNED.stiffness_n_per_m
NOISE_N = PLANNED.noise_n
FREE: dict[str, Any] = {
    "contact_n_s_per_m": 1.0, "acceleration_m_s2": 1e9, "follow_m": 1e-12,
    "arm_acceleration_m_s2": 1e9, "damping_n_s_per_m": 0.0, "arm_lag_s": 0.0, "allowed_n": 1e9,
    "answer_n_per_m": 1.0,
    "answer_top_n_per_m": 1.0, "answers_n": 1e-9, "cross_check": "",
}  # fmt: skip
"""Limits under which nothing but the ramp and the travel limit bounds the target."""


def limits(**changes: Any) -> RunLimits:
    return replace(PLANNED, **(FREE | changes))


def begun(
    level_n: float = 300.0, force_n: float = 0.0, sign: float = 1.0, **changes: Any
) -> StepController:
    controller = StepController(limits(**changes))
    controller.begin(level_n, force_n, 0.0, sign, False)
    return controller


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_level_is_reached_within_the_band_from_the_side_it_is_come_from(sign: float) -> None:
    for off, reached in ((1.01, False), (0.99, True), (-5.0, True)):
        controller = begun(100.0, 100.0 - sign * 50.0, sign)
        smooth_n = 100.0 - sign * off * PLANNED.band_n
        target_m = controller.step(100.0 - sign * 20.0, smooth_n, 0.0, 1e-3, DT)
        assert controller.reached is reached
        if reached:
            assert target_m == 1e-3
            assert controller.speed_m_s == 0.0
            assert controller.step(0.0, 0.0, 0.0, 1e-3, DT) == 1e-3


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_force_wanted_rises_along_the_load_rate_and_ends_at_the_level(sign: float) -> None:
    controller = begun(100.0 + sign * 10.0, 100.0, sign)
    rate = PLANNED.load_rate_n_per_s
    for tick in range(1, 20):
        moved_m = controller.step(100.0, 100.0, 0.0, 0.0, DT)
        ramp_n = min(10.0, rate * tick * DT)
        assert moved_m == pytest.approx(sign * PLANNED.step_rate_per_s * FLOOR * ramp_n * DT)
        assert controller.speed_m_s == pytest.approx(moved_m / DT)
        assert controller.c_m_per_n == FLOOR


def test_force_above_the_ramp_moves_nothing_back() -> None:
    controller = begun()
    assert controller.step(50.0, 10.0, 0.0, 1e-5, DT) == 1e-5


def test_the_target_accelerates_as_the_arm_may() -> None:
    controller = begun(acceleration_m_s2=0.01)
    speeds = []
    for _ in range(4):
        controller.step(-500.0, 0.0, 0.0, 0.0, DT)
        speeds.append(controller.speed_m_s)
    assert speeds == [pytest.approx(0.01 * DT * tick) for tick in (1, 2, 3, 4)]


def test_in_contact_the_speed_leaves_room_for_a_hidden_hard_stop() -> None:
    smooth_n = PLANNED.force_limit_n - 50.0
    controller = begun(360.0, smooth_n, contact_n_s_per_m=1e6)
    controller.step(smooth_n - 500.0, smooth_n, 0.0, 0.0, DT)
    assert controller.speed_m_s == pytest.approx((50.0 - 6.0 * NOISE_N) / 1e6)
    no_room = begun(1e4, 0.0, contact_n_s_per_m=1e6)
    assert no_room.step(0.0, PLANNED.force_limit_n - 5.9 * NOISE_N, 0.0, 1e-3, DT) == 1e-3
    down = begun(0.0, 300.0, -1.0, contact_n_s_per_m=1e6)
    down.step(2000.0, 300.0, 0.0, 0.0, DT)
    assert down.speed_m_s == pytest.approx(-PLANNED.force_limit_n / 1e6)


STEP = {"allowed_n": 400.0, "damping_n_s_per_m": 1e4, "arm_acceleration_m_s2": 2.0,
        "arm_lag_s": 0.004}  # fmt: skip


def sudden(smooth_n: float) -> float:
    return sudden_step(400.0 - smooth_n - 6.0 * NOISE_N, PLANNED.stiffness_n_per_m, 1e4, 2.0, 0.004)


def test_the_target_does_not_run_ahead_of_an_arm_that_does_not_follow() -> None:
    """By no more than a sudden step of the arm there may add to the force."""
    controller, target_m = begun(follow_m=1e-7, **STEP), 0.0
    ahead_m = sudden(0.0)
    for _ in range(4000):
        target_m = controller.step(0.0, 0.0, 0.0, target_m, DT)
        assert target_m <= 1.1 * ahead_m
    travel_limit_m = (PLANNED.force_limit_n - NOISE_MULTIPLE * NOISE_N) * FLOOR
    assert 0.9 * ahead_m < target_m < 0.9 * travel_limit_m
    assert controller.speed_m_s == 0.0


def test_how_far_an_arm_lags_that_follows_is_no_running_ahead() -> None:
    """What the target leads by when the step begins is that of an arm that follows."""
    controller = begun(follow_m=1e-7, cross_check="arm", **STEP)
    lead_m = 3.0 * sudden(0.0)
    target_m = controller.step(0.0, 0.0, 0.0, lead_m, DT)
    assert target_m > lead_m


def test_where_following_cannot_be_seen_the_target_goes_slowly() -> None:
    follow_m = 2.0 * sudden(300.0)
    controller = begun(360.0, 300.0, follow_m=follow_m, **STEP)
    target_m = controller.step(-500.0, 300.0, 0.0, 0.0, DT)
    assert controller.speed_m_s == pytest.approx(sudden(300.0) / LONGEST_STALL_S)
    ahead_m = controller.step(-500.0, 300.0, -0.9 * follow_m, target_m, DT)
    assert ahead_m > target_m
    assert controller.step(-500.0, 300.0, -1.1 * follow_m, target_m, DT) < target_m


@pytest.mark.parametrize("force_n", [0.0, 200.0])
@pytest.mark.parametrize("answers_n", [1e-9, 1.0])
def test_the_travel_of_an_only_channel_ends_where_a_rigid_surface_would_reach_the_limit(
    force_n: float, answers_n: float
) -> None:
    """Or where the softest payload must have answered."""
    told = limits(answers_n=answers_n, answer_n_per_m=5e3, answer_top_n_per_m=5e3)
    controller, target_m = StepController(told), 0.0
    controller.begin(1e4, force_n, 0.0, 1.0, False)
    for _ in range(3000):
        target_m = controller.step(force_n, force_n, 0.0, target_m, DT)
    room_n = PLANNED.force_limit_n - force_n - NOISE_MULTIPLE * NOISE_N
    assert target_m == pytest.approx(0.5 * max(room_n * FLOOR, answers_n / 5e3), rel=1e-9)
    assert controller.speed_m_s == pytest.approx(0.0, abs=1e-12)


def test_with_two_channels_nothing_but_the_ramp_limits_the_travel() -> None:
    for travel_limit, cross_check in ((True, "arm"), (False, "")):
        controller, target_m = StepController(limits(cross_check=cross_check), travel_limit), 0.0
        controller.begin(1e4, 0.0, 0.0, 1.0, False)
        for _ in range(3000):
            target_m = controller.step(0.0, 0.0, 0.0, target_m, DT)
        assert target_m > 2.0 * PLANNED.force_limit_n * FLOOR


SHORT_N = NOISE_N / math.sqrt(0.04 / DT)
"""Noise of the mean that an answer is looked for in on the way."""


def test_an_answer_proves_the_one_before_and_not_itself() -> None:
    """The first may be one of noise: what a dead channel shows is above no other."""
    limit = begun(1e4)._travel
    travel_m = limit.end_m() * 2.0
    for answers, (force_n, target_m) in enumerate(((0.0, 0.0), (2.0, 1e-5), (4.0, 2e-5))):
        for _ in range(round(0.1 / DT) if answers else 0):
            limit.add_at_end(target_m, force_n)
        assert (limit.answer_n, limit.answer_m) == (pytest.approx(force_n), target_m)
        proved_m = max(0.0, target_m - 1e-5)
        assert (limit.proved_n, limit.proved_m) == (
            pytest.approx(max(0.0, force_n - 2.0)),
            proved_m,
        )
        room_m = travel_m - force_n * FLOOR
        ends_m = target_m + 0.5 * room_m, proved_m + travel_m - max(0.0, force_n - 2.0) * FLOOR
        assert limit.end_m() == pytest.approx(min(ends_m))


def test_an_answer_is_looked_for_where_no_reading_is_from_before_the_arm_stood() -> None:
    """A reading of an only channel may be `undetected_s` old, and the loop's delays come on top."""
    for undetected_s in (0.0, 0.2):
        controller, target_m, ticks = begun(1e4, undetected_s=undetected_s), 0.0, 0
        assert len(controller._targets_m) == 1 + math.ceil((undetected_s + PLANNED.reaction_s) / DT)
        while controller.speed_m_s or not target_m:
            target_m = controller.step(0.0, 0.0, 0.0, target_m, DT)
        while not controller._travel.answer_n:
            target_m = controller.step(5.0, 0.0, 0.0, target_m, DT)
            ticks += 1
        stood_s = undetected_s + PLANNED.reaction_s + 0.1
        assert ticks * DT == pytest.approx(stood_s, abs=3.0 * DT)


def test_at_the_end_of_the_leash_a_mean_over_a_while_is_an_answer() -> None:
    """What the short mean is too noisy for the mean of many readings can tell; but the short one
    may have been the last answer, and its own noise is none."""
    for share, answered in ((1.2, True), (0.95, False)):
        answer_n = share * ANSWER_SIGMAS * SHORT_N
        controller, target_m, ticks = begun(1e4), 0.0, 0
        limit = controller._travel
        for _ in range(1500):
            target_m = controller.step(0.0, 0.0, 0.0, target_m, DT)
        while not limit.answer_n and ticks < 30_000:
            target_m = controller.step(answer_n, 0.0, 2e-6, target_m, DT)
            ticks += 1
        assert (limit.answer_n > 0.0) == answered
        assert ticks > 0.04 / DT / (1.2**2 - 1.0)


def test_an_answer_comes_with_the_motion_and_not_where_the_arm_stands() -> None:
    """A rise at the end that goes on at the same rate is a drift."""
    drifting = begun(1e4)._travel
    for tick in range(4000):
        drifting.add(1e-3 * tick)
        drifting.add_at_end(1e-6, 1e-3 * tick)
    assert drifting.answer_n == 0.0


def test_what_a_force_rises_by_at_rest_after_a_level_was_given_up_is_no_answer() -> None:
    for rested_n, answer_n in ((3.0, 3.0), (1.0, 2.0)):
        limit = begun(1e4)._travel
        limit.begin(1e-6, 2.0, same=False)
        limit.begin(0.0, rested_n, same=True)
        assert limit.answer_n == answer_n


def test_an_answer_is_worth_more_where_the_payload_is_stiffer() -> None:
    top_n = PLANNED.top_force_n
    for force_n, answered in ((0.0, True), (top_n, False)):
        limit = begun(1e4, answer_n_per_m=1e4, answer_top_n_per_m=1e5)._travel
        limit.begin(0.0, force_n, same=False)
        for _ in range(400):
            limit.add_at_end(1e-4, force_n + 5.0)
        assert (limit.answer_n > force_n) == answered


def test_the_leash_is_tied_to_the_mean_force_of_the_rest_before() -> None:
    """And to the force itself where there was none."""
    for rested_n, from_n in ((2.0, 2.0), (math.nan, 3.0)):
        controller = StepController(limits())
        controller.begin(200.0, 3.0, 1e-6, 1.0, False, rested_n)
        limit = controller._travel
        assert (limit.answer_n, limit.proved_n, limit.mean_n) == (from_n, from_n, from_n)
        assert limit.answer_m == limit.proved_m == 1e-6


def test_force_and_position_are_paired_with_the_sensors_delay() -> None:
    """The position of the moment that the force is of: a delay and a period ago."""
    ticks = 1 + round((PLANNED.force_delay_s + DT) / DT)
    for delay_s, back in ((PLANNED.force_delay_s, ticks), (0.0, 2), (0.005, 7)):
        controller = begun(1e4, force_delay_s=delay_s)
        controller._compliance = told = Known(FLOOR)  # type: ignore[assignment]
        for tick in range(1, 30):
            controller.step(0.0, 0.0, 1e-6 * tick, 1e-6 * tick, DT)
        assert told.positions[-1] == pytest.approx(1e-6 * (29 - back))


class Known:
    """A compliance that is measured already."""

    def __init__(self, c_m_per_n: float) -> None:
        self.c_m_per_n = c_m_per_n
        self.restarts = 0
        self.positions: list[float] = []

    def add(self, position_m: float, force_n: float) -> None:
        self.positions.append(position_m)

    def restart(self) -> None:
        self.restarts += 1


def known(level_n: float = 300.0, force_n: float = 100.0, sign: float = 1.0) -> StepController:
    controller = begun(level_n, force_n, sign)
    controller._compliance = Known(5.0 * FLOOR)  # type: ignore[assignment]
    return controller


def test_a_measured_compliance_is_used_once_the_force_has_moved() -> None:
    controller = known()
    for _ in range(300):
        controller.step(100.0 + 0.9 * controller._change_n, 100.0, 0.0, 0.0, DT)
        assert controller.c_m_per_n == FLOOR
    for _ in range(300):
        controller.step(100.0 + 1.3 * controller._change_n, 100.0, 0.0, 0.0, DT)
    assert controller.c_m_per_n > 2.0 * FLOOR
    rise_n = math.sqrt(2.0) * ANSWER_SIGMAS * SHORT_N
    assert controller._change_n == max(rise_n, 0.5 * PLANNED.band_n)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_loading_looks_ahead_to_where_the_payload_is_stiffer(sign: float) -> None:
    controller = known(100.0 + sign * 90.0, 100.0, sign)
    controller._trusted = True
    for _ in range(50):
        controller.step(100.0, 100.0, 0.0, 0.0, DT)
    error_n = PLANNED.load_rate_n_per_s * 50 * DT
    share = (100.0 / (100.0 + LOOK_AHEAD * error_n)) ** STIFFENING if sign > 0.0 else 1.0
    assert controller.c_m_per_n == pytest.approx(FLOOR + 4.0 * FLOOR * share)
    near_zero = known()
    near_zero._trusted = True
    near_zero.step(100.0, 1e-3, 0.0, 0.0, DT)
    touch_n = PLANNED.touch_force_n
    share = (touch_n / (touch_n + LOOK_AHEAD * 1.0)) ** STIFFENING
    assert near_zero.c_m_per_n == pytest.approx(FLOOR + 4.0 * FLOOR * share)


@pytest.mark.parametrize(
    ("first", "second", "same", "kept"),
    [(1.0, 1.0, True, True), (1.0, 1.0, False, False), (1.0, -1.0, True, False),
     (-1.0, -1.0, True, False), (-1.0, 1.0, True, False)],
)  # fmt: skip
def test_what_is_known_of_the_payload_is_kept_only_while_loading_goes_on(
    first: float, second: float, same: bool, kept: bool
) -> None:
    controller = known(sign=first)
    controller._trusted = True
    controller.begin(200.0, 100.0, 0.0, second, same)
    assert controller._trusted is kept
    assert controller._compliance.restarts == (0 if kept else 1)  # type: ignore[attr-defined]
    assert controller.c_m_per_n == FLOOR
    assert not controller.reached
