"""A gauge across the contact is held against the arm: end of its range, and a wrong scale."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from pressed_runs import World, hertz, press, told

from stepload.identification.fit import FloatArray
from stepload.identification.lateral import LateralForce
from stepload.identification.loops import Track
from stepload.identification.run_data import RunData
from stepload.identification.verdict import Judgement, judge

Read = Callable[[FloatArray], FloatArray]
NOISE_M, QUANTUM_M = 0.05e-6, 0.1e-6
DEPTH_M = float(hertz(np.array([300.0]))[0])


def sound(deformation_m: FloatArray) -> FloatArray:
    return deformation_m


def clipped(share: float) -> Read:
    return lambda deformation_m: np.minimum(deformation_m, share * DEPTH_M)


def scaled(gain: float) -> Read:
    return lambda deformation_m: gain * deformation_m


def beside(world: World, seed: int, read: Read = sound) -> RunData:
    """The run of a world whose arm is that of `press`, with a gauge that reads so."""
    made, rng = press(world, seed), np.random.default_rng(1000 + seed)
    # The same course without noise: what is truly deformed.
    exact = press(
        replace(world, force_noise_n=0.0, position_noise_m=0.0, quantum_m=0.0, smooth_m=0.0), seed
    )

    def gauged(track: Track, true: Track) -> Track:
        noisy_m = world.law(true.force_n) + NOISE_M * rng.standard_normal(true.force_n.size)
        travel_m = np.round(read(noisy_m) / QUANTUM_M) * QUANTUM_M
        return replace(track, travel_m=travel_m, arm_m=7e-3 + track.travel_m)

    tracks = []
    for (number, up, down), (_, true_up, true_down) in zip(made.tracks, exact.tracks, strict=True):
        assert down is not None
        assert true_down is not None
        tracks.append((number, gauged(up, true_up), gauged(down, true_down)))
    arm = made.conditions.sources
    own = replace(
        arm, system_stiffness_n_per_m=None, system_stiffness_sigma_n_per_m=0.0, smooth_error_m=0.0,
        position_noise_m=NOISE_M, position_resolution_m=QUANTUM_M, deflection_force_n=(),
        deflection_m=(), deflection_sigma_m=(),
    )  # fmt: skip
    conditions = replace(
        made.conditions, sources=own, position_resolution_m=QUANTUM_M, arm_sources=arm
    )
    return replace(made, tracks=tracks, conditions=conditions)


def against(found: Judgement) -> set[str]:
    """What is said against the gauge, each by a word of its own."""
    why = " ".join(found.headline.why)
    return {word for word in ("the gauge stands", "the gauge changes by") if word in why}


def about_the_scale(found: Judgement) -> list[str]:
    return [note for note in found.notes if "gauge's scale" in note]


@pytest.mark.parametrize(
    "world",
    [
        World(),
        World(law=lambda force: force / 6e6),
        World(system_off=0.01, smooth_m=1e-6),
        World(force_noise_n=6.0),
    ],
    ids=["sphere", "flat", "rig within its errors", "2 % noise"],
)
def test_a_sound_gauge_is_quiet(world: World) -> None:
    for seed in range(6):
        found = judge(beside(world, seed))
        assert found.headline.verdict == "identified", found.headline.why
        assert "would not be seen" in about_the_scale(found)[0]


@pytest.mark.parametrize(
    ("read", "said"),
    [
        (clipped(0.6), {"the gauge stands", "the gauge changes by"}),
        (clipped(0.9), {"the gauge stands"}),
        (clipped(0.97), {"the gauge stands"}),
        (scaled(1.2), {"the gauge changes by"}),
        (scaled(0.8), {"the gauge changes by"}),
    ],
    ids=["clipped at 0.6", "clipped at 0.9", "clipped at 0.97", "scale 1.2", "scale 0.8"],
)
def test_a_gauge_that_the_arm_contradicts_identifies_nothing(read: Read, said: set[str]) -> None:
    for seed in range(3):
        found = judge(beside(World(), seed, read))
        assert said <= against(found)
        assert all(each.verdict != "identified" for each in found.quantities.values())


def test_an_arm_that_says_nothing_of_the_scale_is_told_and_fires_nothing() -> None:
    run = beside(World(), 0, scaled(1.2))
    arm = replace(run.conditions.arm_sources, smooth_error_m=20e-6)  # type: ignore[type-var]
    found = judge(told(run, arm_sources=arm))
    assert not against(found)
    assert "was not checked" in about_the_scale(found)[0]
    serial = judge(replace(told(run, arm=True), lateral_force=LateralForce("guided")))
    assert not against(serial)
    assert "was not checked" in about_the_scale(serial)[0]


def test_a_payload_that_stops_is_no_gauge_at_its_end() -> None:
    def stopped(force_n: FloatArray) -> FloatArray:
        return hertz(np.minimum(force_n, 120.0))

    for seed in range(3):
        assert not against(judge(beside(World(law=stopped), seed)))
