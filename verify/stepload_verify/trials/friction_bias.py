"""What friction costs a result that knows one number of the arm: K_s.

    python -m stepload_verify.trials.friction_bias [--poses 60]

Rigs with six axes press a smooth sphere slowly up to the top force. The secant is computed with
one K_s, calibrated without friction, or on a block with the friction of the row. Printed is the
bias of the secant at the top force in %: median and 90th percentile of its size over poses.

UR10 and UR5 stand with the tool down in poses of 4e4 to 2e5 N/m, C = J diag(1/k) J^T. Geometry:
Universal Robots, DH parameters of the CB3 series; the joint stiffnesses k are assumed, of the class
of strain-wave gears. The stiff machine is assumed too: 3.49e6 N/m along the press, 2e6 N/m across,
coupling between 0.02 and 0.2.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from math import cos, hypot, pi, radians, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stepload.rig.mount import Matrix3, Mount
from stepload.rig.world import PayloadTruth, WorldSpec
from stepload_drivers.sim.live import DEFAULT_SPEC
from stepload_drivers.sim.six_plant import SixPlant
from stepload_drivers.sim.springs import rows

FloatArray = NDArray[np.float64]

TOOL_M = 0.12
TILT = cos(radians(2.0))
LEAST_N_PER_M, MOST_N_PER_M = 4e4, 2e5
TWISTS = (pi / 2, 0.0, 0.0, pi / 2, -pi / 2, 0.0)
ARMS = {
    "UR5": (
        (-0.425, -0.39225, 0.089159, 0.10915, 0.09465, 0.0823),
        (31e3, 31e3, 31e3, 10e3, 10e3, 10e3),
    ),
    "UR10": (
        (-0.612, -0.5723, 0.1273, 0.163941, 0.1157, 0.0922),
        (67e3, 67e3, 31e3, 10e3, 10e3, 10e3),
    ),
}
"""a2, a3, d1, d4, d5, d6 in m; joint stiffnesses in N·m/rad."""
BLOCK_N_PER_M = 1e8
FRICTION = (0.1, 0.3, 0.6)
CALIBRATIONS = (None, 0.15, 0.3)
"""Friction of the block; None: no friction."""
SURFACE_M = 50e-6
STEPS = 3000


class Case(NamedTuple):
    """A kind of rig, its payload's secant at the top force, and that force."""

    arm: str
    secant_n_per_m: float
    top_n: float


CASES = (Case("UR10", 3e4, 50.0), Case("UR5", 1e5, 50.0), Case("stiff", 5e6, 300.0))


def tip_compliance(name: str, joints_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compliance (3, 3) of the tip in the frame of the tool, and its pose (4, 4)."""
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
    moves = np.array([np.cross(z, pose[:3, 3] - o) for z, o in zip(axes, origins, strict=True)])
    moves = moves @ pose[:3, :3]
    return moves.T @ np.diag(1.0 / np.array(stiffness)) @ moves, pose


def held(name: str, rng: np.random.Generator) -> Iterator[Matrix3]:
    """Draw compliances (3, 3) of one kind of rig, without end."""
    while True:
        if name == "stiff":
            coupling, angle = rng.uniform(0.02, 0.2), rng.uniform(0.0, 2.0 * pi)
            along, across = 1.0 / 3.49e6, 1.0 / 2e6
            x, y = coupling * along * np.cos(angle), coupling * along * np.sin(angle)
            yield (across, 0.0, float(x)), (0.0, across, float(y)), (float(x), float(y), along)
            continue
        joints = rng.uniform(-pi, pi, 6)
        joints[4] = rng.choice([-1, 1]) * pi / 2 + rng.normal(0.0, 0.02)
        joints[3] = rng.choice([-1, 1]) * pi / 2 - joints[1] - joints[2]
        compliance, pose = tip_compliance(name, joints)
        reach_m = hypot(*pose[:2, 3])
        if pose[2, 2] > -TILT or not 0.2 < reach_m < 1.3 or abs(pose[2, 3]) > 0.4:
            continue
        if LEAST_N_PER_M < 1.0 / compliance[2, 2] < MOST_N_PER_M:
            yield rows(0.5 * (compliance + compliance.T))


def press(compliance: Matrix3, friction: float, k: float, n: float, top_n: float) -> SixPlant:
    """A plant pressed slowly until it reads `top_n` along the press."""
    stiffness = 1.0 / compliance[2][2]
    mass = 8.0
    spec: WorldSpec = replace(
        DEFAULT_SPEC,
        payload=PayloadTruth("smooth", k, n),
        surface_m=SURFACE_M,
        system_stiffness_n_per_m=stiffness,
        system_damping_n_s_per_m=sqrt(stiffness * mass),
        effective_mass_kg=mass,
        lag_s=0.0,
        max_push_n=1e6,
    )
    mount = Mount(compliance, friction_static=friction, friction_kinetic=friction)
    plant = SixPlant(spec, mount, step_s=1e-3)
    per_step_m = top_n * (1.0 / stiffness + (top_n / k) ** (1.0 / n) / top_n) / STEPS
    target_m = SURFACE_M - per_step_m
    plant.command(0.0, target_m)
    for _ in range(300):
        plant.step()
    while plant.force_n < top_n:
        target_m += per_step_m
        plant.command(plant.time_s, target_m)
        plant.step()
    for _ in range(200):
        plant.step()
    return plant


def system_stiffness(compliance: Matrix3, friction: float | None, top_n: float) -> float:
    """K_s as a calibration on a block of this friction finds it."""
    if friction is None:
        return 1.0 / compliance[2][2]
    plant = press(compliance, friction, BLOCK_N_PER_M, 1.0, top_n)
    return plant.force_n / (plant.drive_m - SURFACE_M - plant.tip.normal_n / BLOCK_N_PER_M)


def biases(case: Case, compliance: Matrix3) -> FloatArray:
    """Bias of the secant in percent, calibrations by frictions of the payload."""
    k = case.top_n / (case.top_n / case.secant_n_per_m) ** 1.5
    calibrated = [system_stiffness(compliance, each, case.top_n) for each in CALIBRATIONS]
    found = np.empty((len(CALIBRATIONS), len(FRICTION)))
    for j, friction in enumerate(FRICTION):
        plant = press(compliance, friction, k, 1.5, case.top_n)
        force_n = plant.force_n
        true = force_n ** (1.0 / 3.0) * k ** (2.0 / 3.0)
        for i, stiffness in enumerate(calibrated):
            deformation_m = plant.drive_m - SURFACE_M - force_n / stiffness
            found[i, j] = 100.0 * (force_n / deformation_m / true - 1.0)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    print("size of the bias of the secant at the top force in %, median/90th percentile over poses")
    print(f"{'K_s from':24}{'payload mu':>12}", *(f"{case.arm:>14}" for case in CASES))
    tables = []
    for case in CASES:
        poses = held(case.arm, np.random.default_rng(asked.seed))
        tables.append(np.abs([biases(case, next(poses)) for _ in range(asked.poses)]))
    for i, block in enumerate(CALIBRATIONS):
        name = "1/C_zz, no friction" if block is None else f"block of mu {block:g}"
        for j, friction in enumerate(FRICTION):
            cells = [np.percentile(table[:, i, j], (50, 90)) for table in tables]
            shown = (f"{low:7.2f}/{high:6.2f}" for low, high in cells)
            print(f"{name:24}{friction:12g}", *shown)


if __name__ == "__main__":
    main()
