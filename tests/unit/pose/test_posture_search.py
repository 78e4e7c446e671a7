"""The search: every pose it gives can be reached, and the best are each of another place."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from stepload.errors import RefusedError
from stepload.plan.kinematics import ArmKinematics, read_arm
from stepload.pose.chain import Tool, frames, reach_m
from stepload.pose.compliance import compliance, gives_way
from stepload.pose.pose_checks import clear
from stepload.pose.search import (
    ALIKE,
    APART,
    Poses,
    Task,
    best,
    changes,
    direction,
    search,
)

UR5E = read_arm("ur5e")
STIFFNESS = np.array(UR5E.joint_stiffness_n_m_per_rad)
STRAIGHT = Tool((0.0, 0.0, 0.12, 0.0, 0.0, 0.0), "straight")
BENT = Tool((0.05, -0.03, 0.15, 0.5, 0.2, 0.0), "bent")
DOWN = Task(direction(0.0, 0.0, -1.0), (0.3, 0.5), (0.0, 0.2), 0.05, 0.0)


def _found(tool: Tool = STRAIGHT, arm: ArmKinematics = UR5E, **task: Any) -> Poses:
    return search(arm, STIFFNESS, tool, replace(DOWN, **task))


@pytest.mark.parametrize("tool", [STRAIGHT, BENT], ids=lambda tool: tool.source)
@pytest.mark.parametrize(
    ("press", "height_m"),
    [
        ((0.0, 0.0, -1.0), 0.1),
        ((0.0, 0.0, 2.0), 0.6),
        pytest.param((3.0, 0.0, 0.0), 0.1, marks=pytest.mark.long),
        ((0.0, 1.0, -1.0), 0.1),
    ],
)
def test_joint_angles_put_the_contact_where_it_is_said_and_z_of_the_tool_along_the_press(
    tool: Tool, press: tuple[float, float, float], height_m: float
) -> None:
    along = direction(*press)
    found = _found(tool, press=along, radius_m=(0.4, 0.4), height_m=(height_m, height_m))
    for joints, back_m in ((found.joints_rad, 0.0), (found.start_rad, 0.05)):
        contact = frames(UR5E, joints)[:, -1] @ tool.matrix
        assert contact[:, :3, 3] == pytest.approx(found.tip_m - back_m * along, abs=1e-9)
        assert contact[:, :3, 2] == pytest.approx(np.tile(along, (len(joints), 1)), abs=1e-9)
    assert found.radius_m == pytest.approx(0.4)
    again = gives_way(compliance(found.jacobian, STIFFNESS), along)
    assert found.figures.free_n_per_m == pytest.approx(again.free_n_per_m)


@pytest.mark.parametrize("up", [-1.0, 1.0])
def test_start_and_contact_are_clear_and_on_the_same_way(up: float) -> None:
    press = direction(0.0, 0.0, up)
    found = _found(press=press, radius_m=(0.3, 0.6), height_m=(-0.2, 0.6))
    floor = np.minimum(0.0, found.tip_m[:, 2])
    for joints, back_m in ((found.joints_rad, 0.0), (found.start_rad, 0.05)):
        assert np.all(clear(UR5E, frames(UR5E, joints), found.tip_m - back_m * press, floor))
    assert np.abs(found.start_rad - found.joints_rad).max() < 0.7


def test_a_start_that_is_out_of_reach_or_in_the_way_refuses_the_pose() -> None:
    high = {"radius_m": (0.3, 0.3), "height_m": (0.5, 0.6)}
    near, far = _found(**high), _found(**high, travel_m=0.1)
    assert len(far.joints_rad) < len(near.joints_rad)
    assert far.refused["no straight way from the start"] > 0
    with pytest.raises(RefusedError, match="reaches no place"):
        _found(**high, travel_m=0.5)


def test_poses_whose_joints_cannot_push_the_force_are_left_out() -> None:
    wide = {"radius_m": (0.3, 0.9), "height_m": (0.0, 0.5)}
    every, strong = _found(**wide), _found(**wide, force_n=280.0)
    assert len(strong.joints_rad) < len(every.joints_rad)
    assert np.all(strong.push_n >= 280.0)
    unknown = replace(UR5E, max_torque_n_m=())
    found = _found(arm=unknown, **wide, force_n=280.0)
    assert len(found.joints_rad) == len(every.joints_rad)


def test_poses_whose_stiffness_is_another_after_a_press_are_left_out() -> None:
    wide = {"press": direction(1.0, 0.0, 0.0), "radius_m": (0.3, 0.9), "height_m": (0.4, 0.5)}
    found = _found(**wide)
    moved = changes(UR5E, STIFFNESS, STRAIGHT, found.joints_rad)
    assert moved == pytest.approx(found.changes)
    assert np.all(moved[:, 0] <= 0.01)
    assert found.refused["stiffness that changes by more than 1% over a press"] > 0


def test_the_best_are_the_stiffest_of_their_place_with_the_least_stuck_share() -> None:
    found = _found(radius_m=(0.25, 0.9), height_m=(-0.2, 0.7))
    chosen = best(found, reach_m(UR5E))
    stiffness, share = found.figures.free_n_per_m, found.figures.stuck_share
    first = chosen[0]
    assert stiffness[first] >= stiffness.max() / ALIKE
    assert share[first] <= share[stiffness >= stiffness.max() / ALIKE].min() + 1e-5
    for i, a in enumerate(chosen):
        for b in chosen[:i]:
            assert np.linalg.norm(found.tip_m[a] - found.tip_m[b]) > APART * reach_m(UR5E)
    assert len(chosen) == 5


def test_turning_plate_and_press_about_the_base_turns_only_the_first_joint() -> None:
    here = _found(press=direction(1.0, 0.0, -1.0), radius_m=(0.4, 0.4), height_m=(0.1, 0.1))
    there = _found(press=direction(0.0, 1.0, -1.0), radius_m=(0.4, 0.4), height_m=(0.1, 0.1))
    one, other = (np.sort(each.figures.free_n_per_m) for each in (here, there))
    assert one == pytest.approx(other)
