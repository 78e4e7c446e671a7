"""What is set on the emulated controller shows where it would on a real one."""

from __future__ import annotations

import pytest

from stepload_verify.emulators.ur_controller import UrController
from stepload_verify.emulators.ur_robot import HOME, Robot
from stepload_verify.emulators.ur_world import FreeAirAxis

DOWN = (0.0, 0.0, -1.0)
AT = (*HOME[:2], HOME[2] - 0.01, *HOME[3:])


@pytest.fixture
def controller() -> UrController:
    return UrController(Robot(FreeAirAxis(), DOWN, 0.002))


def run(controller: UrController, seconds: float) -> None:
    for _ in range(round(seconds / 0.002)):
        controller.tick()


def test_a_wrong_payload_stands_in_the_wrench_as_its_weight(controller):
    assert controller.robot.wrench[2] == 0.0
    controller.command("payload 2 0 0 0.1")
    assert controller.robot.wrench == pytest.approx((0, 0, 19.62, 0, 0, 0))
    assert controller.value("payload") == 2.0
    assert controller.value("payload_cog") == (0.0, 0.0, 0.1)
    controller.command("payload 0")
    assert controller.robot.wrench[2] == 0.0
    assert controller.value("payload_cog") == (0.0, 0.0, 0.1)


def test_another_tcp_moves_the_pose_that_is_told_and_the_arm_that_follows_one(controller):
    robot = controller.robot
    robot.servo(AT)
    run(controller, 0.2)
    assert robot.position_m == pytest.approx(0.01, abs=1e-6)
    controller.command("tcp 0 0 0.002")  # the tool points down: 2 mm further along the approach
    assert robot.pose[2] == pytest.approx(AT[2] - 0.002, abs=1e-6)
    assert robot.position_m == pytest.approx(0.01, abs=1e-6)
    run(controller, 0.2)
    assert robot.pose == pytest.approx(AT, abs=1e-6)
    assert robot.position_m == pytest.approx(0.008, abs=1e-6)


def test_the_slider_slows_a_move_and_at_zero_nothing_moves(controller):
    controller.command("slider 0.5")
    assert controller.value("target_speed_fraction") == 0.5
    controller.robot.move(AT, 0.01)
    run(controller, 0.4)
    assert controller.robot.position_m == pytest.approx(0.002, rel=0.1)
    controller.command("slider 0")
    stood_m = controller.robot.travel_of(controller.robot.target)
    run(controller, 0.4)
    assert controller.robot.travel_of(controller.robot.target) == stood_m
    controller.robot.servo(AT)
    run(controller, 0.4)
    assert controller.robot.travel_of(controller.robot.target) == stood_m
