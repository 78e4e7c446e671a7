"""From amplitudes to a verdict: what a force channel felt of the mass that it carries."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stepload.engine.felt_mass import FeltMass, felt_mass
from stepload.engine.lock_in import LEAST_READINGS, LockIn
from stepload.envelope.shake import Shake, ShakenChannel

CHANNEL = ShakenChannel("force sensor", "rig.force", False, 2.0, 0.1, 0.05, True, 500.0, 0.002)
SHAKE = Shake(1e-3, 30.0, 1.0, 8, 3.5, (CHANNEL,), (0.05,))


def felt(
    *shares: float, along: int = 2, sign: float = 1.0, noise: float = 0.0, late_rad: float = 0.0
) -> FeltMass:
    """What is said where these shares of the mass are felt along x, y and z, so much later."""
    chance = np.random.default_rng(3)
    swings = np.full(SHAKE.cycles, 4e-4 * np.exp(0.4j))
    masses = CHANNEL.mass_kg * np.array(shares)
    forces = -(SHAKE.omega_rad_s**2) * swings[:, None] * masses[None, :]
    forces = forces * np.exp(-1j * late_rad)
    scale = SHAKE.omega_rad_s**2 * 4e-4 * CHANNEL.mass_kg * noise
    forces = forces + scale * chance.normal(size=forces.shape)
    return felt_mass(SHAKE, CHANNEL, swings, forces, along, sign)


@pytest.mark.parametrize("share", [0.71, 1.0, 1.29])
def test_a_mass_about_as_stated_is_proof(share: float) -> None:
    assert felt(0.0, 0.1, share, noise=0.01).proven
    assert felt(0.0, 0.1, -share, sign=-1.0, noise=0.01).proven
    assert felt(share, 0.0, 0.0, along=0).problem == ""


@pytest.mark.parametrize(
    ("shares", "said"),
    [
        ((0.0, 0.0, -1.0), "the sign is wrong"),
        ((0.0, 0.0, -0.4), "the sign is wrong"),
        ((0.0, -1.0, 0.1), "along -fy instead"),
        ((0.9, 0.0, 0.0), "along +fx instead"),
        ((0.0, 0.0, 0.0), "dead although its noise lives"),
        ((0.3, 0.0, 0.29), "dead although its noise lives"),
        ((0.0, 0.0, 0.5), "wrong by a factor of 0.5"),
        ((0.0, 0.0, 2.0), "wrong by a factor of 2"),
    ],
)
def test_every_other_mass_is_named(shares: tuple[float, ...], said: str) -> None:
    found = felt(*shares, noise=0.01)
    assert not found.proven
    assert said in found.problem


@pytest.mark.parametrize("late_rad", [-0.4, 0.4])
def test_readings_a_little_late_are_still_proof(late_rad: float) -> None:
    assert felt(0.0, 0.0, 1.0, noise=0.01, late_rad=late_rad).proven


@pytest.mark.parametrize(
    ("share", "late_rad", "said"),
    [
        (2.0, 1.05, "its readings came 35 ms later than rig.force.delay says, or with the wrong"),
        (1.0, 1.2, "its readings came 40 ms later"),
        (1.0, 1.57, "its readings came 52 ms later"),
        (1.0, 2.2, "its readings came 73 ms later"),
        (-1.0, 2.2, "wrong sign and 73 ms later"),
        (1.0, 5.0, "its readings came 167 ms later"),
    ],
)
def test_late_readings_prove_neither_sign_nor_gain(
    share: float, late_rad: float, said: str
) -> None:
    """A gain of 2 a sixth of a cycle late reads 1.0 in phase; half a cycle turns the sign."""
    found = felt(0.0, 0.0, share, noise=0.003, late_rad=late_rad)
    assert not found.proven
    assert said in found.problem
    assert "neither sign nor gain can be told" in found.problem


def test_half_a_cycle_late_is_not_told_for_sure_as_reversed() -> None:
    assert "unless its readings come 105 ms later" in felt(0.0, 0.0, 1.0, late_rad=3.1).problem


def test_too_large_a_mass_is_no_proof_because_of_a_small_delay() -> None:
    found = felt(0.0, 0.0, 1.4, noise=0.003, late_rad=0.45)
    assert abs(found.along - 1.0) < 0.3
    assert "neither" not in found.problem
    assert "wrong by a factor of 1.4" in found.problem


def test_a_mass_felt_too_badly_proves_nothing() -> None:
    found = felt(0.0, 0.0, 1.0, noise=0.6)
    assert found.half_width > 0.2
    assert not found.proven
    assert "too uncertain to prove anything" in found.problem


def test_a_cycle_without_readings_proves_nothing() -> None:
    lock_in = LockIn(30.0, 1)
    for index in range(LEAST_READINGS - 1):
        lock_in.add(0.001 * index, (1.0,))
    lock_in.end_cycle()
    swings = np.full((8, 1), 4e-4 + 0j)
    swings[3] = lock_in.amplitudes
    found = felt_mass(SHAKE, CHANNEL, swings[:, 0], swings, 0, 1.0)
    assert found.half_width == math.inf
    assert not found.proven


def test_offset_and_drift_are_no_swing() -> None:
    lock_in = LockIn(30.0, 2)
    times = np.arange(0.0, 2.0 * math.pi / 30.0, 1e-3) + 7.0
    for time_s in times:
        swing = 0.3 * math.cos(30.0 * time_s + 0.7)
        lock_in.add(time_s, (100.0 + 5.0 * time_s + swing, -3.0))
    lock_in.end_cycle()
    assert lock_in.amplitudes[0, 0] == pytest.approx(0.3 * np.exp(0.7j), rel=1e-9)
    assert abs(lock_in.amplitudes[0, 1]) < 1e-9
    lock_in.add(0.0, (1.0, 1.0))
    lock_in.drop()
    assert len(lock_in.amplitudes) == 1
