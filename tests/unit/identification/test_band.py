"""Coverage of the band of a power law."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stepload.errors import DomainError
from stepload.identification.estimators import confidence_band
from stepload.identification.inverse_law import joint

FORCE = np.linspace(3.0, 300.0, 60)
K, N = 6.57e8, 1.5
FIT = joint((FORCE / K) ** (1 / N), FORCE)
COVARIANCE = np.array([[0.04, 0.0039, 0.0], [0.0039, 0.0004, 0.0], [0.0, 0.0, 1e-14]])


def test_band_covers_as_often_as_it_says():
    rng = np.random.default_rng(1)
    draws = rng.multivariate_normal([math.log(K), N, 0.0], COVARIANCE, 4000)
    deformation = np.array([10e-6, 30e-6, 59e-6])
    lower_n, upper_n = confidence_band(FIT, COVARIANCE, deformation)
    forces = np.exp(draws[:, :1] + draws[:, 1:2] * np.log(deformation))
    inside = np.mean((forces > lower_n) & (forces < upper_n), axis=0)
    assert inside == pytest.approx(np.full(3, 0.95), abs=0.012)
    with pytest.raises(DomainError):
        confidence_band(FIT, COVARIANCE, np.array([0.0, 1e-6]))
