"""One zero of travel for all cycles, the touches beside it, and the force across the axis."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stepload.estimators.across import Across
from stepload.record.reader import Event, Recording
from stepload.record.rows import ArmColumns, DisplacementColumns, ForceColumns, Phase, TickColumns
from stepload.results.press_data import LOADING, PressData, largest_step, press_data
from stepload.results.remarks import remarks, reopened

STIFFNESS_N_PER_M = 2e6
RATE_HZ = 1000.0
SURFACE_M = 3e-3
SETS_M = (0.0, 5e-6, 8e-6)
"""How far the surface of the payload has moved when each contact begins."""
PURPOSES = ("first", "cycle", "resume")
LATERAL_N = 12.0
BIAS_N = np.array([4.0, -2.0, 1.0])


def recorded(*, lateral: bool = True, noise_n: float = 0.0) -> Recording:
    """Tare for 1 s, then three contacts of 4 s: in free air 1 s, touch, up to 100 N and down.

    The first two are cycles 1 and 2, the third is cycle 2 again, after a pause. The zero of all
    three components of force drifts by 0.1 N/s.
    """
    time_s = np.arange(0.0, 14.0, 1.0 / RATE_HZ)
    deep_m = np.full(time_s.size, -1e-4)
    phase = np.full(time_s.size, int(Phase.TARE))
    cycle = np.ones(time_s.size, np.int64)
    events = []
    for number, (shift_m, purpose) in enumerate(zip(SETS_M, PURPOSES, strict=True)):
        start_s = 1.0 + 4.0 * number
        on = (time_s >= start_s + 1.0) & (time_s < start_s + 4.0)
        press = np.interp(time_s, start_s + np.array([0.0, 0.99, 1.0, 2.5, 4.0]),
                          [-1e-4, -1e-4, 0.0, 5e-5, 0.0])  # fmt: skip
        here = (time_s >= start_s) & (time_s < start_s + 4.0)
        deep_m[here] = press[here] + shift_m
        rising = on & (time_s < start_s + 2.5)
        phase[here] = int(Phase.GUARDED_APPROACH)
        phase[on], phase[rising] = int(Phase.UNLOAD), int(Phase.LOAD)
        cycle[here] = min(number + 1, 2)
        events.append(
            Event(start_s + 1.0, "touch", {
                "position_m": SURFACE_M + shift_m, "force_n": 1.0, "cycle": min(number + 1, 2),
                "purpose": purpose,
            })
        )  # fmt: skip
    for kind, end_s in (("tare", 1.0), ("zero_shift", 14.0)):
        drift_n = 0.1 * (end_s - 0.5)
        events.append(
            Event(end_s, kind, {
                "time_s": end_s, "duration_s": 0.99, "mean_n": BIAS_N[2] + drift_n, "noise_n": 0.1,
            })
        )  # fmt: skip
    force_n = STIFFNESS_N_PER_M * np.maximum(deep_m - np.interp(
        time_s, [0.0, 5.0, 5.001, 9.0, 9.001], [0.0, 0.0, SETS_M[1], SETS_M[1], SETS_M[2]]
    ), 0.0)  # fmt: skip
    wrench = np.zeros((time_s.size, 6))
    wrench[:, 2] = force_n + BIAS_N[2] + 0.1 * time_s
    if lateral:
        share = force_n / 100.0 * LATERAL_N
        wrench[:, 0] = 0.6 * share + BIAS_N[0] + 0.1 * time_s
        wrench[:, 1] = 0.8 * share + BIAS_N[1] + 0.1 * time_s
        wrench[:, :2] += np.random.default_rng(1).normal(0.0, noise_n, (time_s.size, 2))
    zeros, count = np.zeros(time_s.size), np.arange(time_s.size)
    none = np.full(time_s.size, math.nan)
    healthy = np.zeros(time_s.size, np.int64)
    return Recording(
        path=Path("run.mcap"),
        force=ForceColumns(
            receive_time_s=time_s, sequence=count, device_time_s=none, status=healthy,
            temperature_c=none, wrench=wrench,
        ),
        second_force=None,
        arm=ArmColumns(
            receive_time_s=time_s, sequence=count, device_time_s=none, status=healthy,
            position_m=SURFACE_M + deep_m, force_n=none, pose=np.zeros((time_s.size, 6)),
        ),
        displacement=None,
        ticks=TickColumns(
            time_s=time_s, target_m=zeros, force_n=zeros, second_force_n=zeros,
            predicted_peak_n=zeros, limit_n=zeros, compliance_m_per_n=zeros, level_n=zeros,
            late_s=zeros, phase=phase, cycle=cycle, step=np.ones(time_s.size, np.int64),
        ),
        events=tuple(sorted(events, key=lambda event: event.time_s)),
        metadata={"force_axis": "+fz"}, outcome={}, attachments={}, results={}, partial=False,
        damage="",
    )  # fmt: skip


def gauge_of(run: Recording) -> DisplacementColumns:
    """A gauge across the contact that reads as the arm does."""
    return DisplacementColumns(
        receive_time_s=run.arm.receive_time_s, sequence=run.arm.sequence,
        device_time_s=run.arm.device_time_s, status=run.arm.status,
        displacement_m=run.arm.position_m - SURFACE_M,
    )  # fmt: skip


@pytest.fixture(scope="module")
def data() -> PressData:
    return press_data(recorded())


def travel_at(data: PressData, force_n: float, contact: int) -> float:
    """Travel at a force while loading in one contact."""
    loading = data.branch(LOADING) & (data.contact == contact)
    return float(np.interp(force_n, data.force_n[loading], data.travel_m[loading]))


def test_all_cycles_have_one_zero_so_that_set_and_drift_stay_in_the_travel(
    data: PressData,
) -> None:
    places = [travel_at(data, 50.0, contact) for contact in (1, 2, 3)]
    assert places[0] == pytest.approx(25e-6, abs=2e-7)
    assert np.diff(places) == pytest.approx(np.diff(SETS_M), abs=2e-7)


def test_every_touch_keeps_its_raw_position_and_tells_its_travel(data: PressData) -> None:
    assert [touch.position_m for touch in data.touches] == [SURFACE_M + m for m in SETS_M]
    assert [touch.travel_m for touch in data.touches] == pytest.approx(SETS_M, abs=2e-7)


def test_the_zero_is_the_touch_that_began_the_first_loading() -> None:
    run = recorded()
    earlier = Event(0.5, "touch", {**run.events[1].data, "cycle": 1, "purpose": "first"})
    found = press_data(replace(run, events=(earlier, *run.events)))
    assert found.touches[1].travel_m == 0.0
    assert found.touches[0].travel_m == pytest.approx(-1e-4, abs=2e-7)
    assert travel_at(found, 50.0, 2) == pytest.approx(25e-6, abs=2e-7)


def test_travel_since_its_own_touch_is_for_fits_that_take_the_zero_as_given(
    data: PressData,
) -> None:
    second = data.since_touch(2)
    loading = data.branch(LOADING, 2)
    assert second == pytest.approx(data.travel_m[loading] - SETS_M[1], abs=2e-7)
    assert data.since_touch(1) == pytest.approx(data.travel_m[data.branch(LOADING, 1)])
    assert data.since_touch(7).size == 0


def test_a_pause_is_told_with_its_shift(data: PressData) -> None:
    assert "touched again at 8" in reopened(data)
    assert reopened(data) in remarks(data)
    assert reopened(replace(data, touches=data.touches[:2])) == ""


@pytest.mark.parametrize("at_share", [None, (0.02, -0.01)])
def test_what_the_force_across_does_is_taken_out_of_the_travel_once(
    data: PressData, at_share: tuple[float, float] | None
) -> None:
    known = Across((2e-7, -1e-7), (1e-9, 1e-9), at_share=at_share)
    found = press_data(recorded(), across=known)
    assert data.across_n is not None
    x, y = at_share or (0.0, 0.0)
    due = 2e-7 * (data.across_n[:, 0] - x * data.force_n)
    due -= 1e-7 * (data.across_n[:, 1] - y * data.force_n)
    zero = np.argmin(np.abs(data.time_s - data.touches[0].time_s))
    assert found.travel_m == pytest.approx(data.travel_m - due + due[zero], abs=2e-9)
    assert found.force_n == pytest.approx(data.force_n)


def test_a_gauge_across_the_contact_does_not_see_the_arm_go_sideways() -> None:
    gauge = replace(recorded(), displacement=gauge_of(recorded()))
    known = Across((2e-7, -1e-7), (1e-9, 1e-9))
    assert press_data(gauge, across=known).travel_m == pytest.approx(press_data(gauge).travel_m)


def test_the_force_across_is_zeroed_like_the_axial_one(data: PressData) -> None:
    assert data.lateral_n is not None
    loading = data.branch(LOADING) & (data.force_n > 20.0)
    share = data.lateral_n[loading] / data.force_n[loading]
    assert share == pytest.approx(LATERAL_N / 100.0, abs=0.01)
    free = data.time_s < 1.5
    assert data.lateral_n[free].max() < 0.2


def test_noise_across_is_told_beside_the_size_that_it_raises() -> None:
    found = press_data(recorded(noise_n=0.5))
    assert found.lateral_noise_n == pytest.approx(0.5 * math.sqrt(2.0), rel=0.1)


def test_a_sensor_of_one_axis_has_no_force_across() -> None:
    found = press_data(recorded(lateral=False))
    assert found.lateral_n is None
    assert math.isnan(found.lateral_noise_n)


def test_a_force_across_that_is_no_number_is_none() -> None:
    run = recorded()
    run.force.wrench[5000, 0] = math.nan
    assert press_data(run).lateral_n is None


def test_the_lag_is_that_of_the_travel_that_is_identified() -> None:
    run = recorded()
    late_m = np.interp(run.arm.receive_time_s - 8e-3, run.arm.receive_time_s, run.arm.position_m)
    damped = replace(run, arm=run.arm._replace(position_m=late_m))
    prompt_s = press_data(run).lag.lag_s
    assert press_data(damped).lag.lag_s - prompt_s == pytest.approx(-8e-3, abs=5e-4)
    across = press_data(replace(damped, displacement=gauge_of(run)))
    assert across.gauge
    assert across.lag.lag_s == pytest.approx(prompt_s, abs=5e-4)


def test_the_largest_step_of_the_zero_is_that_between_neighbours() -> None:
    assert largest_step(np.array([1.0, 1.5, 0.7, 0.9])) == pytest.approx(-0.8)
    assert math.isnan(largest_step(np.array([1.0])))


def test_the_zero_of_force_before_and_after_is_told(data: PressData) -> None:
    assert data.zero_step_n == pytest.approx(1.3)
