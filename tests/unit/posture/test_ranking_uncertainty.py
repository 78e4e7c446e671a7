"""What is left of a ranking when the joints are off, and how near a calibration holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stepload.plan.kinematics import read_arm
from stepload.posture.chain import Tool
from stepload.posture.compliance import compliance, gives_way
from stepload.posture.ranking_uncertainty import WRONG_BY, factors, largest, ranking
from stepload.posture.search import Poses, Task, direction, search
from stepload.posture.stiffness_gradient import TRAVELS_M, changes

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


def test_the_order_holds_as_the_study_has_it(poses: Poses) -> None:
    """Study: rank correlation 0.98, 5 % case 0.94; K_zz off by 0.61 to 1.55; 0.85 to 0.89 of t."""
    seen = ranking(replace(poses, jacobian=poses.jacobian[::3]), STIFFNESS, DOWN)
    assert seen is not None
    assert seen.stiffness == pytest.approx(0.98, abs=0.015)
    assert seen.stiffness_worst == pytest.approx(0.94, abs=0.03)
    assert seen.share == pytest.approx(0.88, abs=0.05)
    assert seen.off_by == pytest.approx((0.62, 1.57), abs=0.04)
    assert seen.top_tenth > 2.2


def test_too_few_poses_have_no_order(poses: Poses) -> None:
    assert ranking(replace(poses, jacobian=poses.jacobian[:9]), STIFFNESS, DOWN) is None
    assert ranking(replace(poses, jacobian=poses.jacobian[:10]), STIFFNESS, DOWN) is not None


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


def test_stiffness_changes_over_travel_as_the_study_has_it(poses: Poses) -> None:
    """Study, UR10: 0.1/0.3 % over 2 mm, 0.9/3.5 % over 20 mm."""
    two, twenty = poses.changes.T
    assert np.percentile(two, (50, 90)) == pytest.approx((1e-3, 3e-3), rel=0.5)
    assert np.percentile(twenty, (50, 90)) == pytest.approx((9e-3, 3.5e-2), rel=0.5)


def test_a_change_is_that_of_the_arm_drawn_back_the_same_way(poses: Poses) -> None:
    """Over a short way it is the slope, by joint angles that follow the tip."""
    some = slice(0, 400, 40)
    j, joints = poses.jacobian[some], poses.joints_rad[some]
    back = np.array([0.0, 0.0, TRAVELS_M[0], 0.0, 0.0, 0.0])
    turned = joints + np.linalg.solve(j, np.tile(back, (len(j), 1))[..., None])[..., 0]
    from stepload.posture.chain import frames, jacobian

    placed = frames(UR10E, turned)
    tip = placed[:, -1, :3, 3] + 0.12 * placed[:, -1, :3, 2]
    there = gives_way(compliance(jacobian(placed, tip), STIFFNESS), DOWN).free_n_per_m
    slope = np.abs(poses.figures.free_n_per_m[some] / there - 1.0)
    assert changes(UR10E, STIFFNESS, TOOL, joints)[:, 0] == pytest.approx(slope, rel=0.1, abs=2e-5)
