"""Damping of contacts whose dissipation, lag and creep were put in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stepload.estimators.fit import Fit
from stepload.estimators.hunt_crossley import LEAST_LAG_SIGMA_S, hunt_crossley
from stepload.estimators.missing import Missing
from stepload.estimators.sources import Sources

K, N, K_S = 6.57e8, 1.5, 3.49e6
LAW = Fit("joint", K, N, 0.0, 5.06e6, 300.0, None, 0.0, 100)
LEVELS = (50.0, 100.0, 150.0, 200.0, 250.0, 300.0)


def data(
    d, *, lag=0.0, seed=0, quantum=0.0, noise=0.1, gauge=True, rate=50.0, hold=3.0, creep=0.0,
    lag_sigma=0.0,
):  # fmt: skip
    """F = K δⁿ (1 + d δ̇) on a path of ramps and holds at 1 kHz; the force comes late by `lag`."""
    rng, step = np.random.default_rng(seed), 1e-3
    path, before = [np.full(2, 3.0)], 3.0
    for level in LEVELS:
        count = max(int((level - before) / rate / step), 2)
        path += [np.linspace(before, level, count), np.full(int(hold / step), level)]
        before = level
    deep = (np.concatenate(path) / K) ** (1.0 / N)
    weights = np.hanning(41) / np.hanning(41).sum()
    deep = np.convolve(np.pad(deep, 20, "edge"), weights, "valid")
    time = step * np.arange(deep.size)
    force = K * deep**N * (1.0 + d * np.gradient(deep, step))
    if creep:
        late = np.zeros_like(deep)
        for i in range(1, deep.size):
            late[i] = late[i - 1] + (deep[i] - late[i - 1]) * step / 2.0
        force = force * (1.0 - creep * late / deep)
    force = np.interp(time - lag, time, force) + rng.normal(0.0, noise, time.size)
    travel = deep + (0.0 if gauge else force / K_S) + rng.normal(0.0, 5e-8, time.size)
    if quantum:
        travel = np.round((travel + rng.uniform(0.0, quantum)) / quantum) * quantum
    sources = Sources(
        None if gauge else K_S, force_noise_n=noise, position_noise_m=5e-8,
        position_resolution_m=quantum, lag_sigma_s=lag_sigma,
    )  # fmt: skip
    return time, travel if gauge else travel - force / K_S, force, LAW, sources


@pytest.mark.parametrize("true", [300.0, 1000.0, 5000.0])
def test_damping_comes_back_where_it_is_larger_than_a_lag(true):
    for seed in range(4):
        found = hunt_crossley(*data(true, seed=seed))
        low, high = found.interval_s_per_m
        assert low < true < high
        assert found.dissipation_s_per_m == pytest.approx(true, rel=0.3)
        assert found.alpha_s_per_m == pytest.approx(2.0 * found.dissipation_s_per_m / 3.0)
        assert found.upper_bound_s_per_m == pytest.approx(high)


@pytest.mark.parametrize("lag", [-1e-3, -0.5e-3, 0.0, 0.5e-3, 1e-3])
def test_what_a_lag_of_a_millisecond_explains_is_never_damping(lag):
    for seed in range(4):
        found = hunt_crossley(*data(0.0, lag=lag, seed=seed, noise=0.05))
        assert found.dissipation_s_per_m is None
        assert found.interval_s_per_m is None
        assert found.alpha_s_per_m is None
        assert found.why.startswith("not determined")


def test_the_lag_is_in_the_uncertainty_however_well_it_is_said_to_be_known():
    found = hunt_crossley(*data(1000.0, lag_sigma=1e-6))
    # d ≡ n τ/δ; over these depths that is 25 to 80 s/m for 1 ms.
    assert found.lag_sigma_s == LEAST_LAG_SIGMA_S
    assert 20.0 < found.lag_sigma_s_per_m < 80.0
    assert found.sigma_s_per_m >= found.lag_sigma_s_per_m
    worse = hunt_crossley(*data(1000.0, lag_sigma=5e-3))
    assert worse.lag_sigma_s_per_m == pytest.approx(5.0 * found.lag_sigma_s_per_m, rel=0.05)


def test_a_large_lag_the_other_way_is_called_no_damping():
    found = hunt_crossley(*data(0.0, lag=10e-3))
    assert found.dissipation_s_per_m is None
    assert "smaller while it rises" in found.why


def test_quanta_widen():
    found = hunt_crossley(*data(0.0, quantum=2e-6, noise=0.7))
    assert found.dissipation_s_per_m is None
    assert found.sigma_s_per_m > 300.0
    assert found.upper_bound_s_per_m > 600.0
    time, deep, force, law, sources = data(0.0)
    told = replace(sources, position_resolution_m=2e-6)
    assert hunt_crossley(time, deep, force, law, told).sigma_s_per_m > 300.0


def test_creep_is_not_taken_for_damping():
    for seed in range(4):
        found = hunt_crossley(*data(0.0, creep=0.1, seed=seed))
        assert found.dissipation_s_per_m is None
        # How far early and late halves of the holds disagree is in it: more than the lag.
        assert found.sigma_s_per_m > 10.0 * found.lag_sigma_s_per_m


def test_with_the_system_in_the_chain_it_is_a_bound_only():
    found = hunt_crossley(*data(5000.0, gauge=False))
    assert found.dissipation_s_per_m is None
    assert found.upper_bound_s_per_m > 4900.0
    assert "load path" in found.why


def test_a_lag_that_was_taken_out_took_damping_with_it():
    found = hunt_crossley(*data(1000.0), lag_corrected_s=-3e-3)
    assert isinstance(found, Missing)
    assert "-3 ms" in found.why


def test_one_rate_short_ramps_and_no_data_are_told():
    one_rate = hunt_crossley(*data(1000.0, hold=0.0))
    assert isinstance(one_rate, Missing)
    assert "did not vary enough" in one_rate.why
    for true in (100.0, 1000.0):
        short = hunt_crossley(*data(true, rate=500.0))
        assert isinstance(short, Missing)
        assert "no ramp" in short.why
    nothing = np.empty(0)
    assert isinstance(hunt_crossley(nothing, nothing, nothing, LAW, Sources(None)), Missing)
    time, deep, force, law, sources = data(1000.0)
    few = hunt_crossley(time[:500], deep[:500], force[:500], law, sources)
    assert isinstance(few, Missing)
