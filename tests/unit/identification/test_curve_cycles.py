"""Cycles of curves from elsewhere, and which way they press."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from stepload.identification.curve_channels import signs
from stepload.identification.curve_cycles import cycles_of
from stepload.identification.fit import FloatArray


def ramp(*levels: float, count: int = 200) -> FloatArray:
    """Straight ramps between the levels; equal ones are a hold."""
    parts = [np.linspace(a, b, count, endpoint=False) for a, b in pairwise(levels)]
    return np.concatenate([*parts, [levels[-1]]])


def elastic(force: FloatArray) -> FloatArray:
    return np.maximum(force, 0.0) ** (2 / 3)


def bounds(force: FloatArray, travel: FloatArray) -> list[tuple[int, int, int]]:
    """End of loading, end of hold, end of unloading (0: none)."""
    return [
        (c.loading.stop, c.hold.stop, c.unloading.stop if c.unloading else 0)
        for c in cycles_of(force, travel)
    ]


def test_one_cycle_with_a_hold() -> None:
    force = ramp(0, 100, 100, 0)
    ((loaded, held, unloaded),) = bounds(force, elastic(force))
    assert loaded == pytest.approx(200, abs=3)
    assert held == pytest.approx(400, abs=4)
    assert unloaded == force.size


@pytest.mark.parametrize("noise", [0.0, 0.3, 1.5])
def test_partial_unloading_and_growing_peaks(noise: float) -> None:
    force = ramp(0, 40, 10, 70, 20, 100, 100, 0)
    rng = np.random.default_rng(0)
    noisy = force + rng.normal(0, noise, force.size)
    found = bounds(noisy, elastic(force) + rng.normal(0, 1e-3, force.size))
    assert len(found) == 3
    for (loaded, _, unloaded), peak, valley in zip(
        found, (200, 600, 1000), (400, 800, 1400), strict=True
    ):
        assert loaded == pytest.approx(peak, abs=2 + 24 * noise)
        assert unloaded == pytest.approx(valley, abs=2 + 24 * noise)


def test_steps_with_holds_are_one_loading() -> None:
    levels = [level for step in (50, 100, 150, 200, 250, 300) for level in (step, step)]
    force = ramp(0, *levels, 0) + np.random.default_rng(1).normal(0, 0.7, 200 * 13 + 1)
    ((loaded, held, unloaded),) = bounds(force, elastic(force))
    assert loaded == pytest.approx(2200, abs=15)
    assert held == pytest.approx(2400, abs=15)
    assert unloaded == force.size


def test_a_force_that_relaxes_in_holds_is_not_unloaded() -> None:
    """A position that is held: a third of the force goes, the payload stays pressed."""
    depth = ramp(0, 1, 1, 2, 2, 0)
    fading = np.concatenate([np.ones(200), np.linspace(1, 0.67, 200)])
    force = 100.0 * depth * np.concatenate([fading, fading, np.full(201, 0.67)])
    ((_, held, unloaded),) = bounds(force, depth)
    assert held == pytest.approx(800, abs=3)
    assert unloaded == force.size


def test_adhesion_and_spikes_make_no_cycle() -> None:
    force = ramp(0, 0, 100, 0, -30, 0, 0, count=300)
    travel = ramp(-20, 0, 21, 0, -6, -10, -20, count=300)
    force[100:102] = 80.0
    ((loaded, _, unloaded),) = bounds(force, travel)
    assert loaded == pytest.approx(600, abs=3)
    assert unloaded == force.size


def test_spikes_of_force_and_travel_at_once_make_no_cycle() -> None:
    force = ramp(0, 0, 100, 0, 0, count=300)
    travel = ramp(-20, 0, 21, 0, -20, count=300)
    force[100:102], travel[100:102] = 80.0, 40.0
    assert len(bounds(force, travel)) == 1


@pytest.mark.parametrize("travel_sign", [1.0, -1.0])
@pytest.mark.parametrize("force_sign", [1.0, -1.0])
@pytest.mark.parametrize("offset", [0.0, 60.0, -60.0, 500.0])
def test_signs(travel_sign: float, force_sign: float, offset: float) -> None:
    force = ramp(0, 0, 100, 0, 0) + np.random.default_rng(3).normal(0, 0.5, 801)
    travel = ramp(-30, 0, 20, 0, -30)
    found = signs(travel_sign * travel + 7.0, force_sign * force + offset)
    assert (found.travel, found.force) == (travel_sign, force_sign)


def test_a_pull_that_is_stronger_than_the_push_does_not_turn_the_signs() -> None:
    force, travel = ramp(0, 0, 10, 0, -40, 0, 0), ramp(-30, 0, 5, 0, -20, -21, -40)
    assert signs(travel, force)[:2] == (1.0, 1.0)
    assert signs(-travel, -force)[:2] == (-1.0, -1.0)
