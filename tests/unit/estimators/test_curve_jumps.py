"""Jumps of a loading: found where they are, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.estimators.curve_jumps import largest_jump
from stepload.estimators.fit import FloatArray

TOP_N, DEEP_M = 0.2, 800e-9


def loading(
    n: float = 1.5, count: int = 3000, noise: float = 1e-3
) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(0)
    force = np.linspace(0.0, TOP_N, count)
    depth = DEEP_M * (force / TOP_N) ** (1 / n)
    return (
        depth + rng.normal(0, noise * DEEP_M, count),
        force + rng.normal(0, noise * TOP_N, count),
    )


@pytest.mark.parametrize("count", [300, 3000, 300_000])
def test_a_pop_in_is_found(count: int) -> None:
    depth, force = loading(count=count)
    at = int(0.4 * count)
    depth[at:] += 40e-9
    found = largest_jump(depth, force)
    assert found is not None
    assert found.force_n == pytest.approx(0.4 * TOP_N, rel=0.03)
    assert found.travel_m == pytest.approx(40e-9, rel=0.15)


@pytest.mark.parametrize("n", [1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize(("count", "noise"), [(100, 1e-4), (3000, 1e-3), (3000, 1e-2), (80, 1e-2)])
def test_a_law_has_none(n: float, count: int, noise: float) -> None:
    assert largest_jump(*loading(n, count, noise)) is None


def test_steps_with_holds_and_a_soft_pad_have_none() -> None:
    rng = np.random.default_rng(1)
    level = np.concatenate([np.r_[np.linspace(0, 1, 20), np.ones(60)] + i for i in range(6)])
    force = 50.0 * level
    depth = 1e-6 * (force**0.667 + 0.2 * np.minimum(level % 1.0, 0.5))
    assert largest_jump(depth + rng.normal(0, 2e-8, depth.size), force) is None
    force = np.concatenate([np.linspace(0, 20, 300), np.linspace(20, 300, 300)])
    depth = np.concatenate([np.linspace(0, 1e-4, 300), np.linspace(1e-4, 1.5e-4, 300)])
    assert largest_jump(depth + rng.normal(0, 2e-8, 600), force) is None


def test_few_samples_on_a_soft_layer_are_no_jumps() -> None:
    """Each step is 2 % of the travel, under hardly more force."""
    force = np.concatenate([np.linspace(0, 40, 60), np.linspace(41, 300, 60)])
    depth = np.concatenate([np.linspace(0, 1e-4, 60), np.linspace(1.003e-4, 1.2e-4, 60)])
    assert largest_jump(depth, force) is None


def test_too_few_samples_tell_nothing() -> None:
    assert largest_jump(*loading(count=30)) is None


def test_the_steps_of_a_reading_are_no_jumps() -> None:
    force = np.linspace(0.0, 300.0, 6000)
    depth = np.round((force / 6.57e8) ** (2 / 3) / 2e-6) * 2e-6
    assert largest_jump(depth, force, quantum_m=2e-6) is None
    assert largest_jump(depth, force) is not None
