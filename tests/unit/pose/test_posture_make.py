"""A search for a rig: what it rests on, what is refused, what it says."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stepload.errors import RefusedError
from stepload.plan.calibration import CalibrationRecord, write_calibration
from stepload.plan.kinematics import read_arm
from stepload.plan.shipped import payload_folder
from stepload.pose.joint_calibration import held
from stepload.pose.rig_search import Posture, make
from stepload.pose.search import direction
from stepload.pose.text import up

SOME: dict[str, Any] = {
    "arm": None, "payload": None, "press": direction(0.0, 0.0, -1.0), "tool_m": None,
    "radius_m": (0.3, 0.6), "height_m": (0.0, 0.1), "travel_m": 0.05, "calibrations": [],
}  # fmt: skip
STRETCHED_DEG = (10.0, -60.0, 60.0, -90.0, -90.0, 0.0)


def _made(rig: str = "ur5e", **requested: Any) -> Posture:
    return make(rig, **(SOME | requested))


def _calibration(
    path: Path, joints_deg: tuple[float, ...], factor: float, **other: Any
) -> CalibrationRecord:
    """Written to `path`: K_s as the assumed joints give it, times a factor."""
    made = CalibrationRecord(
        stepload_calibration=1,
        rig="UR5e", direction="-fz", temperature_c=None, measured_on=date(2025, 3, 1),
        valid_until=date(2099, 6, 1), stiffness_n_per_m=1e5, sigma_n_per_m=1e3, msde_m=1e-6,
        force_from_n=10.0, force_to_n=100.0, joints_rad=tuple(np.radians(joints_deg).tolist()),
        tcp_position_m=(0.0, 0.0, 0.2), tcp_rotation_rad=(0.0, 0.0, 0.0),
    )  # fmt: skip
    arm = read_arm("ur5e")
    assumed = held("", made, arm).by(np.array(arm.joint_stiffness_n_m_per_rad))
    made = replace(made, stiffness_n_per_m=factor * assumed, sigma_n_per_m=0.01 * assumed)
    made = replace(made, **other)
    write_calibration(made, path)
    return made


def _rig(path: Path, text: str) -> str:
    path.write_text(f"profile: ur5e\narm: {{driver: sim}}\nforce: {{driver: sim}}\n{text}")
    return str(path)


def test_a_calibration_scales_the_joints_and_stands_beside_the_best(tmp_path: Path) -> None:
    path = tmp_path / "here.json"
    record = _calibration(path, STRETCHED_DEG, 0.8)
    assumed, found = _made(tool_m=0.2), _made(calibrations=[path])
    assert found.tool.offset == (0.0, 0.0, 0.2, 0.0, 0.0, 0.0)
    assert found.median_n_per_m == pytest.approx(0.8 * assumed.median_n_per_m)
    (row,) = found.calibrated
    assert float(row.figures.free_n_per_m) == pytest.approx(record.stiffness_n_per_m)
    assert row.measured_n_per_m == record.stiffness_n_per_m
    assert found.best[0].k_max_n_per_m > row.k_max_n_per_m
    assert found.press.k_max(record.stiffness_n_per_m) == row.k_max_n_per_m
    assert math.isnan(row.push_n)


def test_the_rig_s_own_calibration_counts_once_and_that_of_another_rig_is_told(
    tmp_path: Path,
) -> None:
    path = tmp_path / "own.json"
    _calibration(path, STRETCHED_DEG, 0.9)
    rig = _rig(tmp_path / "rig.yaml", "name: mine\nsystem_stiffness: {record: own.json}\n")
    found = _made(rig)
    assert len(found.calibrated) == len(_made(rig, calibrations=[path]).calibrated) == 1
    assert "own.json was made for the rig UR5e, this is mine." in found.remarks


def test_an_arm_of_one_s_own_is_found_beside_the_rig_file(tmp_path: Path) -> None:
    import stepload.plan.kinematics as shelf

    text = (Path(shelf.__file__).parent / "arms" / "ur5e.yaml").read_text()
    (tmp_path / "mine.yaml").write_text(text.replace("name: UR5e", "name: my arm"))
    rig = tmp_path / "rig.yaml"
    rig.write_text(
        "profile: ur5e\narm: {driver: sim, kinematics: ./mine.yaml}\nforce: {driver: sim}\n"
    )
    assert _made(str(rig)).arm.name == "my arm"


def test_a_payload_is_pressed_no_harder_than_is_safe_and_judged_at_each_pose() -> None:
    found = _made(payload=payload_folder() / "silicone-sphere.yaml")
    assert found.press.payload == "silicone sphere"
    assert found.press.top_n < 0.8 * 269.0
    assert 0.0 < found.press.secant_n_per_m < found.median_k_max_n_per_m
    stiff = _made(payload=payload_folder() / "aluminium-sphere.yaml")
    assert stiff.press.secant_n_per_m > stiff.best[0].k_max_n_per_m
    with pytest.raises(RefusedError, match="must not be pressed"):
        _made(payload=payload_folder() / "plastic-cone.yaml")


def test_a_plan_gives_its_payload_its_force_and_its_accuracy(tmp_path: Path) -> None:
    plan = tmp_path / "plan.yaml"
    plan.write_text(
        f"stepload: 1\npayload: {payload_folder()}/silicone-sphere.yaml\n"
        "rig: {profile: ur5e, arm: {driver: sim}, force: {driver: sim}}\n"
        "procedure: {top_force: 40 N, step: 10 N, surface_distance: 5 mm}\n"
        "identify: {t: 10}\n"
    )
    found = _made(payload=plan)
    assert (found.press.top_n, found.press.payload) == (40.0, "silicone sphere")
    assert found.press.told.t == 10.0


def test_a_bound_is_never_rounded_down() -> None:
    assert [up(each) for each in (1.0, 1.001, 1.0099, 1.01, 2.341)] == [
        "1.00", "1.01", "1.01", "1.01", "2.35",
    ]  # fmt: skip
