"""Comparisons against known variance components, known shifts and scipy."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.stats

from stepload.contact.elastic import equivalent_modulus
from stepload.contact.materials import Material
from stepload.errors import DomainError
from stepload.estimators.compare import (
    at_other_modulus,
    compare_curve,
    compare_fits,
    confidence_band,
    spread,
)
from stepload.estimators.fit import Fit
from stepload.estimators.inverse_law import joint

FORCE = np.linspace(3.0, 300.0, 60)
K, N = 6.57e8, 1.5
FIT = joint((FORCE / K) ** (1 / N), FORCE)
COVARIANCE = np.array([[0.04, 0.0039, 0.0], [0.0039, 0.0004, 0.0], [0.0, 0.0, 1e-14]])

ACETAL = Material("acetal", 2.75e9, 0.3, 70e6)
ALUMINIUM = Material("aluminium", 70e9, 0.33, 276e6)
STEEL = Material("steel", 200e9, 0.29)


def test_spread_finds_the_components_put_in():
    rng = np.random.default_rng(0)
    runs = [rng.normal(5e6 + rng.normal(0, 2e5), 1e5, 8) for _ in range(60)]
    found = spread(runs)
    assert found.within_sd == pytest.approx(1e5, rel=0.1)
    assert found.between_sd == pytest.approx(2e5, rel=0.25)
    assert found.p_value < 1e-6


def test_spread_agrees_with_scipy():
    runs = [np.array([1.0, 2.0, 4.0]), np.array([2.0, 3.5]), np.array([5.0, 4.0, 4.5, 6.0])]
    assert spread(runs).p_value == pytest.approx(scipy.stats.f_oneway(*runs).pvalue)


def test_runs_alike_have_no_spread_between_them():
    found = spread([np.array([1.0, 3.0]), np.array([3.0, 1.0])])
    assert found.between_sd == 0.0
    assert found.p_value == pytest.approx(1.0)


def test_spread_says_what_it_cannot_know():
    single = spread([np.array([1.0, 2.0])])
    assert (single.between_sd, single.p_value) == (None, None)
    ones = spread([np.array([1.0]), np.array([2.0])])
    assert ones.within_sd is None
    assert ones.between_sd == pytest.approx(math.sqrt(0.5))
    with pytest.raises(DomainError):
        spread([np.array([])])


def table_one(k, n, secant, estimator="rs_btls"):
    return Fit(estimator, k, n, 0.0, secant, 300.0, None, 0.0, 100)


def test_table_one_plastic_sphere():
    pair = compare_fits(table_one(2.36e9, 1.64, 4.80e6), table_one(3.92e9, 1.70, 4.67e6))
    assert pair.secant_change == pytest.approx(-0.0275, abs=5e-4)
    assert pair.n_change == pytest.approx(0.06)
    assert pair.normalised_error is None


def test_normalised_error_is_the_difference_over_its_half_width():
    first, second = table_one(1e9, 1.5, 4.8e6), table_one(1e9, 1.5, 5.0e6)
    pair = compare_fits(first, second, half_width=0.02)
    assert pair.normalised_error == pytest.approx(math.log(5.0 / 4.8) / 0.02)
    assert compare_fits(second, first, half_width=0.02).normalised_error == pytest.approx(
        pair.normalised_error
    )
    with pytest.raises(DomainError, match="positive"):
        compare_fits(first, second, half_width=0.0)


def test_unlike_fits_are_not_compared():
    with pytest.raises(DomainError, match="like with like"):
        compare_fits(table_one(1e9, 1.5, 5e6), table_one(1e9, 1.5, 5e6, "joint"))


def test_band_covers_as_often_as_it_says():
    rng = np.random.default_rng(1)
    draws = rng.multivariate_normal([math.log(K), N, 0.0], COVARIANCE, 4000)
    deformation = np.array([10e-6, 30e-6, 59e-6])
    band = confidence_band(FIT, COVARIANCE, deformation)
    forces = np.exp(draws[:, :1] + draws[:, 1:2] * np.log(deformation))
    inside = np.mean((forces > band.lower_n) & (forces < band.upper_n), axis=0)
    assert inside == pytest.approx(np.full(3, 0.95), abs=0.012)
    with pytest.raises(DomainError):
        confidence_band(FIT, COVARIANCE, np.array([0.0, 1e-6]))


def test_modulus_correction_is_the_ratio_of_stiffnesses():
    steel = equivalent_modulus(ACETAL, STEEL)
    aluminium = equivalent_modulus(ACETAL, ALUMINIUM)
    moved = at_other_modulus(FORCE, from_modulus_pa=steel, to_modulus_pa=aluminium)
    assert moved / FORCE == pytest.approx(np.full(60, aluminium / steel))
    assert aluminium / steel - 1 == pytest.approx(-0.024, abs=5e-4)
    metal = equivalent_modulus(ALUMINIUM, ALUMINIUM) / equivalent_modulus(ALUMINIUM, STEEL)
    assert metal - 1 == pytest.approx(-0.32, abs=0.001)
    with pytest.raises(DomainError):
        at_other_modulus(FORCE, from_modulus_pa=0.0, to_modulus_pa=1.0)


def test_a_curve_of_another_counter_body_fits_after_correction():
    curve = (FORCE / (1.5 * K)) ** (1 / N)
    moved = at_other_modulus(FORCE, from_modulus_pa=1.5e9, to_modulus_pa=1e9)
    corrected = compare_curve(FIT, COVARIANCE / 100, curve, moved)
    raw = compare_curve(FIT, COVARIANCE / 100, curve, FORCE)
    assert corrected.inside_share == 1.0
    assert corrected.force_rms_n == pytest.approx(0.0, abs=1e-6)
    assert corrected.to_n == pytest.approx(200.0), "where the corrected curve ends"
    assert corrected.secant_change == pytest.approx(0.0, abs=1e-9)
    assert corrected.chord_change == pytest.approx(0.0, abs=1e-9)
    assert raw.to_n == 300.0
    assert raw.secant_change == pytest.approx(1.5 ** (1 / N) - 1, rel=1e-3)
    assert raw.inside_share == 0.0
    assert raw.deformation_rms_m > 1e-6


def test_a_corrected_curve_keeps_its_secant_where_it_ends():
    """V-A's own case: steel to aluminium takes 2.4 % off every force, and 300 N end at 293 N."""
    steel = equivalent_modulus(ACETAL, STEEL) / equivalent_modulus(ACETAL, ALUMINIUM)
    curve = (FORCE / (K * steel)) ** (1 / N)
    moved = at_other_modulus(FORCE, from_modulus_pa=steel * 1e9, to_modulus_pa=1e9)
    found = compare_curve(FIT, COVARIANCE, curve, moved)
    assert found.to_n == pytest.approx(300.0 / steel)
    assert found.from_n == pytest.approx(30.0 / steel)
    assert found.secant_change == pytest.approx(0.0, abs=1e-6)
    stiffer = compare_curve(FIT, COVARIANCE, curve * 1.1, moved)
    assert stiffer.secant_change == pytest.approx(1 / 1.1 - 1, rel=1e-6)
    assert stiffer.chord_change == pytest.approx(1 / 1.1 - 1, rel=1e-6)


def test_a_curve_is_compared_at_forces_that_both_have_reached():
    long = np.linspace(3.0, 600.0, 120)
    curve = (long / K) ** (1 / N)
    bent = np.where(long > 310.0, 2.0 * curve, curve)
    found = compare_curve(FIT, COVARIANCE, bent, long, reached_n=300.0)
    assert found.inside_share == 1.0
    assert found.force_rms_n == pytest.approx(0.0, abs=1e-6)
    assert found.curve_n.max() <= 306.0
    assert found.left_out == np.count_nonzero(long > 306.0)
    assert found.to_n == 300.0
    beyond = compare_curve(FIT, COVARIANCE, bent, long)
    assert beyond.inside_share < 1.0
    high = long > 350.0
    with pytest.raises(DomainError, match="usable"):
        compare_curve(FIT, COVARIANCE, bent[high], long[high], reached_n=300.0)
    above = compare_curve(FIT, COVARIANCE, bent[high], long[high])
    assert (above.secant_change, above.chord_change) == (None, None)
    short = long > 100.0
    part = compare_curve(FIT, COVARIANCE, curve[short], long[short])
    assert part.chord_change is None, "the curve begins above 30 N"
    assert part.secant_change == pytest.approx(0.0, abs=1e-6)


def test_a_chord_needs_no_zero():
    shifted = compare_curve(FIT, COVARIANCE, (FORCE / K) ** (1 / N) + 5e-6, FORCE)
    assert shifted.secant_change == pytest.approx(-0.0777, abs=1e-3)
    assert shifted.chord_change == pytest.approx(0.0, abs=2e-3)


def test_noise_of_a_curve_averages_out():
    rng = np.random.default_rng(2)
    dense = np.linspace(3.0, 300.0, 3000)
    noisy = (dense / K) ** (1 / N) + 1e-6 * rng.standard_normal(3000)
    found = compare_curve(FIT, COVARIANCE, noisy, dense)
    assert found.secant_change == pytest.approx(0.0, abs=5e-3)
    assert found.chord_change == pytest.approx(0.0, abs=5e-3)
    few = compare_curve(FIT, COVARIANCE, (FORCE[::6] / K) ** (1 / N), FORCE[::6])
    assert few.secant_change == pytest.approx(0.0, abs=1e-6)


def test_curves_that_cannot_be_used_are_refused():
    curve = (FORCE / K) ** (1 / N)
    with pytest.raises(DomainError, match="usable"):
        compare_curve(FIT, COVARIANCE, -curve, FORCE)
    with pytest.raises(DomainError, match="forces"):
        compare_curve(FIT, COVARIANCE, curve[1:], FORCE)
