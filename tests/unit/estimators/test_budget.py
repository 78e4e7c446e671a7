"""The budget: sensitivities against refits, and coverage by simulation."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from long_ones import long
from scipy.stats import binom

from stepload.errors import DomainError
from stepload.estimators.budget import budget, secant_gradient
from stepload.estimators.fit_all import recursive_as_batch, recursive_fit
from stepload.estimators.inverse_law import inverse_ls, joint
from stepload.estimators.ls import rs_btls
from stepload.estimators.odr import odr
from stepload.estimators.selection import select
from stepload.estimators.sensitivity import (
    joint_sensitivity,
    numeric_sensitivity,
    zero_given_sensitivity,
)
from stepload.estimators.sources import Sources
from stepload_verify.paper.step_load import SCENARIO_C, STVF, press

K, N = 6.57e8, 1.5
FORCE = np.linspace(3.0, 300.0, 150)
DEFORMATION = (FORCE / K) ** (1 / N) + 1e-6
FIT = joint(DEFORMATION, FORCE)
STIFFNESS = 3.49e6
NOTHING = Sources(STIFFNESS)


def theta(fit):
    return np.array([np.log(fit.k), fit.n, fit.zero_m])


def line(result, name):
    (found,) = [x for x in result.lines if x.source.startswith(name)]
    return found


def moved_by(error_m, force=FORCE, estimator=joint):
    """First-order effect of a curve of deformation error: a refit with a thousandth of it."""
    up = estimator(DEFORMATION + 1e-3 * error_m, force)
    down = estimator(DEFORMATION - 1e-3 * error_m, force)
    return (theta(up) - theta(down)) / 2e-3


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_joint_sensitivity_is_the_derivative_of_the_fit(seed):
    error = 1e-7 * np.random.default_rng(seed).standard_normal(FORCE.size)
    sensitivity = joint_sensitivity(FIT, FORCE)
    assert np.allclose(sensitivity @ error, moved_by(error), rtol=1e-4, atol=1e-10)


def test_numeric_sensitivity_agrees_with_the_analytic_one():
    analytic = joint_sensitivity(FIT, FORCE)
    numeric = numeric_sensitivity(joint, DEFORMATION, FORCE, step_m=1e-9)
    for error in (np.ones(FORCE.size), FORCE, np.sin(FORCE / 40)):
        assert np.allclose(numeric @ error, analytic @ error, rtol=0.02, atol=1e-3)


def test_every_line_is_what_a_refit_says():
    sources = replace(
        NOTHING,
        system_stiffness_sigma_n_per_m=0.01 * STIFFNESS,
        lag_sigma_s=0.01,
        force_rate_n_per_s=50.0,
        gain_sigma=0.005,
        temperature_sigma_k=2.0,
        position_m_per_k=0.2e-6,
        modulus_per_k=0.004,
    )
    result = budget(FIT, DEFORMATION, FORCE, sources)
    compliance = 1 / STIFFNESS + DEFORMATION**0 * (FORCE / K) ** (1 / N) / (N * FORCE)
    for name, effect in (
        ("system", moved_by(0.01 * FORCE / STIFFNESS)),
        ("alignment", moved_by(0.01 * 50.0 * compliance)),
    ):
        found = line(result, name)
        assert [found.ln_k, found.n, found.zero_m] == pytest.approx(np.abs(effect), rel=1e-3)
        assert found.secant_relative == pytest.approx(abs(secant_gradient(FIT) @ effect), rel=1e-3)
    scaled = theta(joint(DEFORMATION, FORCE * 1.005)) - theta(FIT)
    assert line(result, "force cal").ln_k == pytest.approx(scaled[0], rel=0.01)
    assert line(result, "force cal").n == pytest.approx(0.0, abs=1e-9)
    drift = moved_by(0.4e-6 * np.linspace(0, 1, FORCE.size))
    expected = np.hypot(drift[0], 0.008)
    assert line(result, "temperature").ln_k == pytest.approx(expected, rel=1e-3)


def test_lines_add_up_to_the_covariance():
    sources = Sources(
        STIFFNESS,
        0.02 * STIFFNESS,
        0.54e-6,
        force_noise_n=0.5,
        force_resolution_n=1.5,
        position_noise_m=1e-7,
        position_resolution_m=2e-6,
        lag_sigma_s=0.002,
        force_rate_n_per_s=np.full(FORCE.size, 50.0),
        gain_sigma=0.01,
    )
    result = budget(FIT, DEFORMATION, FORCE, sources)
    assert np.hypot.reduce([x.n for x in result.lines]) == pytest.approx(result.sigma_n)
    assert np.hypot.reduce([x.secant_relative for x in result.lines]) == pytest.approx(
        result.sigma_secant_relative
    )
    low, high = result.interval_n
    assert high - low == pytest.approx(2 * 1.96 * result.sigma_n, rel=1e-4)
    assert result.interval_k[0] * result.interval_k[1] == pytest.approx(FIT.k**2)


def test_white_noise_line_equals_a_monte_carlo():
    rng = np.random.default_rng(5)
    sources = replace(NOTHING, position_noise_m=0.3e-6)
    result = budget(FIT, DEFORMATION, FORCE, sources)
    fits = [
        theta(joint(DEFORMATION + rng.normal(0, 0.3e-6, FORCE.size), FORCE)) for _ in range(200)
    ]
    assert np.std([f[1] for f in fits]) == pytest.approx(result.sigma_n, rel=0.12)


def test_quantum_errors_do_not_average_out_with_more_points():
    sources = replace(NOTHING, position_resolution_m=2e-6)
    dense = np.linspace(3.0, 300.0, 3000)
    few = budget(FIT, DEFORMATION, FORCE, sources)
    many = budget(FIT, (dense / K) ** (1 / N), dense, sources)
    assert many.sigma_n == pytest.approx(few.sigma_n, rel=0.15)


def test_two_parameter_fit_pays_for_its_zero():
    sources = replace(NOTHING, zero_sigma_m=1e-6)
    paper = rs_btls(DEFORMATION - 1e-6, FORCE)
    result = budget(paper, DEFORMATION - 1e-6, FORCE, sources)
    shifted = [rs_btls(DEFORMATION - 1e-6 + s * 1e-8, FORCE) for s in (1, -1)]
    per_metre = (shifted[0].n - shifted[1].n) / 2e-8
    assert line(result, "zero").n == pytest.approx(abs(per_metre) * 1e-6, rel=0.01)
    assert line(result, "zero").zero_m == pytest.approx(1e-6)
    assert line(budget(FIT, DEFORMATION, FORCE, sources), "zero").n == 0.0


def test_a_gauge_across_the_contact_has_no_system_stiffness():
    result = budget(FIT, DEFORMATION, FORCE, Sources(None, force_noise_n=0.5))
    through_arm = budget(FIT, DEFORMATION, FORCE, replace(NOTHING, force_noise_n=0.5))
    assert line(result, "system").n == 0.0
    assert 0 < result.sigma_n < through_arm.sigma_n


def test_ellipse_is_the_95_percent_region():
    result = budget(FIT, DEFORMATION, FORCE, replace(NOTHING, smooth_error_m=0.5e-6))
    log_k, n = result.ellipse.outline(40)
    off = np.stack([log_k - result.ellipse.ln_k, n - result.ellipse.n])
    distance = np.sum(off * np.linalg.solve(result.covariance[:2, :2], off), axis=0)
    assert distance == pytest.approx(np.full(40, 5.991), rel=1e-3)


def test_what_has_no_budget_is_refused():
    unknown = replace(FIT, estimator="somebody_elses")
    with pytest.raises(DomainError, match="needs its estimator"):
        budget(unknown, DEFORMATION, FORCE, NOTHING)
    with pytest.raises(DomainError, match="no contact law"):
        budget(replace(FIT, n=-1.0), DEFORMATION, FORCE, NOTHING)


@pytest.mark.parametrize("k", [6.57e8, *long([2.23e8])], ids=["plastic sphere", "plastic cone"])
def test_coverage_in_scenario_c(k):
    """95 % coverage within binomial chance of
    1 in 1000, and an interval that is not wide for safety's sake."""
    runs = 120
    rig = replace(STVF, rate_hz=200.0)
    sources = Sources(
        rig.stiffness_n_per_m,
        0.02 * rig.stiffness_n_per_m,
        SCENARIO_C.smooth_m,
        force_noise_n=rig.force_noise_n,
        force_resolution_n=rig.force_resolution_n,
        position_resolution_m=rig.position_resolution_m,
    )
    rng = np.random.default_rng(11)
    secant = 300.0 ** (1 - 1 / N) * k ** (1 / N)
    hit_n = hit_secant = hit_residual = 0
    errors, widths = [], []
    for _ in range(runs):
        run = press(lambda force: (force / k) ** (1 / N), rig, SCENARIO_C, rng)
        force, deformation = run.loaded_n()[::8], run.deformation_m()[::8]
        fit = joint(deformation, force)
        result = budget(fit, deformation, force, sources)
        hit_n += result.interval_n[0] < N < result.interval_n[1]
        hit_secant += result.interval_secant_n_per_m[0] < secant < result.interval_secant_n_per_m[1]
        hit_residual += abs(fit.n - N) < 1.96 * np.sqrt(fit.covariance[1, 1])
        errors.append(fit.n - N)
        widths.append(result.sigma_n)
    low, high = binom.ppf([0.0005, 0.9995], runs, 0.95)
    assert low <= hit_n <= high
    assert low <= hit_secant <= high
    assert hit_residual < low
    assert np.median(widths) == pytest.approx(np.std(errors), rel=0.25)


@pytest.mark.parametrize("name", ["inverse_ls", "odr"])
def test_sensitivity_with_the_zero_given_agrees_with_the_numeric_one(name):
    sigmas = {"sigma_m": 0.6e-6, "sigma_n": 1.0} if name == "odr" else {}
    estimate = partial(odr if name == "odr" else inverse_ls, **sigmas)
    deformation = (FORCE / 6.57e8) ** (1 / 1.5)
    both = (0.6e-6, 1.0) if name == "odr" else None
    analytic = zero_given_sensitivity(estimate(deformation, FORCE), deformation, FORCE, both)
    numeric = numeric_sensitivity(estimate, deformation, FORCE, step_m=1e-9)
    for smooth in (np.ones_like(FORCE), FORCE, np.cos(FORCE / 60.0)):
        assert analytic @ smooth == pytest.approx(numeric @ smooth, rel=0.02)


def test_the_recursive_fit_as_one_decomposition():
    rng = np.random.default_rng(0)
    force = np.repeat(np.linspace(3.0, 300.0, 900), 2)
    deformation = (force / 6.57e8) ** (1 / 1.5) + rng.normal(0, 1e-7, force.size)
    selected = select(deformation, force)
    used = selected.recursive_used
    fit = recursive_fit(selected, 300.0)
    batch = recursive_as_batch(deformation[used], force[used], 300.0)
    assert batch.n == pytest.approx(fit.n, rel=1e-9)
    assert batch.k == pytest.approx(fit.k, rel=1e-7)


def test_few_degrees_widen_the_smooth_line_alone():
    known = Sources(3.49e6, smooth_error_m=0.5e-6, force_noise_n=0.5)
    guessed = replace(known, smooth_degrees=3.0)
    fit = joint(DEFORMATION, FORCE)
    narrow, wide = (budget(fit, DEFORMATION, FORCE, s) for s in (known, guessed))
    ratio = {a.source: b.n / a.n for a, b in zip(narrow.lines, wide.lines, strict=True) if a.n}
    assert ratio.pop("smooth deformation error") == pytest.approx(3.182446 / 1.959964, rel=1e-4)
    assert all(other == pytest.approx(1.0) for other in ratio.values())
    assert "3 degrees of freedom" in next(
        line.size for line in wide.lines if "smooth" in line.source
    )
