"""Bounds of the ratios where the joints are off, and how near a calibration holds."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.plan.kinematics import read_arm
from stepload.pose.chain import Tool
from stepload.pose.compliance import WRONG_BY, compliance, factors, gives_way, largest
from stepload.pose.search import TRAVELS_M, Poses, Task, changes, direction, search

UR10E = read_arm("ur10e")
STIFFNESS = np.array(UR10E.joint_stiffness_n_m_per_rad)
TOOL = Tool((0.0, 0.0, 0.12, 0.0, 0.0, 0.0), "")
DOWN = direction(0.0, 0.0, -1.0)


@pytest.fixture(scope="module")
def poses() -> Poses:
    return search(UR10E, STIFFNESS, TOOL, Task(DOWN, (0.35, 1.2), (-0.4, 0.9), 0.05, 0.0))


def test_joints_are_off_by_a_factor_either_way_and_each_by_itself() -> None:
    drawn = factors(2000)
    assert drawn.min() >= 1.0 / WRONG_BY
    assert drawn.max() <= WRONG_BY
    assert np.median(drawn) == pytest.approx(1.0, abs=0.03)
    assert np.abs(np.corrcoef(drawn.T) - np.eye(6)).max() < 0.1


def test_the_largest_ratio_is_above_nearly_all_that_joints_off_by_a_factor_have(
    poses: Poses,
) -> None:
    for index in (0, 100, 300):
        jacobian = poses.jacobian[index]
        most = largest(jacobian, STIFFNESS, DOWN)
        other = gives_way(compliance(jacobian, STIFFNESS * factors(3000, seed=9)), DOWN)
        assert 0.965 < np.mean(other.stuck_ratio <= most.stuck_ratio) < 0.985
        assert 0.965 < np.mean(other.flat_ratio <= most.flat_ratio) < 0.985
        assert most.stuck_ratio >= float(poses.figures.stuck_ratio[index])
        assert most.flat_ratio > most.stuck_ratio


def test_a_change_is_that_of_the_arm_drawn_back_the_same_way(poses: Poses) -> None:
    """Over a short way it is the slope, by joint angles that follow the tip."""
    some = slice(0, 400, 40)
    j, joints = poses.jacobian[some], poses.joints_rad[some]
    back = np.array([0.0, 0.0, TRAVELS_M[0], 0.0, 0.0, 0.0])
    turned = joints + np.linalg.solve(j, np.tile(back, (len(j), 1))[..., None])[..., 0]
    from stepload.pose.chain import frames, jacobian

    placed = frames(UR10E, turned)
    tip = placed[:, -1, :3, 3] + 0.12 * placed[:, -1, :3, 2]
    there = gives_way(compliance(jacobian(placed, tip), STIFFNESS), DOWN).free_n_per_m
    slope = np.abs(poses.figures.free_n_per_m[some] / there - 1.0)
    assert changes(UR10E, STIFFNESS, TOOL, joints)[:, 0] == pytest.approx(slope, rel=0.1, abs=2e-5)
