"""The smooth error scaled up from the residuals that a joint fit leaves of it."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.identification.inverse_law import joint
from stepload.identification.smooth import smooth_leftover

K, N = 6.57e8, 1.5
FORCE = np.linspace(3.0, 300.0, 300)
LAW = (FORCE / K) ** (1 / N)
GRID = np.linspace(0.0, 300.0, 61)
ROOT = np.linalg.cholesky(
    np.exp(-0.5 * (np.subtract.outer(GRID, GRID) / 50.0) ** 2) + 1e-9 * np.eye(61)
)


def test_it_has_the_size_put_in_although_most_is_absorbed() -> None:
    rng = np.random.default_rng(1)
    found, residual = [], []
    for _ in range(150):
        data = LAW + np.interp(FORCE, GRID, 1e-6 * ROOT @ rng.standard_normal(61))
        fit = joint(data, FORCE)
        leftover = smooth_leftover(fit, data, FORCE, length_n=50.0)
        assert leftover is not None
        found.append(leftover.smooth_error_m)
        residual.append(np.mean((data - fit.zero_m - (FORCE / fit.k) ** (1 / fit.n)) ** 2))
        assert 1.5 < leftover.degrees < 4.0
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(1e-6, rel=0.2)
    assert np.sqrt(np.mean(residual)) < 0.75e-6, "the data do not tell it from the plain residual"


def test_white_noise_is_not_taken_for_it() -> None:
    rng = np.random.default_rng(2)
    data = LAW + rng.normal(0.0, 1e-6, FORCE.size)
    fit = joint(data, FORCE)
    plain, told = smooth_leftover(fit, data, FORCE), smooth_leftover(
        fit, data, FORCE, white_sd_m=1e-6
    )  # fmt: skip
    assert plain is not None
    assert told is not None
    assert told.smooth_error_m < 0.7 * plain.smooth_error_m
