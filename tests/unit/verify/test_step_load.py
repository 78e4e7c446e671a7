"""The simulated experiment has the errors it says, and no others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stepload_verify.paper.step_load import STVF, Errors, press, smooth_error

K = 6.57e8
IDEAL = replace(
    STVF,
    rate_hz=100.0,
    damping_n_s_per_m=0.0,
    position_resolution_m=0.0,
    force_resolution_n=0.0,
    force_noise_n=0.0,
)


def law(force_n):
    return (force_n / K) ** (2 / 3)


def test_an_ideal_rig_gives_the_law_back():
    run = press(law, IDEAL, Errors(touch_force_n=None), np.random.default_rng(0))
    assert run.deformation_m() == pytest.approx(law(run.loaded_n()), abs=1e-12)
    assert run.force_n.max() == pytest.approx(300.0)


def test_a_touch_threshold_finds_the_zero_late():
    run = press(law, IDEAL, Errors(), np.random.default_rng(0))
    at_touch = run.loaded_n()[0]
    assert at_touch >= 3.0
    late = law(run.loaded_n()[-1]) - run.deformation_m()[-1]
    assert late == pytest.approx(law(at_touch) + at_touch / STVF.stiffness_n_per_m, rel=1e-6)


def test_smooth_error_has_its_size_and_length():
    rng = np.random.default_rng(3)
    errors = Errors(smooth_m=1e-6)
    force = np.array([100.0, 150.0, 300.0])
    draws = np.array([smooth_error(force, errors, rng) for _ in range(3000)])
    assert draws.std(axis=0) == pytest.approx(np.full(3, 1e-6), rel=0.05)
    assert np.corrcoef(draws.T)[0, 1] == pytest.approx(0.607, abs=0.05)
