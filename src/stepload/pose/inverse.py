"""Joint angles of a pose, in closed form, for arms built like those of Universal Robots.

Such an arm turns about an upright axis, then about three parallel ones, then about two that cross
at right angles: up to eight configurations for one pose of the flange. Other arms are refused.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from stepload.errors import RefusedError
from stepload.identification.fit import FloatArray
from stepload.plan.kinematics import JOINTS, ArmKinematics

BRANCHES = 8
_TWISTS = (math.pi / 2, 0.0, 0.0, math.pi / 2, -math.pi / 2, 0.0)
_ZERO_A, _ZERO_D = (0, 3, 4, 5), (1, 2)
_TINY = 1e-9


def check_closed_form(arm: ArmKinematics) -> None:
    """Raises RefusedError where the arm is not of that kind."""
    alike = (
        all(abs(a - b) < _TINY for a, b in zip(arm.alpha_rad, _TWISTS, strict=True))
        and all(abs(arm.a_m[i]) < _TINY for i in _ZERO_A)
        and all(abs(arm.d_m[i]) < _TINY for i in _ZERO_D)
        and all(abs(arm.a_m[i]) > _TINY for i in (1, 2))
    )
    if not alike:
        raise RefusedError(
            f"the joints of {arm.name} do not follow each other as those of a Universal Robots arm "
            "do: its joint angles are not known in closed form",
            hint="alpha 90, 0, 0, 90, -90, 0 deg, a of the second and third link only, no d of "
            "these; poses of other arms are not searched",
        )


def inverse(arm: ArmKinematics, flange: FloatArray) -> FloatArray:
    """Joint angles (N, 8, 6) in rad of flange poses (N, 4, 4); NaN where there are none.

    Angles are within the ranges of the joints, as near to 0 as these allow. Where the last axis is
    parallel to the second the sixth angle is free, and the result is NaN.
    """
    made = np.full((len(flange), BRANCHES, JOINTS), np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        for branch, signs in enumerate(product((1.0, -1.0), repeat=3)):
            made[:, branch] = _branch(arm, flange, *signs)
    return _within(arm, made - np.array(arm.theta_rad))


def _branch(
    arm: ArmKinematics, flange: FloatArray, shoulder: float, wrist: float, elbow: float
) -> FloatArray:
    """Angles (N, 6) before `theta`; each sign chooses one of two solutions."""
    (_, a2, a3, *_), (d1, _, _, d4, d5, d6) = arm.a_m, arm.d_m
    n, o, a, p = (flange[:, :3, i] for i in range(4))
    x, y = (p - d6 * a)[:, 0], (p - d6 * a)[:, 1]
    q1 = np.arctan2(y, x) + shoulder * np.arccos(d4 / np.hypot(x, y)) + math.pi / 2
    c1, s1 = np.cos(q1), np.sin(q1)
    across = [s1 * each[:, 0] - c1 * each[:, 1] for each in (n, o, a)]  # third row of 1R6
    sine = np.hypot(across[0], across[1])
    sine = np.where(sine < _TINY, np.nan, sine)
    q5 = np.arctan2(wrist * sine, across[2])
    q6 = np.arctan2(-wrist * across[1], wrist * across[0])
    c5, s5, c6, s6 = np.cos(q5), np.sin(q5), np.cos(q6), np.sin(q6)

    def in_one(v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A direction in the plane of the three parallel joints."""
        return c1 * v[:, 0] + s1 * v[:, 1], v[:, 2]

    # Axes of frame 5 in that of the flange: x5 = (c6, -s6, 0), z5 = z6; those of 4 in 5:
    # x4 = (c5, 0, -s5), z4 = (0, -1, 0); d5 runs along z4.
    x5, y5 = n * c6[:, None] - o * s6[:, None], n * s6[:, None] + o * c6[:, None]
    x4 = x5 * c5[:, None] - a * s5[:, None]
    across4 = in_one(x4)
    u, v = in_one(p - d6 * a + d5 * y5)
    v = v - d1
    c3 = (u**2 + v**2 - a2**2 - a3**2) / (2.0 * a2 * a3)
    q3 = elbow * np.arccos(np.where(np.abs(c3) < 1.0 + _TINY, np.clip(c3, -1.0, 1.0), np.nan))
    q2 = np.arctan2(v, u) - np.arctan2(a3 * np.sin(q3), a2 + a3 * np.cos(q3))
    q4 = np.arctan2(across4[1], across4[0]) - q2 - q3
    return np.stack([q1, q2, q3, q4, q5, q6], axis=-1)


def _within(arm: ArmKinematics, joints_rad: FloatArray) -> FloatArray:
    """Shift each angle by whole turns into its joint's range; a pose is NaN if one cannot be."""
    low, high = np.array(arm.low_rad), np.array(arm.high_rad)
    near = np.remainder(joints_rad + math.pi, math.tau) - math.pi
    near = near + math.tau * np.where(near < low, np.ceil((low - near) / math.tau), 0.0)
    near = near - math.tau * np.where(near > high, np.ceil((near - high) / math.tau), 0.0)
    bad = ~np.all((near >= low) & (near <= high), axis=-1)
    return np.where(bad[..., None], np.nan, near)
