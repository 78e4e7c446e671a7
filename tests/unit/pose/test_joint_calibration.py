"""Joint stiffness from calibrations."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from stepload.errors import BadInputError
from stepload.plan.calibration import CalibrationRecord, write_calibration
from stepload.plan.kinematics import read_arm
from stepload.pose.joint_calibration import Held, fitted, held, read_held, why_not
from stepload.pose.search import direction

UR5E = read_arm("ur5e")
ASSUMED = np.array(UR5E.joint_stiffness_n_m_per_rad)
DOWN = direction(0.0, 0.0, -1.0)
POSES_DEG = (
    (19.0, -111.8, -101.3, 123.1, -90.0, -71.0),
    (19.0, -87.3, -131.2, -51.4, 90.0, 109.0),
    (10.0, -60.0, 60.0, -90.0, -90.0, 0.0),
)


def _record(joints_deg: tuple[float, ...], true: np.ndarray, **other: object) -> CalibrationRecord:
    made = CalibrationRecord(
        stepload_calibration=1,
        rig="UR5e", direction="-fz", temperature_c=None, measured_on=date(2025, 3, 1),
        valid_until=date(2025, 6, 1), stiffness_n_per_m=1e5, sigma_n_per_m=1e3, msde_m=1e-6,
        force_from_n=10.0, force_to_n=100.0, joints_rad=tuple(np.radians(joints_deg).tolist()),
        tcp_position_m=(0.0, 0.0, 0.12), tcp_rotation_rad=(0.0, 0.0, 0.0),
    )  # fmt: skip
    stiffness = held("", made, UR5E).by(true)
    made = replace(made, stiffness_n_per_m=stiffness, sigma_n_per_m=0.01 * stiffness)
    return replace(made, **other)  # type: ignore[arg-type]


def _held(true: np.ndarray, many: int) -> list[Held]:
    return [held(f"{i}.json", _record(p, true), UR5E) for i, p in enumerate(POSES_DEG[:many])]


def test_one_calibration_gives_one_factor_for_all_joints() -> None:
    true = ASSUMED * np.array([0.7, 1.3, 1.0, 1.2, 1.2, 1.2])
    (one,) = _held(true, 1)
    found = fitted(ASSUMED, [one])
    assert np.ptp(found.values_n_m_per_rad / ASSUMED) == pytest.approx(0.0, abs=1e-12)
    assert one.by(found.values_n_m_per_rad) == pytest.approx(one.measured_n_per_m)
    assert "0.json" in found.source
    assert found.remarks == ()


@pytest.mark.parametrize("factor", [0.4, 2.5])
def test_a_factor_that_is_not_believed_is_told(factor: float) -> None:
    found = fitted(ASSUMED, _held(factor * ASSUMED, 1))
    assert found.values_n_m_per_rad == pytest.approx(factor * ASSUMED)
    assert "something else than the joints" in found.remarks[0]


def test_several_give_one_factor_by_their_weight() -> None:
    one, other = _held(1.2 * ASSUMED, 1)[0], _held(ASSUMED, 2)[1]
    sure = replace(other, sigma_n_per_m=0.01 * other.measured_n_per_m)
    vague = replace(one, sigma_n_per_m=0.03 * one.measured_n_per_m)
    found = fitted(ASSUMED, [vague, sure])
    assert found.values_n_m_per_rad / ASSUMED == pytest.approx(np.full(6, 1.2**0.1))
    assert "0.json, 1.json" in found.source


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"simulated": True}, "dry run"),
        ({"joints_rad": ()}, "0 joints"),
        ({"joints_rad": (0.0,) * 7}, "7 joints"),
        ({"tcp_position_m": (), "tcp_rotation_rad": ()}, "TCP"),
        ({"tcp_rotation_rad": (0.0, 0.12, 0.0)}, "7° away"),
    ],
)
def test_a_calibration_that_says_nothing_of_the_joints_is_refused(
    tmp_path: Path, change: dict[str, object], why: str
) -> None:
    record = _record(POSES_DEG[0], ASSUMED, **change)
    assert why in why_not(record, UR5E, DOWN)
    path = tmp_path / "here.json"
    write_calibration(record, path)
    with pytest.raises(BadInputError, match=why):
        read_held(path, UR5E, DOWN)
