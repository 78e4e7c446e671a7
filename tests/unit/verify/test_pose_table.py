"""The table of tool-down poses, beside that of the study it follows (its grid was another one)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from stepload.posture.chain import reach_m
from stepload_verify.trials import pose_table
from stepload_verify.trials.pose_table import arm_of, branches, down, rows


class Study(NamedTuple):
    """Section 1 of the study: pairs are median and 90th percentile."""

    k_zz_n_per_m: tuple[float, float, float]
    sideways: tuple[float, float]
    tilt_rad_per_n: tuple[float, float]
    stuck_ratio: tuple[float, float]
    flat_ratio: tuple[float, float]
    stiffest: float


STUDY = {
    "UR3": Study(
        (5.5e4, 13e4, 29e4), (0.63, 1.3), (35e-6, 69e-6), (1.36, 3.3), (3.3, 7.1), 4.5
    ),
    "UR5": Study(
        (4.5e4, 9.3e4, 26e4), (0.33, 0.86), (23e-6, 45e-6), (1.16, 2.4), (2.9, 8.3), 4.5
    ),
    "UR10": Study(
        (3.4e4, 6.3e4, 19e4), (0.36, 0.88), (27e-6, 47e-6), (1.17, 2.6), (2.5, 7.5), 5.8
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", STUDY)
def test_arms_give_way_as_the_study_has_it(name: str) -> None:
    told, poses = STUDY[name], down(arm_of(name))
    figures, pair = poses.figures, (50, 90)
    stiffness = figures.free_n_per_m
    assert np.percentile(stiffness, (10, 50, 90)) == pytest.approx(told.k_zz_n_per_m, rel=0.15)
    assert np.percentile(figures.sideways, pair) == pytest.approx(told.sideways, rel=0.25)
    assert np.percentile(figures.tilt_rad_per_n, pair) == pytest.approx(
        told.tilt_rad_per_n, rel=0.31
    )
    assert np.percentile(figures.stuck_ratio, pair) == pytest.approx(told.stuck_ratio, rel=0.1)
    assert np.percentile(figures.flat_ratio, pair) == pytest.approx(told.flat_ratio, rel=0.16)
    assert np.median(figures.stuck_share) == pytest.approx(0.42, abs=0.05)
    assert stiffness.max() / np.median(stiffness) == pytest.approx(told.stiffest, rel=0.15)
    share = poses.radius_m / reach_m(arm_of(name))
    near, middle, far = (
        np.median(stiffness[(share > low) & (share < high)])
        for low, high in ((0.3, 0.45), (0.5, 0.7), (0.8, 1.2))
    )
    assert near > 1.6 * middle > 3.0 * far
    assert np.percentile(branches(poses), pair) == pytest.approx((1.45, 3.05), rel=0.2)


@pytest.mark.long
def test_every_line_of_the_table_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pose_table, "DRAWN", 40)
    found = dict(rows("ur16e"))
    assert len(found) == 18
    assert 1.0 < float(found["the same, joints drawn at random"].split("/")[0]) < 2.0
