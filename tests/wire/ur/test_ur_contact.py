"""The driver's second force channel, through the wire, from the simulated contact."""

from __future__ import annotations

import time

import pytest
from long_ones import long

WORLD = {
    "surface_m": 2e-4,
    "system_stiffness_n_per_m": 1e5,
    "system_damping_n_s_per_m": 1.5e3,
    "effective_mass_kg": 5.0,
    "arm_force_noise_n": 0.2,
}


SLOPE = (0.2, -0.1)
SLIDES = {"compliance_m_per_n": [[8e-6, 0.0, 0.0], [0.0, 8e-6, 0.0], [0.0, 0.0, 1e-5]],
          "plate_tilt_rad": [SLOPE[0], SLOPE[1]]}  # fmt: skip


@pytest.mark.parametrize("direction", [*long([(0.0, 0.0, -1.0)]), (0.0, 3.0, 4.0)])
def test_the_wrench_is_the_load_on_the_plate_in_the_pressing_frame(
    start_emulator, make_arm, direction
):
    """Without friction it is along the normal of the plate, which is turned about axes 1 and 2."""
    emulator = start_emulator(world={**WORLD, "mount": SLIDES}, direction=direction)
    arm = make_arm(emulator.host, approach=direction)
    arm.open(15.0)
    assert arm.has_wrench
    for step in range(100):
        arm.command(4e-6 * step)
        arm.drain()
        time.sleep(0.005)
    time.sleep(0.1)
    samples = arm.drain()
    x, y, z = (sum(s.wrench[i] for s in samples) / len(samples) for i in range(3))
    assert samples[-1].wrench[2] == samples[-1].force_n > 5.0
    assert (x / z, y / z) == pytest.approx((SLOPE[1], -SLOPE[0]), abs=0.04)
    arm.retract(0.0005, 0.02, 5.0)


@pytest.mark.parametrize("direction", [*long([(0.0, 0.0, -1.0)]), (0.0, 3.0, 4.0)])
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
