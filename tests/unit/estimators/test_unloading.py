"""Unloading stiffness of branches whose law was put in."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from stepload.estimators.missing import Missing
from stepload.estimators.sources import Sources
from stepload.estimators.unloading import unloading

K, N, K_S, TOP_N, RADIUS_M = 6.57e8, 1.5, 3.49e6, 300.0, 28.7e-3
TRUE_S = N * TOP_N / (TOP_N / K) ** (1.0 / N)
TRUE_MODULUS_PA = 0.75 * K / np.sqrt(RADIUS_M)  # (7)
RIG = Sources(
    K_S, 0.01 * K_S, 3e-7, force_noise_n=0.7, force_resolution_n=1.5, position_noise_m=2e-7,
    position_resolution_m=2e-6, gain_sigma=0.005,
)  # fmt: skip
NO_ERROR = Sources(None)


def branch(seed=None, *, final=0.0, low=50.0, softer=0.0, quantum=2e-6):
    """Steps of 50 N down from 300 N, held for 3 s at 1 kHz; with a seed as the rig sees it."""
    levels = np.arange(TOP_N, low - 1.0, -50.0)
    path = [np.full(3000, TOP_N)]
    for high, level in pairwise(levels):
        path += [np.linspace(high, level, 1000), np.full(3000, level)]
    force = np.concatenate(path)
    deformation = final + (force / K) ** (1.0 / N)
    if seed is None:
        return deformation, force
    rng = np.random.default_rng(seed)
    at = np.arange(0.0, 310.0, 5.0)
    smooth = np.exp(-0.5 * (np.subtract.outer(at, at) / 50.0) ** 2) + 1e-8 * np.eye(at.size)
    error = np.interp(force, at, np.linalg.cholesky(smooth) @ rng.normal(size=at.size)) * 3e-7
    travel = deformation + force / K_S * (1.0 + softer) + error
    travel = travel + rng.normal(0.0, 2e-7, force.size) + rng.uniform(0.0, quantum)
    travel = np.round(travel / quantum) * quantum
    read = np.round((force + rng.normal(0.0, 0.7, force.size)) / 1.5) * 1.5
    return travel - read / K_S, read


def test_the_tangent_at_the_top_and_where_it_rests():
    found = unloading(*branch(final=5e-6), NO_ERROR, cycle=2)
    assert found.cycle == 2
    assert found.top_force_n == 300.0
    assert found.stiffness_n_per_m == pytest.approx(TRUE_S, rel=1e-6)
    assert found.final_m == pytest.approx(5e-6, rel=1e-6)
    assert found.exponent == pytest.approx(N, rel=1e-6)
    assert found.indentation is None
    assert (found.from_n, found.to_n) == pytest.approx((60.0, 285.0), abs=2.0)


def test_a_sphere_gives_its_modulus():
    found = unloading(*branch(final=5e-6), NO_ERROR, radius_m=RADIUS_M, zero_m=5e-6)
    inside = found.indentation
    assert inside.depth_m == pytest.approx((TOP_N / K) ** (1.0 / N), rel=1e-6)
    assert inside.contact_depth_m == pytest.approx(0.5 * inside.depth_m, rel=1e-6)
    assert inside.reduced_modulus_pa == pytest.approx(TRUE_MODULUS_PA, rel=1e-3)


def test_a_zero_beyond_the_depth_gives_no_modulus():
    found = unloading(*branch(), NO_ERROR, radius_m=RADIUS_M, zero_m=1e-4)
    assert found.indentation is None
    assert found.stiffness_n_per_m == pytest.approx(TRUE_S, rel=1e-6)


@pytest.mark.long
def test_intervals_hold_the_truth_on_a_rig():
    stiff = modulus = 0
    half = []
    for seed in range(30):
        softer = float(np.random.default_rng(1000 + seed).normal(0.0, 0.01))
        found = unloading(
            *branch(seed, softer=softer), RIG, radius_m=RADIUS_M, zero_sigma_m=2e-6
        )  # fmt: skip
        low, high = found.interval_n_per_m
        stiff += low <= TRUE_S <= high
        half.append(0.5 * (high - low) / TRUE_S)
        low, high = found.indentation.interval_pa
        modulus += low <= TRUE_MODULUS_PA <= high
    assert stiff >= 27
    assert modulus >= 26
    assert 0.03 < np.median(half) < 0.2


@pytest.mark.parametrize("loss", [0.02, 0.05, 0.1])
def test_a_rounded_loop_is_in_the_interval(loss):
    # The way down passes from the loading curve to (1 − loss) of it by the 20th power.
    deep = np.linspace(1.0, 0.25, 20000) * (TOP_N / K) ** (1.0 / N)
    turned = -1.0 + 2.0 * (deep / deep[0]) ** 20
    force = K * deep**N * (1.0 - 0.5 * loss * (1.0 - turned))
    found = unloading(deep, force, NO_ERROR)
    assert abs(found.stiffness_n_per_m / TRUE_S - 1.0) > 0.3 * loss
    low, high = found.interval_n_per_m
    assert low < TRUE_S < high
    assert found.shape_sigma < loss


def test_an_uncertain_zero_widens_the_modulus_alone():
    narrow = unloading(*branch(1), RIG, radius_m=RADIUS_M)
    wide = unloading(*branch(1), RIG, radius_m=RADIUS_M, zero_sigma_m=1e-5)
    assert narrow.interval_n_per_m == wide.interval_n_per_m

    def width(found):
        low, high = found.indentation.interval_pa
        return high - low

    assert width(wide) > 1.5 * width(narrow)


def test_what_is_too_short_is_told():
    short = unloading(*branch(low=250.0), NO_ERROR)
    assert isinstance(short, Missing)
    assert "250 N of 300 N" in short.why
    few = unloading(np.zeros(5), np.ones(5), NO_ERROR)
    assert isinstance(few, Missing)
    assert "5 samples" in few.why
    assert isinstance(unloading(np.empty(0), np.empty(0), NO_ERROR), Missing)
    pulled = unloading(np.linspace(1e-5, 0.0, 100), -np.linspace(100.0, 1.0, 100), NO_ERROR)
    assert isinstance(pulled, Missing)


def test_a_deformation_that_does_not_fall_is_no_branch():
    force = np.linspace(300.0, 3.0, 500)
    found = unloading(np.linspace(0.0, 1e-5, 500), force, NO_ERROR)
    assert isinstance(found, Missing)
    assert "no power law" in found.why


def test_quanta_of_the_size_of_the_deformation_are_told():
    coarse = replace(RIG, position_resolution_m=2e-5)
    for seed in range(4):
        found = unloading(*branch(seed, quantum=2e-5), coarse)
        assert isinstance(found, Missing)
        assert "not determined" in found.why or "no power law" in found.why
