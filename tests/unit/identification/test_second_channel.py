"""A second force channel tells a wrong gain, whatever its zero and within what both state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pressed_runs import there_and_back

from stepload.identification.channel_checks import against_second
from stepload.identification.conditions import Conditions, Sources
from stepload.identification.loops import Track
from stepload.identification.run_data import RunData
from stepload.identification.verdict import judge

TOP_N = 50.0


def pressed(gain: float, share: float | None = 0.03, friction_n: float = 0.0) -> RunData:
    """A spring with a second channel that has its own zero, noise and friction."""
    rng = np.random.default_rng(1)
    force = np.linspace(1.0, TOP_N, 2000)
    sources = Sources(None, force_noise_n=0.1, gain_sigma=0.01, position_noise_m=1e-7)
    told = Conditions(sources, TOP_N, 1.0, 1e-6, second_share=share)
    run = there_and_back(force, force / 1e5, told)
    [(number, up, down)] = run.tracks
    assert down is not None

    def seen(track: Track, way: float) -> Track:
        noise_n = 0.5 * rng.standard_normal(track.force_n.size)
        return replace(track, second_n=gain * track.force_n + 4.0 + way * friction_n + noise_n)

    return replace(run, tracks=[(number, seen(up, 1.0), seen(down, -1.0))])


@pytest.mark.parametrize("gain", [0.97, 1.0, 1.03])
def test_within_what_both_state_the_gain_is_confirmed(gain: float) -> None:
    doubts, notes = against_second(pressed(gain))
    assert (len(doubts), len(notes)) == (0, 1)


@pytest.mark.parametrize("gain", [0.8, 0.92, 1.08, 1.2])
def test_a_wrong_gain_identifies_nothing(gain: float) -> None:
    run = pressed(gain)
    doubts, notes = against_second(run)
    assert (len(doubts), len(notes)) == (1, 0)
    assert all(doubts[0] in each.why for each in judge(run).quantities.values())


def test_friction_of_the_second_channel_is_its_uncertainty() -> None:
    """It turns round with the motion: the slope is true, and known less well."""
    assert against_second(pressed(1.0, friction_n=3.0))[0] == []
    assert against_second(pressed(1.07, friction_n=0.0))[0] != []


def test_samples_that_the_second_channel_has_not_are_left_out() -> None:
    run = pressed(1.2)
    [(number, up, down)] = run.tracks
    assert up.second_n is not None
    some = np.where(np.arange(up.force_n.size) % 3 == 0, np.nan, up.second_n)
    assert against_second(replace(run, tracks=[(number, replace(up, second_n=some), down)]))[0]
    none = np.full(up.force_n.size, np.nan)
    assert against_second(replace(run, tracks=[(number, replace(up, second_n=none), None)])) == (
        [], [],
    )  # fmt: skip
