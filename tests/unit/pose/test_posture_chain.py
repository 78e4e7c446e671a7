"""Frames and Jacobian of an arm, against known poses and finite differences."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from stepload.plan.kinematics import arms, read_arm
from stepload.pose.chain import Tool, frames, jacobian

TOOLS = (
    Tool((0.0, 0.0, 0.12, 0.0, 0.0, 0.0), "straight"),
    Tool((0.03, -0.02, 0.15, 0.4, -0.7, 0.2), "bent"),
)


def test_the_flange_of_a_ur5e_at_rest_is_where_its_maker_has_it() -> None:
    placed = frames(read_arm("ur5e"), np.zeros(6))
    assert placed[-1, :3, 3] == pytest.approx([-0.8172, -0.2329, 0.0628], abs=1e-9)
    assert placed[-1, :3, 2] == pytest.approx([0.0, -1.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("name", arms())
@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.source)
def test_the_jacobian_is_what_small_turns_of_the_joints_do(name: str, tool: Tool) -> None:
    arm = read_arm(name)
    joints = np.random.default_rng(3).uniform(-math.pi, math.pi, (20, 6))
    contact = frames(arm, joints)[:, -1] @ tool.matrix
    found = jacobian(frames(arm, joints), contact[:, :3, 3])
    step = 1e-6
    for joint in range(6):
        turn = np.zeros(6)
        turn[joint] = step
        before, after = (frames(arm, joints + s * turn)[:, -1] @ tool.matrix for s in (-1.0, 1.0))
        moved = (after[:, :3, 3] - before[:, :3, 3]) / (2.0 * step)
        rotation = after[:, :3, :3] @ np.swapaxes(before[:, :3, :3], -1, -2)
        turned = Rotation.from_matrix(rotation).as_rotvec() / (2.0 * step)
        assert found[:, :3, joint] == pytest.approx(moved, abs=1e-7)
        assert found[:, 3:, joint] == pytest.approx(turned, abs=1e-7)


def test_a_tool_that_stands_beside_the_flange_s_axis_or_is_turned_is_not_on_it() -> None:
    assert TOOLS[0].on_axis
    assert not TOOLS[1].on_axis
    assert Tool((0.0, 0.0, 0.1, 0.0, 0.0, 1.0), "").on_axis
    assert not Tool((0.0, 0.0, 0.1, 0.2, 0.0, 0.0), "").on_axis
    assert not Tool((0.001, 0.0, 0.1, 0.0, 0.0, 0.0), "").on_axis
