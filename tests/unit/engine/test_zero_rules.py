"""What is asked of a zero: free air, noise, drift, of both channels; at the edge of each bound."""

from __future__ import annotations

import math
from itertools import repeat

import pytest
from course_feed import PERIOD_S, PLAN, PLANNED, Stage, swing

from stepload.engine.operator import StopLevel
from stepload.engine.phases import Exit, Steps
from stepload.engine.retract import retract
from stepload.engine.tare import TareWindow
from stepload.engine.zeroing import DRIFT_CHECK_S, FREE_SIGMAS, LOOK_S, NOISE_FACTOR, Zeroing
from stepload.errors import RefusedError
from stepload.feasibility.bounds import Measured
from stepload.feasibility.zero_drift import STEP_RATES, longest_under_load_s
from stepload.record.rows import Phase

NOISE_N, DRIFT_N, TOLERANCE_N = PLANNED.noise_n, PLAN.max_drift_n, PLANNED.cross_tolerance_n
LOOK = round(LOOK_S / PERIOD_S)


def free_air(stage: Stage) -> None:
    stage.begin(Zeroing(stage.course, lambda _: None).free_air())


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("second", [False, True])
def test_force_that_changes_by_backing_off_was_contact(sign: float, second: bool) -> None:
    limit_n = 0.5 * (TOLERANCE_N if second else DRIFT_N)
    for share, free in ((0.99, True), (1.01, False)):
        stage = Stage(procedure={"tare_s": 100.0})
        free_air(stage)
        stage.readings([0.0] * (LOOK + 1), [0.0] * (LOOK + 1))
        stage.back_off()
        change = [sign * share * limit_n] * (LOOK + 1)
        still = [0.0] * (LOOK + 1)
        stage.readings(still if second else change, change if second else still)
        failure = stage.course.failure
        assert (failure is None) == free == bool(stage.then)
        if failure is not None:
            assert failure.rule == ("pressed_back" if sign > 0.0 else "not_free")
            assert failure.value == pytest.approx(sign * share * limit_n)
            assert failure.limit == pytest.approx(limit_n)


def test_a_change_that_noise_explains_is_none() -> None:
    """Six standard errors of the difference of the two looks."""
    noise_n, count = 3.0, LOOK + 1
    error_n = FREE_SIGMAS * noise_n * math.sqrt(2.0 / count)
    assert error_n > 0.5 * DRIFT_N
    for share, free in ((0.95, True), (1.05, False)):
        stage = Stage()
        free_air(stage)
        stage.readings(swing(0.0, noise_n, count))
        stage.back_off()
        stage.readings(swing(share * error_n, noise_n, count))
        assert (stage.course.failure is None) == free


def test_the_second_channel_is_looked_at_only_where_there_is_one() -> None:
    stage = Stage({"cross_check": ""})
    free_air(stage)
    stage.readings([0.0] * (LOOK + 1), [0.0] * (LOOK + 1))
    stage.back_off()
    stage.readings([0.0] * (LOOK + 1), [100.0] * (LOOK + 1))
    assert stage.then


def test_the_arm_backs_off_by_the_whole_retract_and_comes_to_rest_before_the_second_look() -> None:
    stage = Stage()
    free_air(stage)
    stage.ticks(LOOK + 2)
    stage.back_off()
    assert stage.course.target_m == pytest.approx(-PLAN.retract_m)
    rest_s = 0.2 + 4.0 * PLANNED.loop_s
    moving_s = PLAN.retract_m / PLANNED.retract_speed_m_s
    assert stage.now_s - 10.0 > LOOK_S + moving_s + rest_s


def test_a_stop_while_free_air_is_looked_for_is_honoured() -> None:
    stage = Stage()
    free_air(stage)
    stage.operator.request_stop(StopLevel.AFTER_STEP)
    stage.ticks()
    assert stage.exits == [Exit.STOP]


class Zero:
    """A zeroing that has come to its tare."""

    def __init__(self, limits: dict[str, object] | None = None, **procedure: object) -> None:
        self.stage = stage = Stage(limits, procedure)
        self.adopted: list[Measured] = []
        self.refusal: RefusedError | None = None
        self.zeroing = Zeroing(stage.course, self._adopt)
        self.count = round(stage.course.procedure.tare_s / PERIOD_S) + 1
        self.look = round(DRIFT_CHECK_S / PERIOD_S) + 1

    def _adopt(self, measured: Measured) -> RefusedError | None:
        self.adopted.append(measured)
        return self.refusal

    def tare(self, readings: list[float], second: list[float] | None = None) -> None:
        self.stage.begin(self._zero())
        self.stage.readings(readings, second)

    def _zero(self) -> Steps:
        return (yield from self.zeroing.tare()) or (yield from self.zeroing.drift_check())


def test_the_zero_is_the_mean_of_both_channels() -> None:
    zero = Zero()
    zero.tare(swing(5.0, NOISE_N, zero.count), swing(-7.0, NOISE_N, zero.count))
    assert zero.stage.zeros == [(pytest.approx(5.0, abs=2e-3), pytest.approx(-7.0, abs=2e-3))]
    assert zero.stage.course.phase == Phase.DRIFT_CHECK
    assert zero.adopted == []
    assert len(zero.stage.course.tares) == 1


def test_noise_of_three_times_what_was_planned_is_accepted_and_no_more() -> None:
    for share, taken in ((0.99, True), (1.01, False)):
        zero = Zero()
        zero.tare(swing(0.0, share * NOISE_FACTOR * NOISE_N, zero.count))
        failure = zero.stage.course.failure
        assert (failure is None) == taken == bool(zero.stage.zeros)
        if failure is not None:
            assert failure.rule == "noise"
            assert failure.limit == pytest.approx(3.0 * NOISE_N)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_force_that_drifts_during_the_tare_is_no_zero(sign: float) -> None:
    for share, taken in ((0.99, True), (1.02, False)):
        zero = Zero(tare_s=2.0)
        ramp = [sign * share * DRIFT_N * i / (zero.count - 1) for i in range(zero.count)]
        zero.tare(ramp)
        failure = zero.stage.course.failure
        assert (failure is None) == taken
        assert failure is None or (failure.rule, failure.limit) == ("drift", DRIFT_N)


def test_a_tare_that_is_not_a_number_is_no_zero() -> None:
    zero = Zero()
    zero.tare([math.nan] * zero.count)
    assert zero.stage.course.failure is not None
    assert zero.stage.zeros == []


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("second", [False, True])
def test_a_zero_must_stay_on_both_channels(sign: float, second: bool) -> None:
    limit_n = 0.5 * TOLERANCE_N if second else DRIFT_N
    for share, stays in ((0.99, True), (1.01, False)):
        zero = Zero()
        zero.tare([0.0] * zero.count, [0.0] * zero.count)
        moved, still = [sign * share * limit_n] * zero.look, [0.0] * zero.look
        zero.stage.readings(still if second else moved, moved if second else still)
        failure = zero.stage.course.failure
        assert (failure is None) == stays == bool(zero.stage.then)
        if failure is not None:
            assert failure.rule == "drift"
            assert failure.value == pytest.approx(sign * share * limit_n)
            assert failure.limit == pytest.approx(limit_n)
            assert ("second" in failure.message) == second


def test_the_drift_of_a_channel_that_is_not_there_is_not_asked_for() -> None:
    zero = Zero({"cross_check": ""})
    zero.tare([0.0] * zero.count)
    zero.stage.readings([0.0] * zero.look, [50.0] * zero.look)
    assert zero.stage.then


def test_noise_worse_than_planned_is_taken_over_once_it_is_sure() -> None:
    sure = 1.0 - 3.0 / math.sqrt(2.0 * Zero().count)
    for share, adopted in ((0.98, False), (1.02, True)):
        zero = Zero()
        noise_n = share * NOISE_N / sure
        zero.tare(swing(0.0, noise_n, zero.count))
        assert bool(zero.adopted) == adopted
        if adopted:
            assert zero.adopted[0].noise_n == pytest.approx(noise_n, rel=1e-4)


@pytest.mark.parametrize("left", [1.0, 0.8, 0.0])
def test_a_sensor_that_shows_nothing_across_is_told_on_an_arm_only(left: float) -> None:
    """1: a guided axis; 0: a record from before the rule."""
    zero = Zero(limits={"dragged_left": left})
    zero.tare(swing(0.0, 0.5 * NOISE_N, zero.count))
    assert [measured.one_axis for measured in zero.adopted] == ([True] if left == 0.8 else [])


def test_noise_that_the_edge_of_a_quantum_explains_is_none() -> None:
    sure = 1.0 - 3.0 / math.sqrt(2.0 * Zero().count)
    for share, adopted in ((0.98, False), (1.02, True)):
        zero = Zero({"shown_noise_n": 1.2 * NOISE_N})
        zero.tare(swing(0.0, share * 1.2 * NOISE_N / sure, zero.count))
        assert bool(zero.adopted) == adopted


@pytest.mark.parametrize(
    ("change", "steps"),
    [({}, 12), ({"unload": False}, 6), ({"cycles": 3}, 12), ({"cycles": 3, "lift_off": False}, 38)],
)
def test_drift_counts_until_the_zero_is_looked_at_again(
    change: dict[str, object], steps: int
) -> None:
    step_s = PLAN.step_n / PLAN.load_rate_n_per_s + PLAN.hold_s
    under_load_s = steps * (step_s + STEP_RATES / PLANNED.step_rate_per_s)
    slope = 1.05 * DRIFT_N / under_load_s
    for sign in (1.0, -1.0):
        zero = Zero(**change)
        zero.tare([sign * slope * i * PERIOD_S for i in range(zero.count)])
        assert [m.drift_n_per_s for m in zero.adopted] == [pytest.approx(slope, rel=1e-3)]
        assert zero.adopted[0].noise_n == 0.0
    zero = Zero(**change)
    zero.tare([0.95 / 1.05 * slope * i * PERIOD_S for i in range(zero.count)])
    assert zero.adopted == []


def test_the_drift_of_an_only_channel_counts_as_if_no_level_settled_and_in_the_approach() -> None:
    longest_s = longest_under_load_s(PLAN, PLANNED.loop_s)
    steep = DRIFT_N / longest_s
    for slope, stated, adopted in (
        (0.1 * steep, steep, 0),
        (steep, steep, 1),
        (0.1 * steep, 0.0, 1),
    ):
        zero = Zero({"cross_check": "", "zero_drift_n_per_s": stated})
        zero.tare([slope * i * PERIOD_S for i in range(zero.count)])
        expected = [pytest.approx(slope, rel=1e-3)] * adopted
        assert [m.drift_n_per_s for m in zero.adopted] == expected


def test_a_drift_that_the_noise_blurs_counts_at_its_upper_bound() -> None:
    zero = Zero({"cross_check": "", "zero_drift_n_per_s": 0.0})
    noise = swing(0.0, NOISE_N, zero.count)
    zero.tare([1.0 * i * PERIOD_S + each for i, each in enumerate(noise)])
    [measured], [tare] = zero.adopted, zero.stage.course.tares
    assert measured.drift_n_per_s == tare.largest_slope_n_per_s
    assert measured.drift_n_per_s > 1.05 * abs(tare.slope_n_per_s) > 0.9


def test_a_zero_of_an_only_channel_that_is_too_old_ends_the_press() -> None:
    """The drift counts from the middle of the tare; before the contact up to the touch force."""
    touch_n = PLANNED.touch_force_n
    for drift, waited_s in ((0.5, 1.0), (0.5, 100.0), (0.0, 100.0)):
        zero = Zero({"cross_check": "", "zero_drift_n_per_s": drift, "zero_shift_n": 2.0 * touch_n})
        zero.tare([0.0] * zero.count)
        stage, middle_s = zero.stage, 0.5 * zero.stage.course.tares[0].duration_s
        assert stage.course.zeroed_s == pytest.approx(stage.now_s - middle_s, abs=2.0 * PERIOD_S)
        stage.then.clear()
        stage.course.sequence = repeat(None)
        stage.course.enter(Phase.LOAD)
        stage.now_s += waited_s
        age_s = stage.now_s - stage.course.zeroed_s
        stage.course.now_s = stage.now_s
        stage.course.press()
        if drift == 0.0:
            stage.now_s += 1e6
            stage.ticks(2)
            assert stage.course.failure is None
            continue
        left_s = (2.0 * touch_n - min(touch_n, drift * age_s)) / drift
        stage.now_s += left_s - 0.01
        stage.ticks(2)
        assert stage.course.failure is None
        stage.now_s += 0.02
        stage.course.phase = Phase.HOLD
        stage.ticks(2)
        assert stage.course.failure is None
        stage.course.phase = Phase.LOAD
        stage.ticks(2)
        assert stage.course.failure is not None
        assert stage.course.failure.value == pytest.approx(2.0 * touch_n, rel=0.02)
        assert stage.course.failure.limit == 2.0 * touch_n
        assert stage.course.failure.rule == "old_zero"
        assert "the zero of the only force channel is" in stage.course.failure.message


def test_a_payload_that_is_no_longer_pressed_has_no_zero_that_is_too_old() -> None:
    zero = Zero({"cross_check": "", "zero_drift_n_per_s": 0.5})
    zero.tare([0.0] * zero.count)
    stage = zero.stage
    stage.course.press()
    stage.begin(retract(stage.course))
    stage.now_s += 1e6
    stage.ticks(2)
    assert stage.course.failure is None


def test_a_plan_that_does_not_fit_what_was_measured_ends_there() -> None:
    zero = Zero()
    zero.refusal = RefusedError("no room", hint="press less")
    zero.tare(swing(0.0, 2.0 * NOISE_N, zero.count))
    failure = zero.stage.course.failure
    assert failure is not None
    assert failure.rule == "no_room"
    assert zero.stage.zeros == []


def test_a_second_channel_louder_than_stated_counts_as_found() -> None:
    for share, refused in ((1.4, False), (1.6, True)):
        zero = Zero({"second_noise_n": 1.0})
        zero.refusal = RefusedError("no room", hint="press less")
        zero.tare([0.0] * zero.count, swing(0.0, share, zero.count))
        failure = zero.stage.course.failure
        assert (failure is not None) == refused
        if failure is not None:
            assert failure.rule == "no_room"
            assert "1.6 N of the second channel where second_force.noise is 1 N" in failure.message


def look_back(cycle: int, cycles: int, shift_n: float, second_n: float = 0.0) -> Zero:
    zero = Zero(cycles=cycles, tare_s=2.0)
    zero.tare([0.0] * zero.count, [0.0] * zero.count)
    zero.stage.course.cycle = cycle
    zero.stage.begin(zero.zeroing.look_back())
    zero.stage.readings([shift_n] * zero.count, [second_n] * zero.count)
    return zero


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_zero_that_moves_within_a_cycle_ends_the_run_there_only(sign: float) -> None:
    kept = look_back(1, 2, sign * 0.99 * DRIFT_N)
    assert kept.stage.then
    assert kept.stage.zeros[-1][0] == pytest.approx(sign * 0.99 * DRIFT_N)
    moved = look_back(1, 2, sign * 1.01 * DRIFT_N)
    assert moved.stage.course.failure is not None
    assert moved.stage.course.failure.rule == "drift"
    for share, flagged in ((0.99, False), (1.01, True)):
        last = look_back(2, 2, sign * share * DRIFT_N)
        assert last.stage.then
        assert last.stage.find("zero_shift")["flagged"] == flagged
        assert last.stage.course.zero_shift_n == pytest.approx(sign * share * DRIFT_N)
        zeros = [zero for zero, _ in last.stage.zeros]
        assert zeros == pytest.approx([0.0, sign * share * DRIFT_N])  # it counts for the last touch
    limit_n = kept.stage.course.limits.second_zero_n
    for share, flagged in ((0.99, False), (1.01, True)):
        last = look_back(2, 2, 0.0, sign * share * limit_n)
        assert last.stage.then
        found = last.stage.find("zero_shift")
        assert found["flagged"] == flagged
        assert found["second_shift_n"] == pytest.approx(sign * share * limit_n)
        assert found["second_limit_n"] == limit_n


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_second_channels_zero_too_is_looked_at_between_cycles(sign: float) -> None:
    """A sound main channel does not show it, and the next cycle would rely on the new zero."""
    assert look_back(1, 2, 0.0, sign * 0.99 * 0.5 * TOLERANCE_N).stage.then
    moved = look_back(1, 2, 0.0, sign * 1.01 * 0.5 * TOLERANCE_N)
    failure = moved.stage.course.failure
    assert failure is not None
    assert failure.rule == "drift"
    assert "second force channel's zero moved" in failure.message
    assert not moved.stage.then


def test_between_cycles_a_second_is_long_enough_and_at_the_end_the_plans_time() -> None:
    for cycle, expected_s in ((1, 1.0), (2, 2.0)):
        zero = Zero(cycles=2, tare_s=2.0)
        zero.tare([0.0] * zero.count)
        zero.stage.course.cycle = cycle
        begin_s = zero.stage.now_s
        zero.stage.begin(zero.zeroing.look_back())
        zero.stage.readings([0.0] * zero.count)
        assert zero.stage.then[0] - begin_s == pytest.approx(expected_s, abs=2.0 * PERIOD_S)


def test_the_warm_up_is_waited_for() -> None:
    zero = Zero(warm_up_s=0.25)
    zero.stage.begin(zero.zeroing.warm_up())
    zero.stage.ticks(255)
    assert not zero.stage.then
    zero.stage.ticks(1)
    assert zero.stage.then


@pytest.mark.parametrize("phase", ["warm_up", "tare"])
def test_a_stop_before_the_approach_is_honoured(phase: str) -> None:
    zero = Zero()
    zero.stage.begin(getattr(zero.zeroing, phase)())
    zero.stage.operator.request_stop(StopLevel.AFTER_STEP)
    zero.stage.ticks()
    assert zero.stage.exits == [Exit.STOP]
    assert zero.stage.course.interrupted


def test_a_tare_covers_its_time_with_fresh_readings_only() -> None:
    stage, window = Stage(), TareWindow()
    sup = stage.sup
    for tick in range(100):
        sup.force.fresh = tick % 10 == 0
        found = window.offer(tick * PERIOD_S, sup, 50.0 * PERIOD_S)  # type: ignore[arg-type]
        assert (found is not None) == (tick >= 50)
        if found is not None:
            assert found.samples == 6
            assert found.duration_s == 50.0 * PERIOD_S
            break
    with pytest.raises(ValueError, match="3 readings"):
        TareWindow().result()
    short = TareWindow()
    sup.force.fresh = True
    assert short.offer(0.0, sup, 0.001) is None  # type: ignore[arg-type]
    assert short.offer(1.0, sup, 0.001) is None  # type: ignore[arg-type]
    assert short.offer(2.0, sup, 0.001) is not None  # type: ignore[arg-type]
