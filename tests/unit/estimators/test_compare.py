"""Comparisons against known variance components, known shifts and scipy."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.stats

from stepload.errors import DomainError
from stepload.estimators.compare import compare_fits, confidence_band, spread
from stepload.estimators.fit import Fit
from stepload.estimators.inverse_law import joint

FORCE = np.linspace(3.0, 300.0, 60)
K, N = 6.57e8, 1.5
FIT = joint((FORCE / K) ** (1 / N), FORCE)
COVARIANCE = np.array([[0.04, 0.0039, 0.0], [0.0039, 0.0004, 0.0], [0.0, 0.0, 1e-14]])


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
    assert pair.secant_change == pytest.approx(4.67 / 4.80 - 1.0)
    assert pair.n_change == pytest.approx(0.06)


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
