"""R3, R4 and R10 at their edges: how old, how often, how far, and that each is armed."""

from __future__ import annotations

import math
from typing import Any

import pytest
from rule_feed import PERIOD_S, arm_sample, force_sample

from stepload.engine.watch import (
    AHEAD_S,
    LATE_CLOCK_TICKS,
    ArmWatch,
    ForceWatch,
    Trip,
    wrench_axis,
)
from stepload.rig.samples import ArmSample, ForceSample

STALE_S, CLOCK_S, COUNTS, FULL_N = 0.012, 0.015, 5, 100.0


def force_watch(axis: str = "-fz", **changes: Any) -> ForceWatch:
    options: dict[str, Any] = {
        "full_scale_n": FULL_N, "stale_s": STALE_S, "identical_counts": COUNTS, "clock_s": CLOCK_S,
    }  # fmt: skip
    return ForceWatch("sensor", axis, **(options | changes))


def arm_watch(**changes: Any) -> ArmWatch:
    options: dict[str, Any] = {
        "stale_s": STALE_S, "identical_counts": COUNTS, "clock_s": CLOCK_S, "needs_force": True,
    }  # fmt: skip
    return ArmWatch(**(options | changes))


STREAMS = [(force_watch, force_sample), (arm_watch, arm_sample)]


def take(watch: ForceWatch | ArmWatch, *samples: ForceSample | ArmSample) -> Trip | None:
    """What the watch finds in samples that arrive in time."""
    return watch.take(samples, samples[-1].receive_time_s)


@pytest.mark.parametrize("watch", [force_watch, arm_watch])
def test_r3_trips_when_the_age_limit_has_passed_and_not_before(watch: Any) -> None:
    stream = watch()
    sample = force_sample(0, 1.0) if watch is force_watch else arm_sample(0, 0.0)
    assert take(stream, sample) is None
    found = [stream.take((), tick * PERIOD_S) for tick in range(1, 16)]
    assert found[:12] == [None] * 12
    trip = found[12]
    assert trip is not None
    assert (trip.rule, trip.limit, trip.unit) == ("R3", STALE_S, "s")
    assert trip.value == pytest.approx(0.013)
    assert stream.fresh is False
    assert take(stream, sample._replace(sequence=99, receive_time_s=0.02, device_time_s=0.02)) is (
        None
    )
    assert stream.fresh


def test_r3_counts_from_the_first_tick_where_no_sample_ever_came() -> None:
    watch = force_watch()
    found = [watch.take((), 5.0 + tick * PERIOD_S) for tick in range(14)]
    assert found[:13] == [None] * 13
    assert found[13] is not None
    assert found[13].rule == "R3"


def test_r3_gives_a_late_host_two_ticks_to_read_its_buffers_and_no_more() -> None:
    watch = force_watch()
    take(watch, force_sample(0, 1.0))
    assert watch.take((), 0.5) is None
    assert watch.take((), 0.501) is None
    trip = watch.take((), 0.502)
    assert trip is not None
    assert trip.rule == "R3"


def test_a_sample_ends_the_count_of_empty_ticks() -> None:
    watch = force_watch()
    take(watch, force_sample(0, 1.0))
    for tick in (1, 2):
        assert watch.take((), tick * PERIOD_S) is None
    take(watch, force_sample(3, 1.0))
    assert watch.take((), 0.5) is None
    assert watch.take((), 0.501) is None
    assert watch.take((), 0.502) is not None


@pytest.mark.parametrize("newton", [FULL_N, -FULL_N, math.nan, math.inf, -math.inf])
def test_r4_what_is_beyond_full_scale_on_either_side_or_not_finite_is_no_reading(
    newton: float,
) -> None:
    watch = force_watch()
    assert take(watch, force_sample(0, 0.99 * FULL_N)) is None
    assert take(watch, force_sample(1, -0.99 * FULL_N)) is None
    trip = take(watch, force_sample(2, newton))
    assert trip is not None
    assert (trip.rule, trip.limit, trip.unit) == ("R4", FULL_N, "N")
    assert watch.raw_n == -0.99 * FULL_N


def test_r4_every_sample_of_a_tick_is_judged() -> None:
    watch = force_watch()
    trip = take(watch, force_sample(0, math.nan), force_sample(1, 1.0))
    assert trip is not None
    assert trip.rule == "R4"
    assert watch.raw_n == 1.0


@pytest.mark.parametrize("status", [1, 4, 16])
def test_r4_a_flagged_sample_is_not_used_in_silence(status: int) -> None:
    for watch, sample in (
        (force_watch(), force_sample(0, 1.0, status=status)),
        (arm_watch(), arm_sample(0, 0.0, status=status)),
    ):
        trip = take(watch, sample)
        assert trip is not None
        assert (trip.rule, trip.value) == ("R4", float(status))


def test_r4_equal_samples_are_frozen_from_the_count_on() -> None:
    watch = force_watch()
    still = force_sample(0, 3.0)
    found = [take(watch, still._replace(sequence=i)) for i in range(COUNTS + 1)]
    assert found[:COUNTS] == [None] * COUNTS
    assert found[COUNTS] is not None
    assert found[COUNTS][:4] == ("R4", COUNTS + 1.0, float(COUNTS), "samples")


def test_r4_one_other_sample_ends_the_count() -> None:
    watch = force_watch()
    still = force_sample(0, 3.0)
    for round_ in range(3):
        first = round_ * COUNTS
        assert all(
            take(watch, still._replace(sequence=first + i)) is None for i in range(COUNTS - 1)
        )
        assert take(watch, force_sample(first + COUNTS - 1, 4.0 + round_)) is None


def test_r4_torque_that_moves_shows_a_live_sensor() -> None:
    watch = force_watch()
    for index in range(3 * COUNTS):
        wrench = (0.0, 0.0, -3.0, 0.0, 0.0, 1e-6 * index)
        assert take(watch, force_sample(index, 3.0, wrench=wrench)) is None


def test_r4_a_count_of_0_switches_the_frozen_rule_off() -> None:
    watch, arm = force_watch(identical_counts=0), arm_watch(identical_counts=0)
    for index in range(200):
        wrench = (0.0, 0.0, -3.0, 0.0, 0.0, 0.0)
        assert take(watch, force_sample(index, 3.0, wrench=wrench)) is None
        assert take(arm, arm_sample(index, 0.0, force_n=3.0)) is None


def test_r4_the_arms_own_force_freezes_too_and_only_where_it_is_needed() -> None:
    for needs_force in (True, False):
        watch = arm_watch(needs_force=needs_force)
        found = [take(watch, arm_sample(i, 1e-6 * i, force_n=7.0)) for i in range(COUNTS + 1)]
        assert found[:COUNTS] == [None] * COUNTS
        last = found[COUNTS]
        assert (last is not None) == needs_force
        assert last is None or last[:3] == ("R4", COUNTS + 1.0, float(COUNTS))
        assert (watch.force_n == 7.0) == needs_force


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_r4_the_arms_numbers_are_finite(value: float) -> None:
    watch = arm_watch()
    assert take(watch, arm_sample(0, 2e-3, 5.0)) is None
    position = take(watch, arm_sample(1, value, 5.0))
    force = take(watch, arm_sample(2, 2e-3, 5.0, force_n=value))
    assert position is not None
    assert force is not None
    assert position.rule == force.rule == "R4"
    assert (position.unit, force.unit) == ("m", "N")
    assert "position" in position.message
    assert "arm force" in force.message
    assert watch.position_m == 2e-3
    assert math.isfinite(watch.force_n)


@pytest.mark.parametrize(("last", "next_", "found"), [(5, 6, False), (5, 5, True), (5, 4, True)])
@pytest.mark.parametrize(("watch", "sample"), STREAMS)
def test_r10_sequences_rise(watch: Any, sample: Any, last: int, next_: int, found: bool) -> None:
    for in_one_tick in (True, False):
        stream = watch()
        first, second = sample(last, 1.0), sample(6, 2.0, sequence=next_)
        if in_one_tick:
            trip = take(stream, first, second)
        else:
            assert take(stream, first) is None
            trip = take(stream, second)
        assert (trip is not None) == found
        assert trip is None or trip[:3] == ("R10", float(next_), float(last))


@pytest.mark.parametrize(("ahead_s", "found"), [(0.0, False), (0.9e-4, False), (1.1e-4, True)])
def test_r10_a_stamp_of_the_future_is_refused_at_once(ahead_s: float, found: bool) -> None:
    for watch, sample in ((force_watch(), force_sample(0, 1.0)), (arm_watch(), arm_sample(0, 0.0))):
        sample = sample._replace(receive_time_s=1.0 + ahead_s, device_time_s=math.nan)
        trip = watch.take([sample], 1.0)
        assert (trip is not None) == found
        if trip is not None:
            assert trip.rule == "R10"
            assert trip.value == pytest.approx(ahead_s)
            assert (trip.limit, trip.unit) == (AHEAD_S, "s")


@pytest.mark.parametrize(("watch", "sample"), STREAMS)
def test_r10_a_device_clock_that_goes_along_excuses_no_stamp_of_the_future(
    watch: Any, sample: Any
) -> None:
    stream = watch()
    assert take(stream, sample(0, 1.0)) is None
    late = sample(1, 2.0)
    trip = stream.take([late], late.receive_time_s - 1.1e-4)
    assert trip is not None
    assert trip.rule == "R10"


def clock(
    watch: ForceWatch | ArmWatch, offsets_s: list[float], sample: Any = force_sample
) -> list[Trip | None]:
    return [
        take(watch, sample(i, 1.0, device_time_s=i * PERIOD_S - offset_s))
        for i, offset_s in enumerate(offsets_s)
    ]


@pytest.mark.parametrize(("watch", "sample"), STREAMS)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_r10_a_device_clock_that_steps_is_seen_once_it_has_lasted(
    watch: Any, sample: Any, sign: float
) -> None:
    far = [0.3] + [0.3 + sign * 1.1 * CLOCK_S] * LATE_CLOCK_TICKS
    found = clock(watch(), far, sample)
    assert found[:LATE_CLOCK_TICKS] == [None] * LATE_CLOCK_TICKS
    trip = found[LATE_CLOCK_TICKS]
    assert trip is not None
    assert trip.rule == "R10"
    assert trip.value == pytest.approx(sign * 1.1 * CLOCK_S)
    assert (trip.limit, trip.unit) == (CLOCK_S, "s")
    near = [0.3] + [0.3 + sign * 0.9 * CLOCK_S] * 50
    assert clock(force_watch(), near) == [None] * 51


def test_r10_a_late_sample_now_and_then_is_no_clock_that_steps() -> None:
    once = [0.0] + 4 * ([2.0 * CLOCK_S] * (LATE_CLOCK_TICKS - 1) + [0.0])
    assert clock(force_watch(), once) == [None] * len(once)


def test_r10_slow_drift_of_a_clock_is_followed() -> None:
    """Of 1 us a tick the clock is in the end 1 ms behind, whatever has been gone."""
    drift = [1e-6 * i for i in range(40_000)]
    watch = force_watch()
    assert all(found is None for found in clock(watch, drift))
    assert drift[-1] > 2.0 * CLOCK_S


@pytest.mark.parametrize(
    ("axis", "index", "sign"),
    [("+fx", 0, 1.0), ("-fx", 0, -1.0), ("+fy", 1, 1.0), ("-fy", 1, -1.0), ("+fz", 2, 1.0),
     ("-fz", 2, -1.0)],
)  # fmt: skip
def test_the_pressing_axis_picks_a_component_and_its_sign(
    axis: str, index: int, sign: float
) -> None:
    assert wrench_axis(axis) == (index, sign)
    watch = force_watch(axis)
    wrench = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    sample = force_sample(0, 0.0, wrench=wrench)
    take(watch, sample)
    assert watch.raw_n == watch.project(sample) == sign * wrench[index]
