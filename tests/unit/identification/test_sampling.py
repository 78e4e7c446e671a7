"""Downsampling uniform in force, thinning in time, the band of rest."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload.identification.fit import FloatArray
from stepload.identification.samples import FORCE_BINS, rest_band, uniform_in_force


def step_forces() -> FloatArray:
    """1000 Hz: six ramps of 50 N in 1 s, each held for 3 s."""
    parts = []
    for level in range(0, 300, 50):
        parts.append(np.linspace(level, level + 50.0, 1000, endpoint=False))
        parts.append(np.full(3000, level + 50.0))
    return np.concatenate(parts)


def test_holds_do_not_dominate() -> None:
    force_n = step_forces() + np.random.default_rng(0).normal(0.0, 0.4, 24_000)
    chosen = uniform_in_force(force_n, 1200)
    assert chosen.size == 1200
    counts, _ = np.histogram(force_n[chosen], bins=10)
    assert counts.max() <= 1.1 * counts.min()
    before, _ = np.histogram(force_n, bins=10)
    assert before.max() > 3 * before.min()


def test_samples_are_spread_over_the_time_of_a_bin() -> None:
    chosen = uniform_in_force(np.append(np.full(1000, 100.0), 0.0), FORCE_BINS * 10)
    held = chosen[chosen < 1000]
    assert held.size == 10
    assert np.ptp(np.diff(held)) <= 1
    assert abs(held[0] - (1000 - held[-1])) <= 1


@given(st.lists(st.floats(-10.0, 400.0), max_size=200), st.integers(1, 500))
def test_indices_are_rising_and_no_bin_is_empty(forces: list[float], count: int) -> None:
    force_n = np.array(forces)
    chosen = uniform_in_force(force_n, count)
    assert (np.diff(chosen) > 0).all()
    assert chosen.size <= max(count + FORCE_BINS, 1)
    if forces and np.ptp(force_n) > 1e-6:
        edges = np.linspace(force_n.min(), force_n.max(), FORCE_BINS + 1)[1:-1]
        assert set(np.digitize(force_n, edges)) == set(np.digitize(force_n[chosen], edges)) or (
            np.min(np.abs(force_n[:, None] - edges)) < 1e-9
        )


def test_rest_band_is_five_times_the_noise() -> None:
    rng = np.random.default_rng(0)
    noisy = step_forces()[::10] + rng.normal(0.0, 0.4, 2400)
    assert rest_band(noisy) == pytest.approx(2.0, rel=0.15)


def test_rest_band_is_above_one_quantum() -> None:
    rng = np.random.default_rng(0)
    noisy = step_forces()[::10] + rng.normal(0.0, 0.1, 2400)
    assert rest_band(np.round(noisy / 1.5) * 1.5) == pytest.approx(2.25)
    assert rest_band(np.array([1.0])) == 0.0
