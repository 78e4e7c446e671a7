"""Joint angles in closed form, against the frames they must give."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from stepload.errors import RefusedError
from stepload.plan.kinematics import arms, read_arm
from stepload.pose.chain import frames
from stepload.pose.inverse import check_closed_form, inverse

UR5E = read_arm("ur5e")


@pytest.mark.parametrize("name", arms())
def test_all_ways_to_hold_an_arm_give_the_pose_and_one_is_the_one_that_made_it(name: str) -> None:
    arm = replace(read_arm(name), theta_rad=(0.1, -0.2, 0.3, 0.0, 0.5, -1.0))
    joints = np.random.default_rng(5).uniform(-math.pi, math.pi, (500, 6))
    flange = frames(arm, joints)[:, -1]
    ways = inverse(arm, flange)
    known = np.isfinite(ways[..., 0])
    wrong = np.abs(frames(arm, ways)[..., -1, :, :] - flange[:, None])[known]
    assert wrong.max() < 1e-9
    off = np.abs(np.remainder(ways - joints[:, None] + math.pi, math.tau) - math.pi).max(axis=-1)
    assert np.nanmin(off, axis=1).max() < 1e-6
    assert np.mean(known) > 0.8


def test_what_is_out_of_reach_has_no_angles() -> None:
    far = np.eye(4)[None].copy()
    far[0, 0, 3] = 1.2
    assert np.all(np.isnan(inverse(UR5E, far)))
    on_the_axis = np.diag([1.0, -1.0, -1.0, 1.0])[None].copy()
    assert np.all(np.isnan(inverse(UR5E, on_the_axis)))


def test_angles_stay_in_the_ranges_of_the_joints_by_whole_turns() -> None:
    joints = np.array([[0.3, -1.2, 1.4, 0.5, 1.0, 0.7]])
    flange = frames(UR5E, joints)[:, -1]
    high = replace(UR5E, low_rad=(1.0, *UR5E.low_rad[1:]), high_rad=(7.0, *UR5E.high_rad[1:]))
    ways = inverse(high, flange)[0]
    assert np.all((ways[:, 0] >= 1.0) & (ways[:, 0] <= 7.0))
    assert np.any(np.abs(ways[:, 0] - 0.3 - math.tau) < 1e-9)
    low = replace(UR5E, low_rad=(-7.0, *UR5E.low_rad[1:]), high_rad=(-1.0, *UR5E.high_rad[1:]))
    assert np.any(np.abs(inverse(low, flange)[0][:, 0] - 0.3 + math.tau) < 1e-9)
    narrow = replace(UR5E, low_rad=(0.0, *UR5E.low_rad[1:]), high_rad=(0.5, *UR5E.high_rad[1:]))
    kept = inverse(narrow, flange)[0]
    known = np.isfinite(kept[:, 0])
    assert 0 < np.sum(known) < 8
    assert np.all(kept[known, 0] == pytest.approx(0.3))
    assert np.all(np.isnan(kept[~known]))


@pytest.mark.parametrize(
    "change",
    [
        {"alpha_rad": (0.0, 0.0, 0.0, math.pi / 2, -math.pi / 2, 0.0)},
        {"a_m": (0.1, -0.4, -0.4, 0.0, 0.0, 0.0)},
        {"a_m": (0.0, -0.4, 0.0, 0.0, 0.0, 0.0)},
        {"d_m": (0.1, 0.1, 0.0, 0.1, 0.1, 0.1)},
    ],
)
def test_an_arm_of_another_build_is_refused(change: dict[str, tuple[float, ...]]) -> None:
    check_closed_form(UR5E)
    with pytest.raises(RefusedError, match="closed form"):
        check_closed_form(replace(UR5E, **change))
