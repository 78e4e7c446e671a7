"""Element-wise weighted TLS (24) against brute force, the full problem (18) against odrpack."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from long_ones import long
from odrpack import odr_fit
from scipy.optimize import minimize

from stepload.identification.fit import Fit, Flag, FloatArray
from stepload.identification.weighted import ew_tls, odr

SIGMA_M, SIGMA_N = 0.6e-6, 0.5
quick = settings(max_examples=15, deadline=None)
seeds = st.integers(0, 10_000)


def noisy(seed: int, k: float = 6.57e8, size: int = 150) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    force_n = np.linspace(8.0, 300.0, size)
    deformation_m = (force_n / k) ** (1 / 1.5)
    return (
        deformation_m + rng.normal(0.0, SIGMA_M, size),
        force_n + rng.normal(0.0, SIGMA_N, size),
    )


@quick
@given(seeds)
def test_ew_tls_minimises_its_cost(seed: int) -> None:
    x, y = noisy(seed)
    vx, vy = (SIGMA_M / x) ** 2, (SIGMA_N / y) ** 2

    def cost(q: FloatArray) -> float:
        return float(np.sum((np.log(y) - q[0] - q[1] * np.log(x)) ** 2 / (vy + q[1] ** 2 * vx)))

    fit = ew_tls(x, y, sigma_m=SIGMA_M, sigma_n=SIGMA_N)
    found = minimize(
        cost, [20.0, 1.45], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12}
    )
    assert fit.n == pytest.approx(found.x[1], rel=1e-6)
    assert math.log(fit.k) == pytest.approx(found.x[0], rel=1e-6)
    assert cost(np.array([math.log(fit.k), fit.n])) <= found.fun + 1e-9


@quick
@given(seeds)
def test_odr_equals_odrpack(seed: int) -> None:
    x, y = noisy(seed)
    fit = odr(x, y, sigma_m=SIGMA_M, sigma_n=SIGMA_N)
    found = odr_fit(
        lambda um, beta: np.exp(beta[0]) * np.abs(um) ** beta[1],
        x * 1e6,
        y,
        np.array([-0.5, 1.45]),
        weight_x=1.0 / (SIGMA_M * 1e6) ** 2,
        weight_y=1.0 / SIGMA_N**2,
        partol=1e-14,
        sstol=1e-15,
    )
    assert fit.n == pytest.approx(found.beta[1], rel=1e-6)
    log_k = found.beta[0] + found.beta[1] * math.log(1e6)
    assert math.log(fit.k) == pytest.approx(log_k, rel=1e-6)
    assert fit.doubts == ()


def test_odr_distance_is_the_least_distance() -> None:
    """Brute force over landing points on a fine grid gives no better law nearby."""
    x, y = noisy(7, size=40)
    fit = odr(x, y, sigma_m=SIGMA_M, sigma_n=SIGMA_N)
    grid = np.linspace(-8.0, 8.0, 4001) * SIGMA_M

    def cost(log_k: float, n: float) -> float:
        landing = x[:, None] + grid
        law = np.exp(log_k + n * np.log(np.maximum(landing, 1e-9)))
        return float(np.min((grid / SIGMA_M) ** 2 + ((y[:, None] - law) / SIGMA_N) ** 2, 1).sum())

    least = cost(math.log(fit.k), fit.n)
    for step_k, step_n in ((0.02, 0.0), (-0.02, 0.0), (0.0, 2e-3), (0.0, -2e-3), (0.1, 0.01)):
        assert cost(math.log(fit.k) + step_k, fit.n + step_n) > least


@pytest.mark.parametrize("estimator", [ew_tls, *long([odr])])
def test_covariance_is_the_scatter(estimator: Callable[..., Fit]) -> None:
    fits = [estimator(*noisy(s), sigma_m=SIGMA_M, sigma_n=SIGMA_N) for s in range(120)]
    stated = [math.sqrt(f.covariance[1, 1]) for f in fits if f.covariance is not None]
    assert np.std([f.n for f in fits]) == pytest.approx(np.mean(stated), rel=0.25)


@pytest.mark.parametrize("estimator", [ew_tls, odr])
def test_units_and_order_do_not_matter(estimator: Callable[..., Fit]) -> None:
    x, y = noisy(8)
    one = estimator(x, y, sigma_m=SIGMA_M, sigma_n=SIGMA_N)
    in_um = estimator(x * 1e6, y, sigma_m=SIGMA_M * 1e6, sigma_n=SIGMA_N)
    assert in_um.n == pytest.approx(one.n, rel=1e-7)
    assert one.covariance is not None
    assert in_um.covariance is not None
    assert in_um.covariance[1, 1] == pytest.approx(one.covariance[1, 1], rel=1e-5)
    back = estimator(x[::-1], y[::-1], sigma_m=SIGMA_M, sigma_n=SIGMA_N)
    assert back.n == pytest.approx(one.n, rel=1e-8)


def test_odr_survives_points_that_are_mostly_noise() -> None:
    """Aluminium in 2 µm data: half the points lie within noise of zero."""
    rng = np.random.default_rng(9)
    force_n = np.linspace(1.0, 300.0, 400)
    deformation_m = np.abs((force_n / 8.87e9) ** (1 / 1.5) + rng.normal(0.0, 1e-6, 400)) + 1e-10
    fit = odr(deformation_m, force_n, sigma_m=1e-6, sigma_n=SIGMA_N)
    assert 1.0 < fit.n < 2.2
    assert fit.doubts == ()


@pytest.mark.parametrize("estimator", [ew_tls, odr])
def test_falling_data_are_flagged(estimator: Callable[..., Fit]) -> None:
    x = np.linspace(1e-5, 1e-4, 50)
    fit = estimator(x, 1e-3 / x, sigma_m=1e-9, sigma_n=1e-3)
    assert {Flag.NOT_CONVERGED, Flag.ILL_CONDITIONED} & {doubt.flag for doubt in fit.doubts}
