"""One time base: samples at the right place in spite of clocks, gaps, bad samples and lag."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from stepload.record.align import align
from stepload.record.lag import Lag, measure_lag
from stepload.record.reader import Recording
from stepload.record.rows import ArmColumns, DisplacementColumns, ForceColumns, Phase, TickColumns
from stepload.rig.samples import Status

STIFFNESS_N_PER_M = 2e6


def stepped(time_s: np.ndarray) -> np.ndarray:
    """Travel in m: every 2 s a ramp of 0.4 s by 20 µm, then a hold."""
    steps = np.floor(time_s / 2.0)
    return 20e-6 * (steps + np.clip((time_s - 2.0 * steps) / 0.4, 0.0, 1.0))


def recording(force_lag_s: float = 0.0, seed: int = 1) -> Recording:
    """40 s of contact; the force's device clock runs 120 ppm fast and its link comes in bursts."""
    rng = np.random.default_rng(seed)
    true_s = np.arange(0.0, 40.0, 1e-3)
    burst = np.arange(len(true_s)) // 8
    receive_s = burst * 8e-3 + 7e-3 + rng.exponential(100e-6, len(true_s))
    wrench = np.zeros((len(true_s), 6))
    wrench[:, 2] = -STIFFNESS_N_PER_M * stepped(true_s - force_lag_s) + 3.0
    wrench[:, 2] += rng.normal(0.0, 0.02, len(true_s))
    arm_s = np.arange(0.0, 40.0, 2e-3)
    tick_s = arm_s.copy()
    position_m = stepped(arm_s) + rng.normal(0.0, 0.1e-6, len(arm_s))
    step = np.floor(tick_s / 2.0).astype(np.int64) + 1
    zeros = np.zeros(len(tick_s))
    return Recording(
        path=Path("run.mcap"),
        force=ForceColumns(
            receive_time_s=receive_s,
            sequence=np.arange(len(true_s)),
            device_time_s=77.0 + true_s * (1.0 + 120e-6),
            status=np.zeros(len(true_s), np.int64),
            temperature_c=np.full(len(true_s), np.nan),
            wrench=wrench,
        ),
        second_force=None,
        arm=ArmColumns(
            receive_time_s=arm_s,
            sequence=np.arange(len(arm_s)),
            device_time_s=np.full(len(arm_s), np.nan),
            status=np.zeros(len(arm_s), np.int64),
            position_m=position_m,
            force_n=np.full(len(arm_s), np.nan),
            pose=np.zeros((len(arm_s), 6)),
            wrench=np.full((len(arm_s), 6), np.nan),
        ),
        displacement=None,
        ticks=TickColumns(
            time_s=tick_s,
            target_m=zeros,
            force_n=zeros,
            second_force_n=zeros,
            predicted_peak_n=zeros,
            limit_n=zeros,
            compliance_m_per_n=zeros,
            level_n=50.0 * step,
            late_s=zeros,
            phase=np.full(len(tick_s), int(Phase.LOAD)),
            cycle=np.ones(len(tick_s), np.int64),
            step=step,
        ),
        events=(),
        metadata={"force_axis": "-fz"},
        outcome={},
        attachments={},
        results={},
        partial=False,
        damage="",
    )


def test_bursts_and_skew_are_undone() -> None:
    got = align(recording())
    force, arm = got.clocks
    assert force.how == "device clock"
    assert force.skew_ppm == pytest.approx(-120.0, abs=10.0)
    assert 3000.0 < force.residual_median_us < 5000.0
    assert arm.how == "receive time"
    assert "finite" in arm.why
    interval_s = np.diff(got.time_s)
    assert np.abs(interval_s - 1e-3).max() < 1e-5
    assert (got.step == np.floor(got.time_s / 2.0) + 1).all()
    assert (got.level_n == 50.0 * got.step).all()
    assert (got.phase == Phase.LOAD).all()


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
def test_a_bent_law_is_no_lag(exponent: float) -> None:
    time_s = np.arange(0.0, 30.0, 1e-3)
    rng = np.random.default_rng(5)
    position_m = stepped(time_s)
    force_n = 300.0 * (position_m / 300e-6) ** exponent + rng.normal(0.0, 0.02, len(time_s))
    lag = measure_lag(time_s, force_n, position_m + rng.normal(0.0, 0.1e-6, len(time_s)))
    assert abs(lag.lag_s) < 4.0 * lag.sigma_s
    assert lag.sigma_s < 1e-3


@pytest.mark.parametrize("lag_s", [-0.012, 0.0, 0.004, 0.03])
def test_the_lag_is_measured_and_corrected(lag_s: float) -> None:
    record = recording(force_lag_s=lag_s)
    raw = align(record)
    lag = measure_lag(raw.time_s, raw.force_n, raw.position_m)
    assert lag.lag_s == pytest.approx(lag_s, abs=0.3e-3)
    assert 0.0 < lag.sigma_s < 0.2e-3
    assert "windows" in lag.how
    fixed = align(record, lag_s=lag.lag_s)
    residual_n = fixed.force_n + 3.0 - STIFFNESS_N_PER_M * fixed.position_m
    assert np.sqrt(np.mean(residual_n**2)) < 0.3


def test_no_motion_tells_no_lag() -> None:
    time_s = np.arange(0.0, 20.0, 1e-3)
    noise = np.random.default_rng(0).normal(size=(2, len(time_s)))
    lag = measure_lag(time_s, noise[0], noise[1])
    assert np.isnan(lag.lag_s)
    assert np.isinf(lag.sigma_s)
    assert "windows" in lag.how
    none = measure_lag(time_s, noise[0], noise[1], np.zeros(len(time_s), bool))
    assert none.how == "no data in contact"


def test_bad_samples_and_gaps_are_left_out() -> None:
    record = recording()
    record.force.status[100:110] = Status.SATURATED
    record.force.status[200:210] = Status.OVERRANGE
    record.force.wrench[300] = np.nan
    keep = np.ones(len(record.arm.receive_time_s), bool)
    keep[5000:5100] = False
    arm = ArmColumns(*(column[keep] for column in record.arm))
    got = align(replace(record, arm=arm))
    assert np.isfinite(got.force_n).all()
    left_out = len(record.force.status) - len(got.time_s)
    assert 10 + 1 + 198 <= left_out <= 10 + 1 + 203 + 10
    inside = (got.time_s > 10.001) & (got.time_s < 10.199)
    assert not inside.any()


@pytest.mark.parametrize("stream", ["arm", "ticks"])
def test_samples_outside_another_stream_are_left_out(stream: str) -> None:
    record = recording()
    columns = getattr(record, stream)
    time_s = columns[2] if stream == "arm" else columns[0]
    kept = (time_s >= 1.0) & ((time_s <= 39.0) | (stream == "ticks"))
    kind = ArmColumns if stream == "arm" else TickColumns
    got = align(replace(record, **{stream: kind(*(column[kept] for column in columns))}))
    assert got.time_s[0] >= 1.0
    assert got.time_s[0] < 1.01
    if stream == "arm":
        assert 38.99 < got.time_s[-1] <= 39.0


def gauge(time_s: np.ndarray) -> DisplacementColumns:
    return DisplacementColumns(
        sequence=np.arange(len(time_s)),
        device_time_s=np.full(len(time_s), np.nan),
        receive_time_s=time_s,
        status=np.zeros(len(time_s), np.int64),
        displacement_m=time_s * 1e-6,
    )


def test_a_gauge_is_read_at_the_force_s_times_and_its_gaps_are_left_out() -> None:
    time_s = np.arange(0.0, 40.0, 0.02)
    time_s = time_s[(time_s < 10.0) | (time_s > 11.0)]
    got = align(replace(recording(), displacement=gauge(time_s)))
    assert got.displacement_m is not None
    np.testing.assert_allclose(got.displacement_m, got.time_s * 1e-6, atol=1e-12)
    assert not ((got.time_s > 10.01) & (got.time_s < 10.99)).any()
    assert [clock.channel for clock in got.clocks] == ["force", "arm", "displacement"]


def test_a_device_clock_that_no_quartz_can_have_is_not_believed() -> None:
    record = recording()
    record.force.device_time_s[:] = 77.0 + (record.force.device_time_s - 77.0) * 1.01
    clock = align(record).clocks[0]
    assert clock.how == "receive time"
    assert "1000 ppm" in clock.why


def test_the_lag_of_a_short_noisy_run_lies_within_its_interval() -> None:
    """Three slow steps, 13 s: few windows, whose disagreement alone would tell far too little."""
    time_s = np.arange(0.0, 13.0, 1e-3)
    speed_m_s = np.where(time_s % 4.3 < 2.0, 200e-6, 0.0)
    position_m = np.cumsum(speed_m_s) * 1e-3
    late_m = np.interp(time_s - 0.02, time_s, position_m)
    force_n = 300.0 * (late_m / 5e-3) ** 1.5
    rng = np.random.default_rng(7)
    off = []
    for _ in range(60):
        noisy_m = position_m + rng.normal(0.0, 1e-7, len(time_s))
        lag = measure_lag(time_s, force_n + rng.normal(0.0, 0.5, len(time_s)), noisy_m)
        off.append((lag.lag_s - 0.02) / lag.sigma_s)
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.25
    assert np.abs(off).max() < 4.0


@pytest.mark.parametrize("length_s", [7.0, 60.0])
@pytest.mark.parametrize("rate_hz", [0.3, 1.0, 2.0, 2.5, 3.0, 5.0, 10.0, 50.0])
def test_slow_sensors_tell_a_lag_or_that_they_cannot(rate_hz: float, length_s: float) -> None:
    time_s = np.arange(0.0, length_s, 1.0 / rate_hz)
    position_m = stepped(time_s)
    force_n = STIFFNESS_N_PER_M * position_m
    noise_n = np.random.default_rng(2).normal(0.0, 0.1, len(time_s))
    lag = measure_lag(time_s, force_n + noise_n, position_m)
    assert lag.sigma_s > 0.0
    assert np.isnan(lag.lag_s) or abs(lag.lag_s) < 6.0 * lag.sigma_s


@pytest.mark.parametrize("creeps", [False, True])
def test_a_force_that_comes_early_is_left_in_the_data(creeps: bool) -> None:
    """Creep and damping put the force ahead of the position; only a late force is a lag."""
    time_s = np.arange(0.0, 60.0, 1e-3)
    force_n = 1e6 * stepped(time_s)
    late_s = 0.6 if creeps else 0.02
    keep = np.exp(-1e-3 / late_s)
    follows_m = lfilter([1.0 - keep], [1.0, -keep], force_n) / 1e6
    position_m = force_n / 1e6 + 0.1 * follows_m if creeps else follows_m
    force_n += np.random.default_rng(4).normal(0.0, 0.05, len(time_s))
    lead = measure_lag(time_s, force_n, position_m)
    assert lead.lag_s < -max(3.0 * lead.sigma_s, 1e-3)
    assert lead.correction_s == 0.0
    assert Lag(0.02, 1e-3, "").correction_s == 0.02
    assert Lag(0.02, 0.01, "").correction_s == 0.0
