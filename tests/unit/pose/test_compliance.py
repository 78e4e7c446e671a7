"""How an arm gives way, against springs that can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.plan.kinematics import read_arm
from stepload.pose.chain import Tool, frames, jacobian
from stepload.pose.compliance import compliance, gives_way

DOWN = np.array([0.0, 0.0, -1.0])


def _arm(seed: int, many: int) -> np.ndarray:
    arm = read_arm("ur10e")
    joints = np.random.default_rng(seed).uniform(-3.0, 3.0, (many, 6))
    placed = frames(arm, joints)
    contact = placed[:, -1] @ Tool((0.0, 0.0, 0.12, 0.0, 0.0, 0.0), "").matrix
    return compliance(
        jacobian(placed, contact[:, :3, 3]), np.array(arm.joint_stiffness_n_m_per_rad)
    )


def test_one_lever_gives_way_by_its_length_squared() -> None:
    j = np.zeros((6, 6))
    j[2, 0], j[4, 0] = 0.5, 1.0  # a joint about y with the tip 0.5 m away
    j[0, 1], j[1, 2], j[3, 3], j[5, 4] = 0.1, 0.1, 1.0, 1.0
    j[4, 5] = 1e-3
    found = gives_way(compliance(j, np.full(6, 1e4)), DOWN)
    assert found.free_n_per_m == pytest.approx(1e4 / 0.25)
    assert found.stuck_n_per_m == pytest.approx(1e4 / 0.25)
    assert found.tilt_rad_per_n == pytest.approx(0.5 * 1.0 / 1e4)
    assert found.sideways == pytest.approx(0.0)
    assert found.stuck_share == pytest.approx(0.0)


def test_two_springs_at_an_angle_couple_as_worked_out() -> None:
    c = np.diag([2e-6, 3e-6, 4e-6, 1e-4, 1e-4, 1e-4])
    c[0, 2] = c[2, 0] = 1e-6
    found = gives_way(c, DOWN)
    assert found.free_n_per_m == pytest.approx(1.0 / 4e-6)
    assert found.sideways == pytest.approx(0.25)
    assert found.stuck_share == pytest.approx(0.5)
    assert found.stuck_n_per_m == pytest.approx(1.0 / (4e-6 - 1e-12 / 2e-6))
    assert found.stuck_ratio == pytest.approx(4.0 / 3.5)


@pytest.mark.parametrize("press", [DOWN, np.array([1.0, 0.0, 0.0]), np.array([0.6, 0.0, 0.8])])
def test_figures_are_those_of_the_inverted_matrices(press: np.ndarray) -> None:
    for c in _arm(1, 40):
        found = gives_way(c, press)
        inverse = np.linalg.inv(c[:3, :3])
        held = inverse @ press
        assert found.stuck_n_per_m == pytest.approx(press @ held, rel=1e-6)
        aside = held - (press @ held) * press
        assert found.stuck_share == pytest.approx(np.linalg.norm(aside) / (press @ held), rel=1e-6)
        assert found.flat_n_per_m == pytest.approx(
            press @ np.linalg.inv(c)[:3, :3] @ press, rel=1e-4
        )
        turned = c[3:, :3] @ press
        tipped = np.linalg.norm(turned - (turned @ press) * press)
        assert found.tilt_rad_per_n == pytest.approx(tipped)
        moved = c[:3, :3] @ press
        aside = np.linalg.norm(moved - (moved @ press) * press)
        assert found.sideways == pytest.approx(aside / (press @ moved))
