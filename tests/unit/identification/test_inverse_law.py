"""Inverse-law least squares and the joint fits against scipy and closed forms."""

import contextlib
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from stepload.errors import DomainError
from stepload.identification.fit import FloatArray
from stepload.identification.inverse_law import inverse_ls, joint

quick = settings(max_examples=25, deadline=None)
seeds = st.integers(0, 10_000)


def noisy(
    seed: int, k: float = 6.57e8, n: float = 1.5, zero_m: float = 2e-6, size: int = 400
) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    force_n = np.linspace(2.0, 300.0, size)
    deformation_m = zero_m + (force_n / k) ** (1 / n)
    return deformation_m + rng.normal(0.0, 0.3e-6, size), force_n


def by_scipy(
    x: FloatArray, y: FloatArray, *, free_zero: bool = True
) -> tuple[FloatArray, FloatArray]:
    """(ln K, n, δ0) and JᵀJ's inverse of residuals in µm, by Levenberg–Marquardt."""

    def residual(q: FloatArray) -> FloatArray:
        zero_um = q[2] if free_zero else 0.0
        r = x * 1e6 - zero_um - 1e6 * np.exp((np.log(y) - q[0]) / q[1])
        return r

    start = [20.0, 1.4, 0.5] if free_zero else [20.0, 1.4]
    found = least_squares(
        residual, start, method="trf", x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    theta = np.append(found.x, [0.0] * (3 - found.x.size))
    theta[2] *= 1e-6
    return theta, np.linalg.inv(found.jac.T @ found.jac)


@quick
@given(seeds, st.floats(1.2, 2.2), st.floats(-4e-6, 4e-6))
def test_joint_equals_scipy(seed: int, n: float, zero_m: float) -> None:
    x, y = noisy(seed, k=5e6**n, n=n, zero_m=zero_m)
    (log_k, exponent, zero), _ = by_scipy(x, y)
    fit = joint(x, y)
    assert fit.doubts == ()
    assert fit.n == pytest.approx(exponent, rel=1e-6)
    assert math.log(fit.k) == pytest.approx(log_k, rel=1e-6)
    assert fit.zero_m == pytest.approx(zero, rel=1e-6, abs=1e-12)


@quick
@given(seeds)
def test_inverse_ls_equals_scipy(seed: int) -> None:
    x, y = noisy(seed, zero_m=0.0)
    (log_k, exponent, _), _ = by_scipy(x, y, free_zero=False)
    fit = inverse_ls(x, y)
    assert fit.n == pytest.approx(exponent, rel=1e-7)
    assert math.log(fit.k) == pytest.approx(log_k, rel=1e-7)
    assert fit.zero_m == 0.0


def test_covariances_are_those_of_the_jacobian() -> None:
    x, y = noisy(3)
    _, inverse = by_scipy(x, y)
    fit = joint(x, y, sigma_m=0.3e-6)
    assert fit.covariance is not None
    in_um = np.diag([1.0, 1.0, 1e6])
    np.testing.assert_allclose(in_um @ fit.covariance @ in_um, inverse * 0.3**2, rtol=1e-3)

    x, y = noisy(3, zero_m=0.0)
    _, inverse = by_scipy(x, y, free_zero=False)
    fixed = inverse_ls(x, y, sigma_m=0.3e-6)
    assert fixed.covariance is not None
    np.testing.assert_allclose(fixed.covariance[:2, :2], inverse * 0.3**2, rtol=1e-3)
    assert not fixed.covariance[2].any()


@pytest.mark.long
def test_covariance_covers_white_noise() -> None:
    """The scatter of n over repeated runs is what the covariance says."""
    fits = [joint(*noisy(seed)) for seed in range(150)]
    stated = [math.sqrt(f.covariance[1, 1]) for f in fits if f.covariance is not None]
    assert np.std([f.n for f in fits]) == pytest.approx(np.mean(stated), rel=0.2)


@quick
@given(seeds, st.sampled_from([1e-3, 1e3, 1e6]), st.floats(-1e-3, 1e-3))
def test_units_and_origin_of_the_deformation_do_not_matter(
    seed: int, unit: float, shift_m: float
) -> None:
    x, y = noisy(seed)
    one, other = joint(x, y), joint((x + shift_m) * unit, y)
    assert other.n == pytest.approx(one.n, rel=1e-7)
    assert other.zero_m / unit - shift_m == pytest.approx(one.zero_m, abs=1e-11)
    assert other.secant_n_per_m * unit == pytest.approx(one.secant_n_per_m, rel=1e-7)


@pytest.mark.parametrize("size", [5, 400, 16384, 40_000])
def test_exact_data_give_the_exact_law(size: int) -> None:
    force_n = np.linspace(1.0, 300.0, size)
    fit = joint(-3e-6 + (force_n / 8.87e9) ** (1 / 1.5), force_n)
    assert fit.n == pytest.approx(1.5, rel=1e-8)
    assert fit.k == pytest.approx(8.87e9, rel=1e-6)
    assert fit.zero_m == pytest.approx(-3e-6, rel=1e-7)
    assert fit.points == size


def test_pure_noise_is_never_a_confident_fit() -> None:
    force_n = np.linspace(1.0, 300.0, 50)
    fits = []
    for seed in range(30):
        deformation_m = np.random.default_rng(seed).normal(0.0, 1e-6, 50)
        with contextlib.suppress(DomainError):
            fits.append(joint(deformation_m, force_n))
    assert fits
    for fit in fits:
        assert fit.doubts or (fit.covariance is not None and fit.covariance[1, 1] > 0.05**2)
