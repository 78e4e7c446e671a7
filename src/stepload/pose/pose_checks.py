"""Whether a pose can be used: collisions, singular poses, the push that its joints can exert.

Kept simple, and no substitute for looking. Links are lines between the frames of the joints, as
thick as `link_radius` says. The real ones stand beside these lines.
"""

from __future__ import annotations

import numpy as np

from stepload.identification.fit import BoolArray, FloatArray
from stepload.plan.kinematics import JOINTS, ArmKinematics

GRAVITY_M_S2 = 9.81
ON_A_LINK = 5
"""Number of points that are checked on each link."""
LEAST_SPREAD = 0.03
"""Least ratio of the smallest to the largest gain of the joints on the tip's motion, lengths in
units of the reach. An arm that is stretched, folded or has two axes in line is below it and cannot
move in every direction."""


def clear(
    arm: ArmKinematics, placed: FloatArray, tip_m: FloatArray, floor_m: FloatArray
) -> BoolArray:
    """Whether poses (N,) are free of collisions: frames (N, 7, 4, 4), tips (N, 3), as booleans.

    Elbow, forearm and wrist stay above the table, the plane through the lower of base and plate;
    forearm and wrist stay clear of the base's column, and wrist and tool of the upper arm.
    """
    points = np.concatenate([placed[..., :3, 3], tip_m[:, None, :]], axis=1)
    thick = arm.link_radius_m
    above = np.all(points[:, 2:6, 2] > floor_m[:, None] + thick, axis=1)
    forearm_on = _on_links(points[:, 2:])
    wrist_on = _on_links(points[:, 3:])
    off_base = _distance(forearm_on, points[:, 0], points[:, 1]) > 2.0 * thick
    off_upper = _distance(wrist_on, points[:, 1], points[:, 2]) > 2.0 * thick
    return np.asarray(above & off_base & off_upper)


def _on_links(points: FloatArray) -> FloatArray:
    """Points along the lines between (N, M, 3): (N, (M-1)·ON_A_LINK, 3)."""
    share = np.linspace(0.0, 1.0, ON_A_LINK)[:, None]
    lines = points[:, :-1, None] + share * (points[:, 1:, None] - points[:, :-1, None])
    return lines.reshape(len(points), -1, 3)


def _distance(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Least distance of points (N, M, 3) from the lines start–end (N, 3) each."""
    along = (end - start)[:, None, :]
    length = np.maximum(np.sum(along**2, axis=-1), 1e-18)
    share = np.clip(np.sum((points - start[:, None]) * along, axis=-1) / length, 0.0, 1.0)
    away = points - start[:, None] - share[..., None] * along
    return np.asarray(np.min(np.linalg.norm(away, axis=-1), axis=1))


def mobile(jacobian: FloatArray, reach_m: float) -> BoolArray:
    """Whether the tip of poses (N, 6, 6) can move in every direction, as booleans."""
    scaled = jacobian / np.array([reach_m] * 3 + [1.0] * 3)[:, None]
    gains = np.linalg.svd(scaled, compute_uv=False)
    return np.asarray(gains[:, -1] > LEAST_SPREAD * gains[:, 0])


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
