"""The driver's second force channel, through the wire, from the simulated contact."""

from __future__ import annotations

import time

import pytest

WORLD = {
    "surface_m": 2e-4,
    "system_stiffness_n_per_m": 1e5,
    "system_damping_n_s_per_m": 1.5e3,
    "effective_mass_kg": 5.0,
    "arm_force_noise_n": 0.2,
}


@pytest.mark.parametrize("direction", [(0.0, 0.0, -1.0), (0.0, 3.0, 4.0)])
def test_pressing_is_positive_force_on_the_approach_axis(start_emulator, make_arm, direction):
    emulator = start_emulator(world=WORLD, direction=direction)
    arm = make_arm(emulator.host, approach=direction)
    arm.open(15.0)
    for step in range(100):
        arm.command(4e-6 * step)
        arm.drain()
        time.sleep(0.005)
    time.sleep(0.1)
    sample = arm.drain()[-1]
    truth = emulator.state()
    assert truth["force_n"] > 5.0
    assert sample.force_n == pytest.approx(truth["force_n"], abs=2.0)
    arm.retract(0.0005, 0.02, 5.0)
    assert emulator.state()["force_n"] == pytest.approx(0.0, abs=2.0)
    assert arm.fault() is None
