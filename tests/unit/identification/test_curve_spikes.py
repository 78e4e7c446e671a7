"""Glitches are found, and nothing that a contact does is taken for one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload.identification.curve_channels import spikes
from stepload.identification.fit import FloatArray

TOP_N = 300.0


def press(count: int = 400, noise: float = 1e-3, seed: int = 0) -> FloatArray:
    """Free air, a loading, a hold, an unloading, free air; noise as a share of the top."""
    up = np.linspace(0.0, TOP_N, count)
    force = np.concatenate([np.zeros(60), up, np.full(40, TOP_N), up[::-1], np.zeros(60)])
    return force + np.random.default_rng(seed).normal(0.0, noise * TOP_N, force.size)


@given(
    at=st.integers(3, 900), size=st.floats(0.05, 1e6), down=st.booleans(), width=st.integers(1, 2),
    noise=st.sampled_from([0.0, 1e-5, 1e-3]), seed=st.integers(0, 20),
)  # fmt: skip
def test_a_glitch_is_found_wherever_it_is(
    at: int, size: float, down: bool, width: int, noise: float, seed: int
) -> None:
    force = press(noise=noise, seed=seed)
    force[at : at + width] += (-size if down else size) * TOP_N
    assert np.flatnonzero(spikes(force)).tolist() == list(range(at, at + width))


@given(
    at=st.integers(1, 955), size=st.floats(-2.0, 2.0), noise=st.sampled_from([0.0, 1e-5, 1e-3]),
    count=st.sampled_from([10, 30, 400]), seed=st.integers(0, 20),
)  # fmt: skip
def test_a_step_stays(at: int, size: float, noise: float, count: int, seed: int) -> None:
    """A pop-in, a crack, a pull-off."""
    force = press(count, noise, seed)
    force[at % force.size :] += size * TOP_N
    assert not spikes(force).any()


@given(
    pull=st.floats(0.01, 3.0), dx=st.floats(1e-4, 0.2), noise=st.sampled_from([0.0, 1e-5, 1e-3]),
    seed=st.integers(0, 20),
)  # fmt: skip
def test_a_snap_in_and_a_pull_off_stay(pull: float, dx: float, noise: float, seed: int) -> None:
    """From free air the force falls within one sample, then rises as the contact is pressed."""
    depth = np.arange(0.0, 2.0 + pull, dx)
    force = np.concatenate([np.zeros(40), depth - pull, depth[::-1] - 2.0 * pull, np.zeros(40)])
    force += np.random.default_rng(seed).normal(0.0, noise, force.size)
    assert not spikes(force).any()


@pytest.mark.parametrize("count", [16, 17, 40, 400])
def test_the_sharp_top_of_a_press_stays(count: int) -> None:
    for up in (np.linspace(0.0, TOP_N, count), np.geomspace(1e-3 * TOP_N, TOP_N, count)):
        assert not spikes(np.concatenate([up, up[-2::-1]])).any()


def test_the_noise_and_the_quanta_of_a_channel_are_none() -> None:
    noise = np.random.default_rng(3).normal(size=200_000)
    assert not spikes(noise).any()
    assert not spikes(np.round(noise / 2.0) * 2.0).any()
    held = np.zeros(500)
    held[::50] = 1.0  # one quantum now and then
    assert not spikes(held).any()
