"""Arms by their DH parameters: read as strictly as a plan."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

import stepload.plan.kinematics as shelf
from stepload.plan.kinematics import arms, read_arm
from stepload.plan.problems import PlanError

TEXT = (Path(shelf.__file__).parent / "arms" / "ur5e.yaml").read_text()


@pytest.mark.parametrize("name", arms())
def test_the_arms_that_come_with_stepload_say_what_is_published_and_what_is_assumed(
    name: str,
) -> None:
    arm = read_arm(name)
    assert arm.alpha_rad == pytest.approx((math.pi / 2, 0, 0, math.pi / 2, -math.pi / 2, 0))
    assert "Universal Robots" in arm.source
    assert "assumed" in arm.stiffness_source
    assert name.upper() == arm.name.upper()
    assert sum(arm.mass_kg) > 5.0


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("link_radius: 60 mm", "link_radius: 60", "60 has no unit"),
        ("link_radius: 60 mm", "link_radius: -60 mm", "out of range"),
        ("link_radius: 60 mm", "link_radius: 60 kg", "is a mass"),
        ("link_radius:", "link_raduis:", "unknown key 'link_raduis'"),
        ("name: UR5e\n", "", "missing key 'name'"),
        ("stepload_arm: 1", "stepload_arm: 2", "not accepted"),
        ("alpha: [90 deg,", "alpha: [", "alpha: 5 numbers, expected 6"),
        ("mass: [3.761 kg, ", "mass: [", "mass: 5 numbers"),
        ("max_torque: [150 N m, 150 N m, 150 N m, 28 N m, 28 N m, 28 N m]\n", "", "max_torque: 0"),
        ("\na: [0 m,", "\na: [.nan m,", "is not a number with a unit"),
        ("3.1e4 N m/rad, 1.0e4", "0 N m/rad, 1.0e4", "out of range"),
        ("3.1e4 N m/rad, 1.0e4", "3.1e4 N m, 1.0e4", "is a torque, not"),
        ("high: [360 deg,", "high: [-360 deg,", "not below"),
    ],
)
def test_what_is_wrong_in_an_arm_s_file_is_told(
    tmp_path: Path, old: str, new: str, told: str
) -> None:
    path = tmp_path / "arm.yaml"
    assert TEXT.count(old) == 1
    path.write_text(TEXT.replace(old, new))
    with pytest.raises(PlanError, match=re.escape(told)):
        read_arm(str(path))
