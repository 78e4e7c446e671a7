"""A rig with six axes speaks through the emulators: controller, force sensor, gauge."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from six_rigs import SURFACE_M, rig, rub

from stepload.rig.mount import SensorMount
from stepload_drivers.sim.live import LiveWorld
from stepload_verify.emulators.live_rig import WorldPhysics
from stepload_verify.emulators.physics import WrenchSource
from stepload_verify.emulators.ur_robot import HOME, PressFrame, Robot
from stepload_verify.emulators.ur_world import AxisState, FreeAirAxis, LiveAxis

MOUNT = replace(
    rub(0.2, x=0.5, y=0.2),
    turn_rad_per_n=((0.0, 0.0, 0.0), (0.0, 0.0, 2e-5), (0.0, 0.0, 0.0)),
    sensor=SensorMount(lever_m=(1e-3, -2e-3, 0.1)),
)
SPEC = rig(mount=MOUNT, arm_rate_hz=1000.0, arm_force_noise_n=0.0)


def pressed(spec=SPEC):
    """A world that has been pressed for a while, in made-up time."""
    live = LiveWorld(spec, start_s=100.0)
    for tick in range(1000):
        live.command(SURFACE_M + 1e-6 * tick)
        live.advance_to(100.0 + 1e-3 * tick)
    live.advance_to(102.0)
    return live


def test_a_sensor_on_the_wire_shows_all_six_components():
    live = pressed()
    source = WrenchSource(WorldPhysics(live, SPEC), "+fz", noise=0.0)
    load = np.array(live.world.plant.load)
    shown = source.wrench(102.0, extra_n=1.5)
    bias = np.array([0.0, 0.0, SPEC.start_force_bias_n + 1.5])
    assert shown[:3] == pytest.approx(tuple(load + bias))
    assert shown[3:] == pytest.approx(tuple(np.cross([1e-3, -2e-3, 0.1], load)))
    assert abs(load[0]) > 3.0


def test_a_sensor_with_a_negative_axis_shows_all_six_reversed():
    spec = replace(SPEC, force_axis="-fx")
    live = pressed(spec)
    shown = WrenchSource(WorldPhysics(live, spec), "-fx", noise=0.0).wrench(102.0)
    x, y, z = live.world.plant.load
    assert shown[:3] == pytest.approx((-z - spec.start_force_bias_n, -x, -y))


def test_a_gauge_sees_the_turn_of_the_tool():
    spec = replace(SPEC, mount=replace(MOUNT, gauge_offset_m=(0.02, 0.0)))
    live, straight = pressed(spec), pressed()
    turned_m = WorldPhysics(live, spec).closed_m(102.0) - WorldPhysics(straight, SPEC).closed_m(
        102.0
    )
    assert turned_m == pytest.approx(-2e-5 * live.world.plant.force_n * 0.02, rel=1e-6)


class Told(FreeAirAxis):
    """An axis that says what it is told to say, and keeps what it is asked."""

    def __init__(self, state):
        super().__init__()
        self.told = state
        self.requested = []

    def command_shift(self, x_m, y_m):
        self.requested.append((x_m, y_m))

    def state(self):
        return self.told


def test_the_controller_tells_the_wrench_on_the_tool_in_the_base_frame():
    """Pressing down with 50 N: the plate pushes up; axis 1 of the press is the base's -x."""
    wrench = (3.0, -4.0, 50.0, 0.1, 0.2, 0.3)
    robot = Robot(Told(AxisState(0.0, 50.0, wrench=wrench)), (0.0, 0.0, -1.0), 0.002)
    assert robot.wrench == pytest.approx((3.0, 4.0, 50.0, 0.1, -0.2, 0.3))
    one_axis = Robot(Told(AxisState(0.0, 50.0)), (0.0, 0.0, -1.0), 0.002)
    assert one_axis.wrench == pytest.approx((0.0, 0.0, 50.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("direction", [(0.0, 0.0, -1.0), (0.3, -0.5, -2.0), (0.0, 1.0, 0.0)])
def test_the_pressing_frame_is_right_handed_along_the_approach(direction):
    frame = PressFrame(direction)
    axes = np.array(frame.axes)
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.cross(axes[0], axes[1]) == pytest.approx(axes[2], abs=1e-12)
    assert axes[2] == pytest.approx(np.array(direction) / math.hypot(*direction))
    vector = (1.0, 2.0, 3.0)
    assert frame.across(frame.to_base(vector)) == pytest.approx(vector[:2])


def test_the_pose_follows_the_drives_across_and_not_the_command():
    axis = Told(AxisState(0.01, 0.0, shift_m=(1e-3, -2e-3)))
    robot = Robot(axis, (0.0, 0.0, -1.0), 0.002)
    target = (HOME[0] - 5e-3, HOME[1] + 6e-3, HOME[2] - 0.02, *HOME[3:])
    robot.servo(target)
    robot.tick()
    assert axis.requested[-1] == pytest.approx((5e-3, 6e-3))
    assert robot.pose[:3] == pytest.approx((HOME[0] - 1e-3, HOME[1] - 2e-3, HOME[2] - 0.01))
    robot.halt()
    assert axis.requested[-1] == pytest.approx((1e-3, -2e-3))
    assert robot.target[:3] == pytest.approx(robot.pose[:3])


def test_an_arm_in_the_world_tells_load_and_moment_about_its_axis():
    live = pressed()
    axis = LiveAxis(live)
    x, y, z = live.world.plant.load
    told = axis.state()
    assert told.wrench[:2] == pytest.approx((x, y))
    assert told.wrench[3:] == pytest.approx(tuple(np.cross([1e-3, -2e-3, 0.0], (x, y, z))))
    assert told.shift_m == (0.0, 0.0)
    assert told.peak_n >= math.hypot(x, y, z)
    axis.command_shift(1e-4, 0.0)
    live.advance_to(102.5)
    assert LiveAxis(live).state().shift_m == pytest.approx((1e-4, 0.0))
