"""Creep in holds of a contact whose creep, time and drift were put in."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from long_ones import long, long_rows

from stepload.estimators.fit import Fit, Missing
from stepload.estimators.relaxation import (
    HoldSamples,
    Relaxation,
    relaxation,
)
from stepload.estimators.sources import Sources, quantum_left

K, N, K_S = 6.57e8, 1.5, 3.49e6
LAW = Fit("joint", K, N, 0.0, 5.06e6, 300.0, None, 0.0, 100)
UP, DOWN = (50.0, 100.0, 150.0, 200.0, 250.0, 300.0), (250.0, 200.0, 150.0, 100.0, 50.0)
STEP_S = 0.01


@cache
def course(creep, tau, hold, *, down, force_held):
    """Time, force, travel and part: the force is ramped, then the travel is held (or the force)."""
    rows, late, now, force, before = [], 0.0, 0.0, 0.5, 0.5
    keep = math.exp(-STEP_S / tau)

    def deep(newton):
        return (newton / K) ** (1.0 / N)

    def step(newton):
        nonlocal late, now
        late = late * keep + deep(newton) * (1.0 - keep)
        now += STEP_S

    for part, level in enumerate((*UP, *(DOWN if down else ()))):
        for i in range(1, 101):
            force = before + (level - before) * i / 100
            step(force)
            rows.append((now, force, deep(force) + creep * late + force / K_S, 2 * part))
        stays = rows[-1][2]
        for _ in range(int(hold / STEP_S)):
            step(force)
            if not force_held:
                for _ in range(3):  # Newton: the travel stays what it was
                    off = deep(force) + creep * late + force / K_S - stays
                    force -= off / (deep(force) / (N * force) + 1.0 / K_S)
            travel = deep(force) + creep * late + force / K_S
            rows.append((now, force, travel, 2 * part + 1))
        before = force
    return np.array(rows)


def pressed(
    creep,
    tau,
    *,
    seed=1,
    drift=0.0,
    quantum=2e-6,
    noise=0.7,
    hold=3.0,
    down=True,
    force_held=False,
    slip=0.0,
):
    """A run on an arm."""
    table = course(creep, tau, hold, down=down, force_held=force_held)
    rng = np.random.default_rng(seed)
    time_s = np.arange(table[0, 0], table[-1, 0], 1e-3)
    force_n = np.interp(time_s, table[:, 0], table[:, 1]) + rng.normal(0.0, noise, time_s.size)
    travel_m = np.interp(time_s, table[:, 0], table[:, 2]) + drift * time_s
    travel_m += rng.normal(0.0, 2e-7, time_s.size) + rng.uniform(0.0, 1e-5)
    if quantum:
        travel_m, force_n = np.round(travel_m / quantum) * quantum, np.round(force_n / 1.5) * 1.5
    part = table[np.minimum(np.searchsorted(table[:, 0], time_s), len(table) - 1), 3]
    middle = np.mean(time_s[part == 2 * len(UP) - 1])
    deformation_m = travel_m - force_n / K_S + slip * (time_s > middle)
    holds = [
        HoldSamples(
            time_s[part == i], deformation_m[part == i], force_n[part == i], bool(i < 2 * len(UP))
        )
        for i in range(1, int(part[-1]) + 1, 2)
    ]
    sources = Sources(
        K_S, force_noise_n=noise, force_resolution_n=1.5 if quantum else 0.0,
        position_noise_m=2e-7, position_resolution_m=quantum,
    )  # fmt: skip
    return relaxation(time_s, force_n, holds, LAW, sources)


@pytest.mark.parametrize(("creep", "tau"), [(0.05, 2.0), (0.1, 5.0), (0.2, 1.5)])
def test_creep_and_time_come_back(creep, tau):
    found = pressed(creep, tau, quantum=0.0, noise=0.1)
    assert found.resolved
    assert found.creep_share == pytest.approx(creep, abs=max(3 * found.creep_sigma, 0.02 * creep))
    assert found.creep_sigma < 0.1 * creep
    low, high = found.time_interval_s
    assert low < tau < high < 1.6 * low
    assert low <= found.time_s <= high
    assert found.relaxation_share == pytest.approx(N * creep / (1 + N * creep), rel=0.1)


def test_a_held_force_tells_the_same_as_a_held_travel():
    travel = pressed(0.1, 5.0, quantum=0.0, noise=0.1)
    force = pressed(0.1, 5.0, quantum=0.0, noise=0.1, force_held=True)
    assert force.creep_share == pytest.approx(travel.creep_share, rel=0.05)
    assert abs(force.holds[5].force_change_n) < 0.1 < abs(travel.holds[5].force_change_n)


@pytest.mark.parametrize("seed", [0, 1, *long(range(2, 6))])
def test_no_creep_is_not_resolved(seed):
    for quantum in (0.0, 2e-6):
        found = pressed(0.0, 5.0, seed=seed, quantum=quantum)
        assert not found.resolved
        assert found.time_s is None
        assert "not resolved" in found.why
        assert abs(found.creep_share) < 3 * found.creep_sigma


@pytest.mark.parametrize("seed", [0, *long(range(1, 4))])
def test_a_drift_is_no_creep_where_the_way_down_was_held_too(seed):
    found = pressed(0.0, 5.0, seed=seed, drift=2e-7)
    assert not found.resolved
    assert found.drift_m_per_s == pytest.approx(2e-7, abs=3 * found.drift_sigma_m_per_s)
    assert found.drift_sigma_m_per_s < 1e-7
    fine = pressed(0.0, 5.0, seed=seed, drift=2e-7, quantum=0.0, noise=0.1)
    assert not fine.resolved
    assert fine.drift_m_per_s == pytest.approx(2e-7, rel=0.05)


def test_without_holds_on_the_way_down_drift_is_named():
    found = pressed(0.2, 2.0, quantum=0.0, noise=0.1, down=False)
    assert found.resolved
    assert found.drift_m_per_s is None
    assert "drift of the travel would be in it" in found.why


def test_recovery_under_load_is_no_creep():
    found = pressed(-0.1, 5.0, quantum=0.0, noise=0.1)
    assert not found.resolved


@pytest.mark.parametrize(("count", "least", "told"), [(8, 7, 7), *long_rows([(12, 11, 10)])])
def test_the_interval_holds_the_truth_in_spite_of_quanta(count, least, told):
    runs = [pressed(0.15, 3.0, seed=seed) for seed in range(count)]
    assert all(isinstance(run, Relaxation) for run in runs)
    inside = sum(abs(run.creep_share - 0.15) < 2 * run.creep_sigma for run in runs)
    assert inside >= least
    ends = [run.time_interval_s for run in runs if run.resolved]
    assert len(ends) >= told
    assert sum((low or 0.0) < 3.0 < (high or math.inf) for low, high in ends) >= len(ends) - 1


@pytest.mark.long
def test_the_interval_holds_the_truth_where_a_drift_makes_readings_jump():
    runs = [pressed(0.2, 2.0, seed=seed, drift=1.5e-7) for seed in range(16)]
    assert sum(abs(run.creep_share - 0.2) < 2 * run.creep_sigma for run in runs) >= 14
    assert all(run.resolved and run.creep_sigma < 0.05 for run in runs)


def test_a_slip_in_one_hold_is_no_creep():
    found = pressed(0.0, 5.0, quantum=0.0, noise=0.1, slip=3e-6)
    assert not found.resolved
    assert abs(found.creep_share) < 3 * found.creep_sigma


def test_a_quantum_hides_a_small_creep_of_one_hold():
    found = pressed(0.02, 3.0)
    top = found.holds[5]
    assert not top.resolved
    # Two readings of a 2 µm quantum at rest.
    assert top.sigma_m == pytest.approx(math.sqrt(2.0) * 2e-6 / math.sqrt(12.0) * 0.65, rel=0.4)


def test_short_or_absent_holds_are_told():
    short = pressed(0.1, 5.0, hold=0.5)
    assert isinstance(short, Missing)
    assert "0.6 s" in short.why
    nothing = np.zeros(3)
    assert isinstance(relaxation(nothing, nothing, [], LAW, Sources(K_S)), Missing)
    empty = HoldSamples(np.empty(0), np.empty(0), np.empty(0), True)
    assert isinstance(relaxation(nothing, nothing, [empty], LAW, Sources(K_S)), Missing)


def test_holds_on_the_way_down_alone_say_nothing_of_the_loading():
    time_s = np.arange(0.0, 3.0, 1e-3)
    hold = HoldSamples(time_s, np.full(time_s.size, 5e-5), np.full(time_s.size, 100.0), False)
    found = relaxation(time_s, hold.force_n, [hold], LAW, Sources(K_S, force_noise_n=0.1))
    assert isinstance(found, Missing)
    assert "way up" in found.why


def test_what_a_quantum_leaves_of_a_mean():
    assert quantum_left(2e-6, 0.0) == pytest.approx(2e-6 / math.sqrt(12.0), rel=2e-3)
    assert quantum_left(0.0, 1.0) == 0.0
    rng = np.random.default_rng(3)
    true = rng.uniform(-0.5, 0.5, 400)
    for noise in (0.25, 0.35):
        read = np.round(true[:, None] + rng.normal(0.0, noise, (400, 5000)))
        error = read.mean(axis=1) - true
        assert quantum_left(1.0, noise) == pytest.approx(float(error.std()), rel=0.15)


def test_a_finer_quantum_narrows():
    coarse = pressed(0.1, 5.0)
    fine = pressed(0.1, 5.0, quantum=2e-7)
    assert fine.creep_sigma < 0.6 * coarse.creep_sigma
