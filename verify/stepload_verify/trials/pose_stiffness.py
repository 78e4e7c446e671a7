"""How fast the stiffness of a UR arm along its pressing direction changes with its joints, and by
how much it is stiffer while friction holds the tip sideways.

    python -m stepload_verify.trials.pose_stiffness [--poses 4000]

K_s⁻¹ = Σ ((z_i × (p − o_i)) · d)² / k_i, z_i and o_i axis and origin of joint i, p the TCP, d the
tool axis. Geometry: Universal Robots, DH parameters of the e-Series. The joint stiffnesses k_i are
assumed, those that the profiles of these arms rest on; only their ratios matter here. Poses are
drawn with the tool down within 10 degrees, in the middle of the reach. With all three directions,
C = J diag(1/k) J^T in the tool's frame, the tip held sideways has the stiffness [C^-1]_zz.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import islice
from math import cos, hypot, pi, radians

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

TOOL_M = 0.12
TILT = cos(radians(10.0))
ARMS = {
    "UR3e": ((-0.24355, -0.2132, 0.15185, 0.13105, 0.08535, 0.0921), (16, 16, 10, 4.7, 4.7, 4.7)),
    "UR5e": ((-0.425, -0.3922, 0.1625, 0.1333, 0.0997, 0.0996), (31, 31, 31, 10, 10, 10)),
    "UR10e": ((-0.6127, -0.57155, 0.1807, 0.17415, 0.11985, 0.11655), (67, 67, 31, 10, 10, 10)),
    "UR16e": ((-0.4784, -0.36, 0.1807, 0.17415, 0.11985, 0.11655), (67, 67, 31, 10, 10, 10)),
}
"""a2, a3, d1, d4, d5, d6 in m; joint stiffnesses in kN·m/rad."""
TWISTS = (pi / 2, 0.0, 0.0, pi / 2, -pi / 2, 0.0)


def compliance(name: str, joints_rad: FloatArray) -> tuple[float, FloatArray]:
    """1/K_s along the tool axis in m/N at `joints_rad` (6,), and the pose of the tip (4, 4)."""
    matrix, pose = compliances(name, joints_rad)
    return float(matrix[2, 2]), pose


def compliances(name: str, joints_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compliance (3, 3) of the tip in m/N, in the tool's frame, and the pose of the tip (4, 4)."""
    (a2, a3, d1, d4, d5, d6), stiffness = ARMS[name]
    lengths, offsets = (0.0, a2, a3, 0.0, 0.0, 0.0), (d1, 0.0, 0.0, d4, d5, d6 + TOOL_M)
    pose, axes, origins = np.eye(4), [], []
    for angle, a, d, twist in zip(joints_rad, lengths, offsets, TWISTS, strict=True):
        axes.append(pose[:3, 2])
        origins.append(pose[:3, 3])
        c, s, ct, st = np.cos(angle), np.sin(angle), cos(twist), np.sin(twist)
        pose = pose @ np.array(
            [[c, -s * ct, s * st, a * c], [s, c * ct, -c * st, a * s], [0, st, ct, d], [0, 0, 0, 1]]
        )
    tip, axis = pose[:3, 3], pose[:3, :3]
    levers_m = np.array([np.cross(z, tip - o) @ axis for z, o in zip(axes, origins, strict=True)])
    return levers_m.T @ (levers_m / (1e3 * np.array(stiffness))[:, None]), pose


def tool_down(name: str, rng: np.random.Generator) -> Iterator[FloatArray]:
    """Joints (6,) of poses with the tool down, in the middle of the reach, without end."""
    a2, a3 = ARMS[name][0][:2]
    reach_m = abs(a2) + abs(a3)
    while True:
        joints = rng.uniform(-pi, pi, 6)
        joints[4] = rng.choice([-1, 1]) * pi / 2 + rng.normal(0.0, 0.05)
        joints[3] = rng.choice([-1, 1]) * pi / 2 - joints[1] - joints[2]
        _, pose = compliance(name, joints)
        x, y, z = pose[:3, 3]
        middle = 0.3 * reach_m < hypot(x, y) < 0.95 * reach_m and -0.3 < z / reach_m < 0.6
        if pose[2, 2] <= -TILT and middle:
            yield joints


def changes_per_rad(name: str, poses: int, rng: np.random.Generator) -> FloatArray:
    """(poses,) |Δ ln K_s| per rad, all joints off by one angle the worst way round; tool down."""
    found: list[float] = []
    for joints in islice(tool_down(name, rng), poses):
        here, _ = compliance(name, joints)
        near = [compliance(name, joints + 1e-6 * joint)[0] for joint in np.eye(6)]
        found.append(float(np.sum(np.abs(np.log(near) - np.log(here)))) / 1e-6)
    return np.array(found)


def stuck_ratios(name: str, poses: int, rng: np.random.Generator) -> FloatArray:
    """(poses,) stiffness along the tool with the tip held sideways over that without."""
    matrices = [compliances(name, joints)[0] for joints in islice(tool_down(name, rng), poses)]
    return np.array([np.linalg.inv(matrix)[2, 2] * matrix[2, 2] for matrix in matrices])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=4000)
    poses = parser.parse_args().poses
    rng = np.random.default_rng(1)
    print("|change of ln K_s| per rad, all joints the worst way round: median, 90 %, 99 %, largest")
    for name in ARMS:
        found = np.percentile(changes_per_rad(name, poses, rng), (50, 90, 99, 100))
        print(f"{name:6}", *(f"{value:6.2f}" for value in found))
    print("stiffness with the tip held sideways over that without: median, 90 %, 95 %")
    for name in ARMS:
        found = np.percentile(stuck_ratios(name, poses, rng), (50, 90, 95))
        print(f"{name:6}", *(f"{value:6.2f}" for value in found))


if __name__ == "__main__":
    main()
