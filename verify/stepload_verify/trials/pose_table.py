"""How arms give way over their tool-down poses: the table behind `stepload pose`.

    python -m stepload_verify.trials.pose_table [--arms UR3 UR5 UR10 ur5e ...]

UR3, UR5 and UR10 are the CB3 arms (DH parameters by Universal Robots), with the joint stiffness
that is assumed for arms of their size; other names are those of `stepload pose --arm`. Tool 0.12 m,
start 50 mm above the plate, no force asked for. Figures a/b: median / 90th percentile.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.plan.kinematics import ArmKinematics, read_arm
from stepload.posture.chain import Tool, reach_m
from stepload.posture.doubt import ranking
from stepload.posture.search import (
    HIGHEST,
    LARGEST_RADIUS,
    LOWEST,
    SMALLEST_RADIUS,
    Poses,
    Task,
    direction,
    search,
)
from stepload_verify.trials.pose_stiffness import ARMS, stuck_ratios

DRAWN = 4000
TOOL = Tool((0.0, 0.0, 0.12, 0.0, 0.0, 0.0), "assumed")
CB3 = {
    "UR3": ("ur3e", (-0.24365, -0.21325), (0.1519, 0.11235, 0.08535, 0.0819)),
    "UR5": ("ur5e", (-0.425, -0.39225), (0.089159, 0.10915, 0.09465, 0.0823)),
    "UR10": ("ur10e", (-0.612, -0.5723), (0.1273, 0.163941, 0.1157, 0.0922)),
}
BANDS = ((0.3, 0.45), (0.5, 0.7), (0.8, 1.2))


def arm_of(name: str) -> ArmKinematics:
    """An arm of the CB3 series, or one that comes with stepload."""
    if name not in CB3:
        return read_arm(name)
    like, (a2, a3), (d1, d4, d5, d6) = CB3[name]
    return replace(
        read_arm(like), name=name, a_m=(0.0, a2, a3, 0.0, 0.0, 0.0),
        d_m=(d1, 0.0, 0.0, d4, d5, d6), max_torque_n_m=(),
    )  # fmt: skip


def down(arm: ArmKinematics) -> Poses:
    """Every tool-down pose of the grid."""
    reach = reach_m(arm)
    task = Task(
        direction(0.0, 0.0, -1.0), (SMALLEST_RADIUS * reach, LARGEST_RADIUS * reach),
        (LOWEST * reach, HIGHEST * reach), 0.05, 0.0,
    )  # fmt: skip
    return search(arm, np.array(arm.joint_stiffness_n_m_per_rad), TOOL, task)


def _pair(values: FloatArray) -> str:
    return "{:.2f}/{:.2f}".format(*np.percentile(values, (50, 90)))


def _drawn(name: str) -> str:
    """The stuck ratio as the profiles take it: over joints drawn at random."""
    known = {each.lower(): each for each in ARMS}
    if name not in known:
        return ""
    return _pair(stuck_ratios(known[name], DRAWN, np.random.default_rng(1)))


def branches(poses: Poses) -> FloatArray:
    """K_zz of the best way to hold the arm over that of the worst, at every place with several."""
    place = np.round(np.stack([poses.radius_m, poses.tip_m[:, 2]], axis=-1), 6)
    _, index = np.unique(place, axis=0, return_inverse=True)
    stiffness = poses.figures.free_n_per_m
    own = [stiffness[index.ravel() == i] for i in range(int(index.max()) + 1)]
    return np.array([each.max() / each.min() for each in own if len(each) > 1])


def rows(name: str) -> list[tuple[str, str]]:
    """Every line of the table for one arm."""
    arm = arm_of(name)
    poses = down(arm)
    figures, share = poses.figures, poses.radius_m / reach_m(arm)
    stiffness, median = figures.free_n_per_m, float(np.median(figures.free_n_per_m))
    seen = ranking(poses, np.array(arm.joint_stiffness_n_m_per_rad), direction(0.0, 0.0, -1.0))
    assert seen is not None
    (two, two_90), (twenty, twenty_90) = np.percentile(poses.changes, (50, 90), axis=0).T
    good = np.mean((stiffness > 1.5 * median) & (figures.stuck_share < 0.15))
    bands = [np.median(stiffness[(share > low) & (share < high)]) for low, high in BANDS]
    return [
        ("poses", str(len(stiffness))),
        (
            "K_zz, 10/50/90 % (1e4 N/m)",
            "/".join(f"{each:.3g}" for each in np.percentile(stiffness, (10, 50, 90)) / 1e4),
        ),
        ("free sideways motion over axial", _pair(figures.sideways)),
        (
            "tilt, µrad/N",
            "{:.0f}/{:.0f}".format(*np.percentile(figures.tilt_rad_per_n, (50, 90)) * 1e6),
        ),
        ("tip held sideways: K_stuck/K_zz", _pair(figures.stuck_ratio)),
        ("the same, joints drawn at random", _drawn(name)),
        ("flat tool, rotation held too", _pair(figures.flat_ratio)),
        ("stuck share", _pair(figures.stuck_share)),
        ("stiffest pose / median pose", f"{stiffness.max() / median:.1f}"),
        (
            "K_zz at 0.3-0.45, 0.5-0.7, above 0.8 of the reach (1e4 N/m)",
            ", ".join(f"{each / 1e4:.3g}" for each in bands),
        ),
        ("best over worst branch at one place", _pair(branches(poses))),
        ("K_zz > 1.5 medians and stuck share < 0.15", f"{good:.0%}"),
        ("change of C_zz over 2 mm, %", f"{100 * two:.1f}/{100 * two_90:.1f}"),
        ("change of C_zz over 20 mm, %", f"{100 * twenty:.1f}/{100 * twenty_90:.1f}"),
        ("joints off by 2: K_zz off by, 5 % to 95 %", "{:.2f} to {:.2f}".format(*seen.off_by)),
        (
            "rank correlation of K_zz, median (5 % case)",
            f"{seen.stiffness:.2f} ({seen.stiffness_worst:.2f})",
        ),
        ("rank correlation of the stuck share", f"{seen.share:.2f}"),
        ("stiffest tenth / median, 5 % case", f"{seen.top_tenth:.1f}"),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--arms", nargs="+", default=list(CB3))
    names = parser.parse_args().arms
    columns = [dict(rows(name)) for name in names]
    width = max(map(len, columns[0]))
    print(f"{'':{width}}", *(f"{name:>18}" for name in names))
    for line in columns[0]:
        print(f"{line:{width}}", *(f"{column[line]:>18}" for column in columns))


if __name__ == "__main__":
    main()
