"""Arms by their DH parameters: read as strictly as a plan."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest

import stepload.plan.kinematics as shelf
from stepload.errors import BadInputError
from stepload.plan.kinematics import arms, read_arm
from stepload.plan.load import load_plan
from stepload.plan.problems import PlanError
from stepload.plan.references import profiles, read_profile

WritePlan = Callable[..., Path]
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


def test_every_profile_of_such_an_arm_names_it() -> None:
    named = {name: re.search(r"kinematics: (\S+)", read_profile(name).text) for name in profiles()}
    assert {name for name, found in named.items() if found} == set(arms())
    assert all(found[1] == name for name, found in named.items() if found)


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


def test_masses_may_be_left_out_all_together(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(re.sub(r"(?m)^(mass|centre_.|max_torque): .*\n", "", TEXT))
    assert read_arm(str(path)).mass_kg == ()


def test_an_unknown_arm_is_told_with_the_nearest() -> None:
    with pytest.raises(BadInputError, match="no arm is named 'ur5'") as told:
        read_arm("ur5")
    assert "did you mean 'ur5e'?" in told.value.hint
    with pytest.raises(PlanError, match=r"none\.yaml"):
        read_arm("./none.yaml")


def test_a_rig_that_names_an_arm_that_is_not_known_is_refused(tmp_path: Path) -> None:
    root = Path(__file__).parents[3]
    text = (root / "procedures" / "plastic-sphere.yaml").read_text()
    text = text.replace("payloads/", f"{root}/procedures/payloads/")
    path = tmp_path / "plan.yaml"

    def with_arm(name: str) -> Path:
        rig = f"rig: {{profile: stvf, arm: {{kinematics: {name}}}}}"
        path.write_text(re.sub(r"(?m)^rig:.*(\n .*)*", rig, text))
        return path

    with pytest.raises(PlanError, match=r"kinematics: no arm is named 'ur5ee'"):
        load_plan(with_arm("ur5ee"))
    assert load_plan(with_arm("ur5e")).rig.arm.kinematics == "ur5e"
    assert load_plan(with_arm("./mine.yaml")).rig.arm.kinematics == str(tmp_path / "mine.yaml")
