"""Geometry of a serial arm: its frames, and the motion of its tip per joint angle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from stepload.errors import DomainError
from stepload.identification.fit import FloatArray
from stepload.plan.kinematics import JOINTS, ArmKinematics
from stepload.rig.samples import SixFloats

LONGEST_TOOL_M = 2.0


@dataclass(frozen=True, slots=True)
class Tool:
    """What is mounted between the flange and the contact point.

    Attributes:
        offset: the contact point from the flange, in the form of a TCP: x, y, z in m, rotation
            vector in rad. The tool presses along z of that frame.
        source: origin of that value, in words.
    """

    offset: SixFloats
    source: str

    def __post_init__(self) -> None:
        if not np.all(np.isfinite(self.offset)):
            raise DomainError(f"the tool {self.offset} has a number that is not finite")
        if np.linalg.norm(self.offset[:3]) > LONGEST_TOOL_M:
            raise DomainError(f"the tool is longer than {LONGEST_TOOL_M:g} m")

    @property
    def matrix(self) -> FloatArray:
        """The contact frame in the flange's, shape (4, 4)."""
        made = np.eye(4)
        made[:3, :3] = Rotation.from_rotvec(self.offset[3:]).as_matrix()
        made[:3, 3] = self.offset[:3]
        return made

    @property
    def on_axis(self) -> bool:
        """Whether turning the flange about its own axis does not move the contact."""
        m = self.matrix
        return bool(np.hypot(m[0, 3], m[1, 3]) < 1e-9 and m[2, 2] > 1.0 - 1e-12)


def frames(arm: ArmKinematics, joints_rad: FloatArray) -> FloatArray:
    """The base and the frame behind each joint, in the base: (..., 6) angles to (..., 7, 4, 4)."""
    angle = joints_rad + np.array(arm.theta_rad)
    made = np.zeros((*angle.shape[:-1], JOINTS + 1, 4, 4))
    made[..., 0, :, :] = np.eye(4)
    for i in range(JOINTS):
        c, s = np.cos(angle[..., i]), np.sin(angle[..., i])
        ca, sa = np.cos(arm.alpha_rad[i]), np.sin(arm.alpha_rad[i])
        link = np.zeros((*angle.shape[:-1], 4, 4))
        link[..., 0, 0], link[..., 0, 1], link[..., 0, 2] = c, -s * ca, s * sa
        link[..., 1, 0], link[..., 1, 1], link[..., 1, 2] = s, c * ca, -c * sa
        link[..., 2, 1], link[..., 2, 2], link[..., 3, 3] = sa, ca, 1.0
        link[..., 0, 3], link[..., 1, 3], link[..., 2, 3] = (
            arm.a_m[i] * c,
            arm.a_m[i] * s,
            arm.d_m[i],
        )
        made[..., i + 1, :, :] = made[..., i, :, :] @ link
    return made


def jacobian(placed: FloatArray, tip_m: FloatArray) -> FloatArray:
    """Motion of a point of the last link per joint angle: frames (..., 7, 4, 4) to (..., 6, 6).

    Rows are three translations in m/rad and three rotations, both in the base; `tip_m` (..., 3).
    """
    axis, origin = placed[..., :-1, :3, 2], placed[..., :-1, :3, 3]
    moved = np.cross(axis, tip_m[..., None, :] - origin)
    return np.swapaxes(np.concatenate([moved, axis], axis=-1), -1, -2)


def reach_m(arm: ArmKinematics) -> float:
    """Sum of the lengths a of the links: about the arm's reach from its base's axis."""
    return float(np.sum(np.abs(arm.a_m)))
