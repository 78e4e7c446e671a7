"""Pooled K_s runs: what adds up, and what only seems to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stepload.identification.pooled_stiffness import pool
from stepload.identification.system_stiffness import (
    SeriesContact,
    SystemStiffnessFit,
    fit_system_stiffness,
)
from stepload_verify.paper.step_load import SCENARIO_C, StepRig, press

FINE = StepRig(
    position_resolution_m=0.1e-6, force_resolution_n=0.1, force_noise_n=0.05, rate_hz=100.0
)
ERRORS = replace(SCENARIO_C, touch_force_n=None)


def run(seed: int, contact: SeriesContact | None = None) -> SystemStiffnessFit:
    data = press(np.zeros_like, FINE, ERRORS, np.random.default_rng(seed))
    return fit_system_stiffness(
        data.time_s, data.travel_m, data.force_n, contact=contact,
        resolution_m=FINE.position_resolution_m, length_n=ERRORS.length_n,
    )  # fmt: skip


@pytest.fixture(scope="module")
def runs() -> list[SystemStiffnessFit]:
    return [run(seed) for seed in range(60)]


def test_runs_with_errors_of_their_own_add_up(runs: list[SystemStiffnessFit]) -> None:
    groups = [pool(runs[i : i + 4]) for i in range(0, 60, 4)]
    assert np.median([g.sigma_n_per_m for g in groups]) < 0.6 * np.median(
        [r.sigma_n_per_m for r in runs]
    )
    assert np.mean([g.smooth_degrees for g in groups]) > 3.0 * np.mean(
        [r.smooth_degrees for r in runs]
    )
    true = FINE.stiffness_n_per_m
    inside = sum(abs(g.stiffness_n_per_m - true) < 1.96 * g.sigma_n_per_m for g in groups)
    assert inside >= 12, "binomial: below 12 of 15 at 95 % once in 180 times"


def test_one_error_repeated_tells_nothing_new(runs: list[SystemStiffnessFit]) -> None:
    one = runs[1]
    pooled = pool([one] * 5)
    assert pooled.misfit_correlation == pytest.approx(1.0)
    assert pooled.independent_runs == pytest.approx(1.0)
    assert pooled.sigma_n_per_m == pytest.approx(one.sigma_n_per_m)
    assert pooled.smooth_degrees == pytest.approx(one.smooth_degrees)


def test_runs_that_scatter_too_much_widen_the_result(runs: list[SystemStiffnessFit]) -> None:
    stiffness = FINE.stiffness_n_per_m
    near = [replace(r, stiffness_n_per_m=stiffness) for r in runs[:3]]
    far = [
        replace(r, stiffness_n_per_m=stiffness * (1.0 + off))
        for r, off in zip(runs[:3], (-0.2, 0.0, 0.2), strict=True)
    ]
    assert pool(near).scatter == pytest.approx(0.0, abs=1e-9)
    assert pool(far).scatter > 2.0
    ratio = pool(far).sigma_n_per_m / pool(near).sigma_n_per_m
    assert ratio == pytest.approx(pool(far).scatter)


def test_the_contact_is_common_to_all_runs() -> None:
    contact = SeriesContact(k=5.0e10, n=1.5, relative_sigma=3.0)
    fits = [run(seed, contact) for seed in range(8)]
    assert all(fit.contact_sigma_n_per_m > 0.0 for fit in fits)
    assert pool(fits).sigma_n_per_m > max(fit.contact_sigma_n_per_m for fit in fits)
