"""Log LS, log TLS, RS-BTLS (25) and mixed LS–TLS against singular value decompositions."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload.identification.fit import Fit, Flag, FloatArray
from stepload.identification.ls import log_ls, log_tls, mixed_ls_tls, rs_btls

ALL = (log_ls, log_tls, rs_btls, mixed_ls_tls)


def noisy(seed: int, k: float, n: float, size: int = 200) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    force_n = np.linspace(5.0, 300.0, size)
    deformation_m = (force_n / k) ** (1 / n) * (1.0 + 0.01 * rng.normal(size=size))
    return deformation_m, force_n * (1.0 + 0.005 * rng.normal(size=size))


def by_svd(rows: FloatArray) -> tuple[float, float]:
    v = np.linalg.svd(rows, full_matrices=False)[2][-1]
    return float(-v[0] / v[2]), float(-v[1] / v[2])


def columns(deformation_m: FloatArray, force_n: FloatArray) -> FloatArray:
    return np.column_stack([np.ones(force_n.size), np.log(deformation_m), np.log(force_n)])


seeds = st.integers(0, 10_000)
stiffnesses = st.floats(1e6, 1e14)
exponents = st.floats(1.0, 2.5)


@given(seeds, stiffnesses, exponents)
def test_rs_btls_is_the_smallest_singular_vector(seed: int, k: float, n: float) -> None:
    x, y = noisy(seed, k, n)
    log_k, exponent = by_svd(x[:, None] * columns(x, y))
    fit = rs_btls(x, y)
    assert fit.n == pytest.approx(exponent, rel=1e-11)
    assert math.log(fit.k) == pytest.approx(log_k, rel=1e-11)


@given(seeds, stiffnesses, exponents)
def test_log_tls_is_the_unscaled_singular_vector(seed: int, k: float, n: float) -> None:
    x, y = noisy(seed, k, n)
    log_k, exponent = by_svd(columns(x, y))
    fit = log_tls(x, y)
    assert fit.n == pytest.approx(exponent, rel=1e-11)
    assert math.log(fit.k) == pytest.approx(log_k, rel=1e-11)


@given(seeds, stiffnesses, exponents)
def test_log_ls_is_a_straight_line_with_its_covariance(seed: int, k: float, n: float) -> None:
    x, y = noisy(seed, k, n)
    (exponent, log_k), covariance = np.polyfit(np.log(x), np.log(y), 1, cov=True)
    fit = log_ls(x, y)
    assert fit.n == pytest.approx(exponent, rel=1e-9)
    assert math.log(fit.k) == pytest.approx(log_k, rel=1e-9)
    assert fit.covariance is not None
    np.testing.assert_allclose(fit.covariance[:2, :2], covariance[::-1, ::-1], rtol=1e-6)
    assert not fit.covariance[2].any()


@given(seeds, stiffnesses, exponents)
def test_mixed_fit_eliminates_the_exact_column_first(seed: int, k: float, n: float) -> None:
    """QR against the exact column, then total least squares of what is left."""
    x, y = noisy(seed, k, n)
    triangle = np.linalg.qr(x[:, None] * columns(x, y))[1]
    v = np.linalg.svd(triangle[1:, 1:])[2][-1]
    exponent = -v[0] / v[1]
    log_k = (triangle[0, 2] - exponent * triangle[0, 1]) / triangle[0, 0]
    fit = mixed_ls_tls(x, y)
    assert fit.n == pytest.approx(exponent, rel=1e-11)
    assert math.log(fit.k) == pytest.approx(log_k, rel=1e-11)


@pytest.mark.parametrize("estimator", [rs_btls, log_tls])
def test_three_column_fits_minimise_what_they_say(estimator: Callable[..., Fit]) -> None:
    x, y = noisy(1, 6.57e8, 1.5)
    fit = estimator(x, y)
    weights = x**2 if estimator is rs_btls else np.ones(x.size)

    def cost(log_k: float, n: float) -> float:
        residual = np.log(y) - log_k - n * np.log(x)
        return float(weights @ residual**2) / (1.0 + log_k**2 + n**2)

    least = cost(math.log(fit.k), fit.n)
    for step_k in (-1e-3, 0.0, 1e-3):
        for step_n in (-1e-4, 0.0, 1e-4):
            assert cost(math.log(fit.k) + step_k, fit.n + step_n) >= least


@given(seeds, st.sampled_from([1e-3, 1e3, 1e6]))
def test_units_matter_only_where_documented(seed: int, unit: float) -> None:
    x, y = noisy(seed, 6.57e8, 1.5)
    for estimator in (log_ls, mixed_ls_tls):
        assert estimator(x * unit, y).n == pytest.approx(estimator(x, y).n, rel=1e-9)
    assert rs_btls(x * unit, y).n != pytest.approx(rs_btls(x, y).n, rel=1e-9)


@given(stiffnesses, exponents)
def test_exact_data_give_the_exact_law(k: float, n: float) -> None:
    force_n = np.linspace(1.0, 300.0, 50)
    deformation_m = (force_n / k) ** (1 / n)
    for estimator in ALL:
        fit = estimator(deformation_m, force_n, secant_force_n=100.0)
        assert fit.n == pytest.approx(n, rel=1e-7)
        assert fit.secant_n_per_m == pytest.approx(100.0 / (100.0 / k) ** (1 / n), rel=1e-7)
        assert fit.force_rms_n < 1e-4
        assert fit.doubts == ()


def test_the_force_residual_is_that_of_the_data_as_they_were_fitted() -> None:
    x, y = noisy(5, 6.57e8, 1.5)
    fit = rs_btls(x, y)
    expected = np.sqrt(np.mean((fit.k * x**fit.n - y) ** 2))
    x *= 2.0
    y[:] = 0.0
    assert fit.force_rms_n == pytest.approx(expected)
    assert fit.force_rms_n == pytest.approx(expected), "asked for twice"


def test_points_without_logarithm_are_left_out_and_flagged() -> None:
    x, y = noisy(2, 6.57e8, 1.5)
    bad_x, bad_y = np.append(x, [-1e-6, 0.0, 1e-6]), np.append(y, [1.0, 2.0, -1.0])
    fit = rs_btls(bad_x, bad_y)
    assert fit.n == rs_btls(x, y).n
    assert fit.points == x.size
    assert [doubt.flag for doubt in fit.doubts] == [Flag.NOT_POSITIVE]
    assert "1.5 % of 203 points" in fit.doubts[0].message


def test_a_middle_full_of_free_air_is_left_out() -> None:
    x, y = noisy(2, 6.57e8, 1.5)
    air_x, air_y = np.insert(x, 100, np.full(300, -1e-6)), np.insert(y, 100, np.zeros(300))
    assert rs_btls(air_x, air_y).n == pytest.approx(rs_btls(x, y).n, rel=1e-12)


def test_falling_data_are_flagged_not_raised() -> None:
    x = np.linspace(1e-5, 1e-4, 50)
    fit = log_ls(x, 1e-3 / x)
    assert fit.n == pytest.approx(-1.0)
    assert Flag.ILL_CONDITIONED in [doubt.flag for doubt in fit.doubts]
