"""What stands in an arm's way, and what its joints can push."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from stepload.plan.kinematics import read_arm
from stepload.pose.chain import frames, jacobian, reach_m
from stepload.pose.pose_checks import GRAVITY_M_S2, clear, mobile, push_n, weight_torque_n_m

UR5E = read_arm("ur5e")
DOWN = np.array([0.0, 0.0, -1.0])
GOOD = (19.0, -111.8, -101.3, 123.1, -90.0, -71.0)


def _looked_at(joints_deg: tuple[float, ...], floor_m: float = 0.0) -> bool:
    placed = frames(UR5E, np.radians(joints_deg)[None])
    tip = placed[:, -1, :3, 3] + 0.12 * placed[:, -1, :3, 2]
    return bool(clear(UR5E, placed, tip, np.array([floor_m]))[0])


def test_a_pose_over_the_table_is_clear_and_none_that_reaches_into_it() -> None:
    assert _looked_at(GOOD)
    assert not _looked_at(GOOD, floor_m=0.6)
    elbow_down = (19.0, 20.0, 60.0, 100.0, -90.0, 0.0)
    assert not _looked_at(elbow_down)
    assert _looked_at(elbow_down, floor_m=-2.0)


def test_a_stretched_arm_and_two_axes_in_line_are_not_mobile() -> None:
    def looked_at(joints_deg: tuple[float, ...]) -> bool:
        placed = frames(UR5E, np.radians(joints_deg)[None])
        return bool(mobile(jacobian(placed, placed[:, -1, :3, 3]), reach_m(UR5E))[0])

    assert looked_at(GOOD)
    assert not looked_at((0.0, -45.0, 0.5, 10.0, -90.0, 0.0))
    assert not looked_at((0.0, -90.0, 90.0, 10.0, 1.0, 0.0))


@pytest.mark.parametrize("name", ["ur3e", "ur10e", "ur30"])
def test_the_weight_s_torque_is_the_slope_of_the_potential_energy(name: str) -> None:
    arm = read_arm(name)
    centre = np.stack([arm.centre_x_m, arm.centre_y_m, arm.centre_z_m, np.ones(6)], axis=-1)

    def energy_j(joints: np.ndarray) -> float:
        height = np.einsum("ijk,ik->ij", frames(arm, joints)[1:], centre)[:, 2]
        return float(np.sum(np.array(arm.mass_kg) * GRAVITY_M_S2 * height))

    joints = np.random.default_rng(4).uniform(-math.pi, math.pi, 6)
    slope = [
        (energy_j(joints + 1e-6 * turn) - energy_j(joints - 1e-6 * turn)) / 2e-6
        for turn in np.eye(6)
    ]
    assert weight_torque_n_m(arm, frames(arm, joints[None]))[0] == pytest.approx(slope, abs=1e-6)


def test_a_push_takes_the_first_joint_to_its_largest_torque() -> None:
    joints = np.radians([GOOD])
    placed = frames(UR5E, joints)
    tip = placed[:, -1, :3, 3] + 0.12 * placed[:, -1, :3, 2]
    j = jacobian(placed, tip)
    force = push_n(UR5E, placed, j, DOWN)[0]
    torque = weight_torque_n_m(UR5E, placed)[0] + force * (j[0, :3].T @ DOWN)
    share = np.abs(torque) / np.array(UR5E.max_torque_n_m)
    assert share.max() == pytest.approx(1.0)


def test_an_arm_that_hardly_carries_itself_pushes_nothing_and_one_without_masses_is_not_known() -> (
    None
):
    placed = frames(UR5E, np.radians([(0.0, -5.0, 5.0, -90.0, -90.0, 0.0)]))
    j = jacobian(placed, placed[:, -1, :3, 3])
    weak = replace(UR5E, max_torque_n_m=(150.0, 10.0, 10.0, 28.0, 28.0, 28.0))
    assert push_n(weak, placed, j, -DOWN)[0] == 0.0
    assert math.isnan(push_n(replace(UR5E, max_torque_n_m=()), placed, j, DOWN)[0])
