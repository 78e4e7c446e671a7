"""Change of a pose's stiffness over a few millimetres of travel."""

from __future__ import annotations

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.plan.kinematics import ArmKinematics
from stepload.posture.chain import Tool, frames, jacobian
from stepload.posture.inverse import inverse

TRAVELS_M = (2e-3, 2e-2)
"""Travel of a press, and of a start pose that is off."""
MOST = 0.01
"""Largest acceptable change over the first of them: a good calibration knows K_s as well."""


def changes(
    arm: ArmKinematics, stiffness: FloatArray, tool: Tool, joints_rad: FloatArray
) -> FloatArray:
    """Relative change of C_zz of poses (N, 6) when they draw back by each of `TRAVELS_M`: (N, 2).

    Along the tool's own axis, in the same arm configuration.
    """
    placed = frames(arm, joints_rad)
    contact = placed[:, -1] @ tool.matrix
    press = contact[:, :3, 2]
    here = _axial(arm, stiffness, tool, joints_rad)
    found = []
    for travel in TRAVELS_M:
        moved = placed[:, -1].copy()
        moved[:, :3, 3] -= travel * press
        ways = inverse(arm, moved)
        away = np.nan_to_num(np.max(np.abs(ways - joints_rad[:, None]), axis=-1), nan=np.inf)
        nearest = ways[np.arange(len(ways)), np.argmin(away, axis=1)]
        found.append(np.abs(_axial(arm, stiffness, tool, nearest) / here - 1.0))
    return np.stack(found, axis=-1)


def _axial(
    arm: ArmKinematics, stiffness: FloatArray, tool: Tool, joints_rad: FloatArray
) -> FloatArray:
    """C_zz (N,) along the tool's own axis."""
    placed = frames(arm, joints_rad)
    contact = placed[:, -1] @ tool.matrix
    lever = np.einsum("nij,ni->nj", jacobian(placed, contact[:, :3, 3])[:, :3], contact[:, :3, 2])
    return np.asarray(np.sum(lever**2 / stiffness, axis=-1))
