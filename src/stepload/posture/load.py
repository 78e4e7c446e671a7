"""The push that the joints of an arm can exert in a pose in addition to its own weight."""

from __future__ import annotations

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.plan.kinematics import JOINTS, ArmKinematics

GRAVITY_M_S2 = 9.81


def weight_torque_n_m(arm: ArmKinematics, placed: FloatArray) -> FloatArray:
    """Joint torques (N, 6) that carry the links' weight, base upright; frames (N, 7, 4, 4)."""
    centre = np.stack([arm.centre_x_m, arm.centre_y_m, arm.centre_z_m], axis=-1)
    where = np.einsum("nijk,ik->nij", placed[:, 1:, :3, :3], centre) + placed[:, 1:, :3, 3]
    axis, origin = placed[:, :-1, :3, 2], placed[:, :-1, :3, 3]
    torque = np.zeros((len(placed), JOINTS))
    for joint in range(JOINTS):
        for link in range(joint, JOINTS):
            up = np.cross(axis[:, joint], where[:, link] - origin[:, joint])[:, 2]
            torque[:, joint] += arm.mass_kg[link] * GRAVITY_M_S2 * up
    return torque


def push_n(
    arm: ArmKinematics, placed: FloatArray, jacobian: FloatArray, press: FloatArray
) -> FloatArray:
    """Largest push (N,) along `press` before a joint reaches its largest torque.

    NaN where torques and masses are not known. The tool's weight is neglected.
    """
    if not arm.max_torque_n_m:
        return np.full(len(placed), np.nan)
    most, held = np.array(arm.max_torque_n_m), weight_torque_n_m(arm, placed)
    lever = np.einsum("nij,i->nj", jacobian[:, :3], press)
    with np.errstate(divide="ignore"):
        left = (most - np.sign(lever) * held) / np.abs(lever)
    return np.asarray(np.clip(np.min(np.where(lever == 0.0, np.inf, left), axis=1), 0.0, None))
