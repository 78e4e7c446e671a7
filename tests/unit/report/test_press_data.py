"""One zero of travel for all cycles, the touches beside it, and the lateral force."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from recorded_runs import BIAS_N, LATERAL_N, SETS_M, SURFACE_M, recorded

from stepload.identification.lateral_coupling import Across
from stepload.record.reader import Event, Recording
from stepload.record.rows import DisplacementColumns
from stepload.report.press_data import LOADING, PressData, press_data
from stepload.report.reasons import remarks, reopened


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


def test_all_cycles_have_one_zero_so_that_set_and_drift_stay_in_the_travel(data: PressData) -> None:
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
    assert data.across_n is not None
    lateral_n = np.linalg.norm(data.across_n, axis=1)
    loading = data.branch(LOADING) & (data.force_n > 20.0)
    share = lateral_n[loading] / data.force_n[loading]
    assert share == pytest.approx(LATERAL_N / 100.0, abs=0.01)
    free = data.time_s < 1.5
    assert lateral_n[free].max() < 0.2


def test_noise_across_is_told_beside_the_size_that_it_raises() -> None:
    found = press_data(recorded(noise_n=0.5))
    assert found.lateral_noise_n == pytest.approx(0.5 * math.sqrt(2.0), rel=0.1)


def test_the_lag_is_that_of_the_travel_that_is_identified() -> None:
    run = recorded()
    late_m = np.interp(run.arm.receive_time_s - 8e-3, run.arm.receive_time_s, run.arm.position_m)
    damped = replace(run, arm=run.arm._replace(position_m=late_m))
    prompt_s = press_data(run).lag.lag_s
    assert press_data(damped).lag.lag_s - prompt_s == pytest.approx(-8e-3, abs=5e-4)
    across = press_data(replace(damped, displacement=gauge_of(run)))
    assert across.gauge
    assert across.lag.lag_s == pytest.approx(prompt_s, abs=5e-4)


def test_the_zero_of_force_before_and_after_is_told(data: PressData) -> None:
    assert data.zero_step_n == pytest.approx(1.3)


def test_the_arms_own_force_is_the_second_channel_with_its_own_zero() -> None:
    recording = recorded()
    force_n = recording.force.wrench[:, 2] - BIAS_N[2] - 0.1 * recording.arm.receive_time_s
    arm = recording.arm._replace(force_n=0.9 * force_n + 7.0)
    events = tuple(
        replace(event, data={**event.data, "second_mean_n": 7.0}) for event in recording.events
    )
    data = press_data(replace(recording, arm=arm, events=events))
    assert data.second_n is not None
    pressed = data.branch(LOADING)
    assert data.second_n[pressed] == pytest.approx(0.9 * data.force_n[pressed], abs=1.0)
    assert press_data(recording).second_n is None
