"""What a tare tells, against the statistics of a mean and of a line."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from stepload.record.outcome import Tare

TARE = Tare(
    time_s=0.0,
    duration_s=2.0,
    samples=400,
    mean_n=1.0,
    noise_n=0.2,
    slope_n_per_s=0.1,
    second_mean_n=2.0,
    second_noise_n=0.4,
)


def test_means_are_as_sure_as_their_samples_make_them() -> None:
    assert TARE.mean_error_n == pytest.approx(0.01)
    assert TARE.second_mean_error_n == pytest.approx(0.02)


def test_sure_noise_is_a_lower_bound() -> None:
    assert TARE.sure_noise_n == pytest.approx(0.2 * (1.0 - 3.0 / math.sqrt(800.0)))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_drift_is_sure_beyond_three_errors_of_a_slope(sign: float) -> None:
    time_s = np.linspace(0.0, 2.0, 400)
    error = 0.2 / math.sqrt(np.sum((time_s - time_s.mean()) ** 2))
    sure = replace(TARE, slope_n_per_s=sign * 0.1).sure_slope_n_per_s
    assert sure == pytest.approx(0.1 - 3.0 * error, rel=0.02)
    largest = replace(TARE, slope_n_per_s=sign * 0.1).largest_slope_n_per_s
    assert largest == pytest.approx(0.1 + 3.0 * error, rel=0.02)
    assert replace(TARE, slope_n_per_s=sign * 2.9 * error).sure_slope_n_per_s == 0.0
