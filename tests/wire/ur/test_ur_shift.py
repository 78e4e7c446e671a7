"""The arm goes across its approach, through the wire, in a world with six axes."""

from __future__ import annotations

import math
import time

import pytest
from long_ones import long

from stepload.errors import DeviceError
from stepload_drivers.ur.state import tangents

MOUNT = {"compliance_m_per_n": [[8e-6, 0.0, 3e-6], [0.0, 8e-6, 0.0], [3e-6, 0.0, 1e-5]]}
WORLD = {
    "surface_m": 2e-2,
    "system_stiffness_n_per_m": 1e5,
    "system_damping_n_s_per_m": 1.5e3,
    "effective_mass_kg": 5.0,
    "arm_force_noise_n": 0.2,
    "mount": MOUNT,
}
WAY_M = (2e-3, -1e-3)
STEP_M = 1e-5


def went(arm, begin):
    """Where the arm is since `begin`: along, and along axes 1 and 2, by its pose."""
    time.sleep(0.3)
    sample = arm.drain()[-1]
    moved = [b - a for a, b in zip(begin.pose[:3], sample.pose[:3], strict=True)]
    axes = tangents(arm._settings.approach)
    return sample.position_m, tuple(
        sum(m * part for m, part in zip(moved, axis, strict=True)) for axis in axes
    )


def go(arm, position_m, shift_m):
    steps = math.ceil(math.hypot(*shift_m) / STEP_M)
    for step in range(1, steps + 1):
        arm.command(position_m, tuple(way_m * step / steps for way_m in shift_m))
        arm.drain()
        time.sleep(0.002)


@pytest.mark.parametrize("direction", [*long([(0.0, 0.0, -1.0)]), (0.0, 0.6, -0.8)])
def test_a_shift_is_followed_across_and_a_retract_keeps_it(start_emulator, make_arm, direction):
    emulator = start_emulator(world=WORLD, direction=direction)
    arm = make_arm(emulator.host, approach=direction)
    arm.open(15.0)
    assert arm.can_shift
    time.sleep(0.1)
    begin = arm.drain()[-1]
    go(arm, 0.0, WAY_M)
    along_m, across_m = went(arm, begin)
    assert along_m == pytest.approx(0.0, abs=2e-5)
    assert across_m == pytest.approx(WAY_M, abs=2e-5)
    arm.retract(0.001, 0.02, 5.0)
    along_m, across_m = went(arm, begin)
    assert along_m == pytest.approx(-0.001, abs=3e-4)
    assert across_m == pytest.approx(WAY_M, abs=2e-5)
    assert arm.fault() is None


def test_a_shift_that_no_arm_may_do_never_reaches_the_controller(start_emulator, make_arm):
    emulator = start_emulator(world=WORLD)
    arm = make_arm(emulator.host)
    arm.open(15.0)
    time.sleep(0.1)
    begin = arm.drain()[-1]
    for shift_m in ((math.nan, 0.0), (0.0, math.inf), (0.011, 0.0), (0.0, 0.0025)):
        with pytest.raises(DeviceError, match="shift"):
            arm.command(0.0, shift_m)
    assert went(arm, begin)[1] == pytest.approx((0.0, 0.0), abs=2e-6)
    assert arm.fault() is None


def test_an_arm_that_is_killed_while_it_shifts_goes_back_along_its_approach(
    start_emulator, make_arm
):
    """The child is lost: the retract past it starts from where the target was."""
    emulator = start_emulator(world=WORLD)
    arm = make_arm(emulator.host)
    arm.open(15.0)
    time.sleep(0.1)
    begin = arm.drain()[-1]
    go(arm, 0.0, WAY_M)
    time.sleep(0.3)
    arm._kill()
    arm.retract(0.001, 0.02, 8.0)
    arm.safe(3.0)
    arm.close()
    assert emulator.state()["position_m"] == pytest.approx(-0.001, abs=3e-4)
    again = make_arm(emulator.host)
    again.open(15.0)
    time.sleep(0.1)
    moved_m = math.dist(again.drain()[-1].pose[:3], begin.pose[:3])
    assert moved_m == pytest.approx(math.hypot(*WAY_M, 0.001), abs=3e-4)
