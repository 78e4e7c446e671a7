"""Runs that are put together, and how their arms stood."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import pytest

from stepload.errors import BadInputError
from stepload.report.calibration import common_pose
from stepload.report.run_record import SavedRun
from stepload.rig.device import ArmConfiguration
from stepload.rig.pose import to_texts

JOINTS = (0.1, -1.5, 1.2, -1.3, -1.57, 0.0)
TCP = (0.0, 0.0, 0.12, 0.0, 0.0, 0.5)
NOTHING = cast(Any, None)


def run(joints: tuple[float, ...] | None = JOINTS) -> SavedRun:
    told = to_texts(ArmConfiguration(joints, TCP)) if joints else {}
    return SavedRun(Path("run.mcap"), NOTHING, NOTHING, told, partial=False)


def moved(off_rad: float) -> SavedRun:
    return run((JOINTS[0] + off_rad, *JOINTS[1:]))


def test_a_calibration_holds_where_its_runs_were_made() -> None:
    assert common_pose([run(), moved(2e-3)]) == {
        "joints_rad": JOINTS, "tcp_position_m": TCP[:3], "tcp_rotation_rad": TCP[3:],
    }  # fmt: skip


@pytest.mark.parametrize(
    ("other", "said"),
    [(moved(4e-3), "the arm stood elsewhere"), (run(None), "not all runs tell how the arm stood")],
)
def test_runs_of_two_poses_make_no_calibration(other: SavedRun, said: str) -> None:
    with pytest.raises(BadInputError, match=said):
        common_pose([run(), other])
