"""System stiffness (26): known truth in, honest sigma out."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from long_ones import long

from stepload.identification.smooth import smooth_correlation
from stepload.identification.system_stiffness import SeriesContact
from stepload.identification.system_stiffness import fit_system_stiffness as fit_anything

KS, CS = 3.49e6, 3.87e4
LENGTH_N = 50.0
"""Correlation length of the smooth errors drawn here."""
fit_system_stiffness = partial(fit_anything, length_n=LENGTH_N)
RATE_HZ = 100


def steps(top_n=300.0, step_n=50.0, ramp_s=1.0, hold_s=2.0):
    """Force steps: time, force, force rate."""
    ramp = np.arange(round(ramp_s * RATE_HZ)) / RATE_HZ / ramp_s
    force, rate = [], []
    for level in np.arange(0.0, top_n, step_n):
        force += [level + step_n * ramp, np.full(round(hold_s * RATE_HZ), level + step_n)]
        rate += [np.full(ramp.size, step_n / ramp_s), np.zeros(round(hold_s * RATE_HZ))]
    f = np.concatenate(force)
    return np.arange(f.size) / RATE_HZ, f, np.concatenate(rate)


def smooth_draw(rng, force, sd, length=LENGTH_N):
    grid = np.linspace(-10.0, 320.0, 67)
    value, vector = np.linalg.eigh(smooth_correlation(grid, length))
    draw = vector @ (np.sqrt(np.clip(value, 0, None)) * rng.standard_normal(grid.size))
    return sd * np.interp(force, grid, draw)


def travel(force, rate, contact=None, zero_m=2e-6):
    contact_m = 0.0 if contact is None else contact.deformation_m(force)
    # (26) with a slowly varying force: dδ/dt = Ḟ/K_s to first order.
    return zero_m + force / KS - CS / KS * rate / KS + contact_m


def test_clean_data_give_back_stiffness_and_damping():
    time, force, rate = steps()
    fit = fit_system_stiffness(time, travel(force, rate), force)
    assert fit.stiffness_n_per_m == pytest.approx(KS, rel=2e-3)
    assert fit.damping_n_s_per_m == pytest.approx(CS, rel=0.25)
    assert fit.intercept_n == pytest.approx(-2e-6 * KS, abs=0.3)
    assert fit.msde_m < 5e-8
    assert fit.force_range_n[0] >= 0.4 * 300 - 3


def test_a_zero_error_does_not_bias_it():
    time, force, rate = steps()
    far = fit_system_stiffness(time, travel(force, rate, zero_m=50e-6), force)
    near = fit_system_stiffness(time, travel(force, rate, zero_m=0.0), force)
    assert far.stiffness_n_per_m == pytest.approx(near.stiffness_n_per_m, rel=1e-6)


@pytest.mark.parametrize("runs", [150, *long([200])])
def test_sigma_covers_although_the_error_is_smooth(runs):
    """95 % nominal; 2.5 % of such tests would fail below 0.91 if it held only by chance."""
    rng = np.random.default_rng(3)
    time, force, rate = steps()
    clean = travel(force, rate)
    inside = known_inside = iid_inside = 0
    for _ in range(runs):
        measured = np.round((clean + smooth_draw(rng, force, 0.54e-6)) / 2e-6) * 2e-6
        noisy = np.round((force + rng.normal(0, 0.5, force.size)) / 1.5) * 1.5
        fit = fit_system_stiffness(time, measured, noisy, resolution_m=2e-6)
        error = abs(fit.stiffness_n_per_m - KS)
        inside += error < 1.96 * fit.sigma_n_per_m
        known = fit_system_stiffness(time, measured, noisy, known_error_m=0.54e-6)
        known_inside += error < 1.96 * known.sigma_n_per_m
        high = force > 120
        iid = fit.msde_m / np.sqrt(np.sum((force[high] - force[high].mean()) ** 2)) * KS**2
        iid_inside += error < 1.96 * iid
    assert inside / runs > 0.91
    assert 0.91 < known_inside / runs < 0.985
    assert iid_inside / runs < 0.5, "the test data do not tell an honest sigma from an iid one"


def test_msde_and_smooth_error_have_the_size_put_in():
    rng = np.random.default_rng(4)
    time, force, rate = steps()
    fits = [
        fit_system_stiffness(time, travel(force, rate) + smooth_draw(rng, force, 1e-6), force)
        for _ in range(60)
    ]
    assert np.sqrt(np.mean([f.smooth_error_m**2 for f in fits])) == pytest.approx(1e-6, rel=0.25)
    assert all(f.msde_m <= f.smooth_error_m for f in fits)


def test_series_contact_is_subtracted_or_bounded():
    time, force, rate = steps()
    contact = SeriesContact(k=5.0e9, n=1.5, relative_sigma=0.1)
    data = travel(force, rate, contact)
    ignored = fit_system_stiffness(time, data, force)
    known = fit_system_stiffness(time, data, force, contact=contact)
    assert ignored.stiffness_n_per_m < 0.9 * KS
    assert ignored.stiffness_upper_n_per_m > 0.99 * KS
    assert known.stiffness_n_per_m == pytest.approx(KS, rel=3e-3)
    assert known.contact_share == pytest.approx(1 - ignored.stiffness_n_per_m / KS, rel=0.05)
    assert known.sigma_n_per_m > 0.1 * known.contact_share * KS


def test_nonlinearity_is_seen():
    time, force, rate = steps()
    bent = travel(force, rate) + 0.1 / KS * (force - 210) ** 2 / 2 / 90
    straight = fit_system_stiffness(time, travel(force, rate), force)
    fit = fit_system_stiffness(time, bent, force)
    assert fit.nonlinearity == pytest.approx(0.1, rel=0.1)
    assert straight.nonlinearity < 0.01
    assert fit.sigma_n_per_m > 0.04 * KS > 5 * straight.sigma_n_per_m


@pytest.mark.long
def test_a_length_that_nobody_knows_costs_width_and_no_coverage():
    """Errors that are alike over 30 N and over 150 N; the 50 N of neither covers the second."""
    rng = np.random.default_rng(5)
    time, force, rate = steps()
    clean = travel(force, rate)
    for length in (30.0, 150.0):
        inside = 0
        for _ in range(40):
            data = clean + smooth_draw(rng, force, 0.5e-6, length)
            fit = fit_anything(time, data, force)
            inside += abs(fit.stiffness_n_per_m - KS) < 1.96 * fit.sigma_n_per_m
        assert inside >= 35, length
    told = fit_anything(time, data, force, length_n=30.0)
    assert fit.sigma_n_per_m > told.sigma_n_per_m
