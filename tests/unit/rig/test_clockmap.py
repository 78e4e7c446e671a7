"""Device clocks on the host's: offset and skew found under latency that only ever adds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepload.errors import DomainError
from stepload.rig.clockmap import ClockMap, fit_clock


def pairs(
    skew: float, span_s: float, seed: int, rate_hz: float = 200.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(device, true host, receive) times: exponential latency with rare long delays."""
    rng = np.random.default_rng(seed)
    device_s = 1234.5 + np.arange(0.0, span_s, 1.0 / rate_hz)
    true_s = 5000.0 + (device_s - device_s[0]) * (1.0 + skew)
    latency_s = rng.exponential(300e-6, len(device_s))
    latency_s += (rng.random(len(device_s)) < 0.02) * rng.uniform(0, 0.02, len(device_s))
    return device_s, true_s, true_s + latency_s


@settings(max_examples=10, deadline=None)
@given(st.floats(-3e-4, 3e-4), st.floats(20.0, 200.0), st.integers(0, 1000))
def test_batch_finds_skew_and_offset(skew: float, span_s: float, seed: int) -> None:
    device_s, true_s, receive_s = pairs(skew, span_s, seed)
    fit = fit_clock(device_s, receive_s)
    assert abs(fit.skew - skew) < 300e-6 / span_s
    error_s = fit.to_host(device_s) - true_s
    assert np.abs(error_s).max() < 150e-6
    assert (fit.to_host(device_s) <= receive_s + 1e-9).all()
    assert 100.0 < fit.residual_median_us < 400.0
    assert fit.residual_p99_us > 1000.0


@settings(max_examples=10, deadline=None)
@given(st.floats(-3e-4, 3e-4), st.integers(0, 1000))
def test_streaming_follows(skew: float, seed: int) -> None:
    device_s, true_s, receive_s = pairs(skew, 60.0, seed)
    clock = ClockMap()
    errors = []
    for device, true, receive in zip(
        device_s.tolist(), true_s.tolist(), receive_s.tolist(), strict=True
    ):
        clock.add(device, receive)
        errors.append(clock.to_host(device) - true)
        assert clock.to_host(device) <= receive + 1e-9
    assert abs(clock.skew - skew) < 20e-6
    assert np.abs(errors[len(errors) // 2 :]).max() < 200e-6


def test_a_bursty_link_is_undone() -> None:
    device_s = np.arange(0.0, 30.0, 1e-3)
    receive_s = 50.0 + (np.floor(device_s / 16e-3) + 1) * 16e-3 + 1e-3
    mapped_s = fit_clock(device_s, receive_s).to_host(device_s)
    assert np.abs(np.diff(mapped_s) - 1e-3).max() < 1e-6


def test_jumps_show_in_the_residual() -> None:
    clock = ClockMap()
    for i in range(100):
        assert abs(clock.add(i * 0.01, 7.0 + i * 0.01)) < 1e-9
    assert clock.add(1.0 + 3.0, 7.0 + 1.0) == pytest.approx(-3.0)
    still = ClockMap()
    for _ in range(2):
        still.add(1.0, 7.0)
    assert still.add(1.0, 8.5) == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("device_s", "message"),
    [
        ([1.0], "at least 2"),
        ([1.0, 2.0, 2.0], "does not rise: 2.0 s is followed by 2.0 s"),
        ([1.0, 5.0, 2.0], r"does not rise: 5.0 s is followed by 2.0 s \(sample 2\)"),
        ([1.0, float("nan"), 2.0], "finite"),
    ],
)
def test_clocks_that_are_none(device_s: list[float], message: str) -> None:
    with pytest.raises(DomainError, match=message):
        fit_clock(np.array(device_s), np.arange(len(device_s), dtype=float))
