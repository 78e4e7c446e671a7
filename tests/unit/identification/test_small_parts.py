"""A quantum under noise, a jump, a drift between tops that disagree, and what narrows a budget."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pressed_runs import World, hertz, press, told

from stepload.identification.branches import read_of
from stepload.identification.budget import dithered
from stepload.identification.conditions import Conditions, Sources
from stepload.identification.elastic import jump_of
from stepload.identification.expected import NAMED, LoadSchedule, expect, narrowing
from stepload.identification.fit import FloatArray
from stepload.identification.lawfit import Whitened, fit_law
from stepload.identification.laws import POWER
from stepload.identification.verdict import judge

QUANTUM_M = 2e-6


def left(noise_m: float) -> float:
    """What is left of the quantum, as a share of it."""
    told = Sources(None, position_noise_m=noise_m, position_resolution_m=QUANTUM_M)
    return told.quantum_left_m / QUANTUM_M


def test_noise_takes_a_quantum_out() -> None:
    assert left(0.0) == pytest.approx(1.0 / math.sqrt(12.0), rel=2e-3)
    assert left(5.0 * QUANTUM_M) < 1e-12
    rng = np.random.default_rng(1)
    for noise in (0.1, 0.2, 0.3):
        true = rng.uniform(0.0, 1.0, (4000, 1))
        read = np.round(true + noise * rng.standard_normal((4000, 1000)))
        scatter = np.hypot(noise, 0.3) / math.sqrt(1000.0)
        measured = float(np.std(read.mean(axis=1) - true[:, 0]))
        assert measured == pytest.approx(left(noise * QUANTUM_M), abs=scatter)


def test_the_error_of_a_quantum_is_its_own_at_every_level() -> None:
    run = press(World(position_noise_m=0.0))
    read = read_of(run)
    loops, elastic = read.loops, read.elastic
    path = loops[0].loading.path
    covariance = dithered(elastic, path, run.conditions.sources)
    held = np.flatnonzero(path.held > 0)
    sigma = np.sqrt(np.diag(covariance))
    assert sigma.max() == pytest.approx(QUANTUM_M / math.sqrt(12.0), rel=2e-3)
    ends = held[[0, -1]]
    assert abs(covariance[ends[0], ends[1]]) < 1e-6 * sigma.max() ** 2
    fine = replace(run.conditions.sources, position_resolution_m=0.0)
    assert not dithered(elastic, path, fine).any()


CLICK_M = 1e-6
"""2 % of the deformation of the chord."""


def noisy_loading(seed: int, click_m: float = 0.0) -> Whitened:
    force_n = np.linspace(6.0, 300.0, 50)
    noise_m = 0.1e-6 * np.random.default_rng(seed).standard_normal(50)
    return Whitened(
        force_n, hertz(force_n) + noise_m + click_m * (force_n > 150.0), 1e-14 * np.eye(50)
    )


def test_a_click_of_two_percent_is_found_where_it_is_and_noise_has_none() -> None:
    for seed in range(40):
        quiet, clicked = noisy_loading(seed), noisy_loading(seed, CLICK_M)
        law = fit_law(quiet, POWER)
        assert law is not None
        assert jump_of(quiet, law) is None
        law = fit_law(clicked, POWER)
        assert law is not None
        found = jump_of(clicked, law)
        assert found is not None
        assert found.size_m == pytest.approx(CLICK_M, rel=0.4)
        assert found.at_n == pytest.approx(153.0, abs=6.5)


def clicking(force_n: FloatArray) -> FloatArray:
    return hertz(force_n) + 3e-6 * (force_n > 120.0)


def test_a_run_that_clicks_between_two_levels_is_not_identified() -> None:
    for seed in range(3):
        found = judge(press(World(law=clicking), seed))
        assert all(each.verdict != "identified" for kind, each in found.quantities.items())


def test_tops_that_disagree_with_the_second_loading_are_a_line_of_drift() -> None:
    def uneven(set_m: float) -> float:
        lines = judge(press(World(set_m=set_m))).headline.lines
        return next((each.relative for each in lines if "not even" in each.source), 0.0)

    assert uneven(0.0) < 1e-3
    assert uneven(5e-6) > 0.03


def test_what_narrows_a_run_are_its_largest_lines_with_the_interval_that_they_give() -> None:
    run = press(World(system_sigma=0.05))
    now = judge(run).headline
    found = narrowing(run, now)
    assert 1 <= len(found) <= NAMED
    assert found[0].line == max(now.lines, key=lambda line: line.relative).source
    assert found[0].line == "system stiffness K_s"
    known = judge(press(World(system_sigma=0.01))).headline.half_width
    assert found[0].half_width == pytest.approx(known, rel=0.05)
    assert all(each.half_width < now.half_width for each in found)


@pytest.mark.parametrize("branch", ["loading", "unloading", "reloading"])
def test_what_is_expected_is_of_the_branch_that_is_asked_for(branch: str) -> None:
    run = told(press(World()), branch=branch)
    expected, measured = judge(run, laws=False).headline, judge(run).headline
    assert expected.kind == measured.kind
    assert expected.half_width == pytest.approx(measured.half_width, rel=0.05)


@pytest.mark.parametrize("wrong", [-0.1, 0.1])
@pytest.mark.parametrize("n", [1.3, 1.5])
def test_the_shape_of_a_fit_does_not_tell_the_stiffness_of_the_system(
    wrong: float, n: float
) -> None:
    """K_s known to 10 % and wrong by it: the chord is off by one standard uncertainty of it."""
    sources = Sources(1e5, 1e4, 1e-7, smooth_length_n=10.0, force_noise_n=1e-3,
                      position_resolution_m=1e-8)  # fmt: skip
    schedule = LoadSchedule(np.linspace(10.0, 50.0, 5), 1.0, (1.0,) * 5, (1.0,) * 4, 2.0)
    k = 50.0 / 5e-4**n
    told = Conditions(sources, 50.0, 1.0, 1e-8)
    found = expect(told, schedule, lambda f: (f / k) ** (1.0 / n) + wrong * f / 1e5).chord
    true = 45.0 / ((50.0 / k) ** (1.0 / n) - (5.0 / k) ** (1.0 / n))
    assert abs(math.log(found.value_n_per_m / true)) < 1.3 * found.relative
