"""The whole search for a rig: its arm, tool, joint stiffness and poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stepload.errors import RefusedError
from stepload.feasibility.draft_plan import plan_of
from stepload.feasibility.map_grid import PROBE_N
from stepload.identification.fit import FloatArray
from stepload.plan.calibration import read_calibration
from stepload.plan.kinematics import ArmKinematics, arms, read_arm
from stepload.plan.rig import Rig
from stepload.plan.shipped import payload_folder
from stepload.pose.chain import Tool, reach_m
from stepload.pose.compliance import GivesWay, Largest, largest
from stepload.pose.gain import Press, press_of
from stepload.pose.joint_calibration import (
    Held,
    JointStiffness,
    fitted,
    held,
    read_held,
    why_not,
)
from stepload.pose.search import (
    HIGHEST,
    LARGEST_RADIUS,
    LOWEST,
    SMALLEST_RADIUS,
    Poses,
    Task,
    best,
    changes,
    search,
)

TOOL_M = 0.12
"""Assumed distance from flange to contact where none is stated."""


@dataclass(frozen=True, slots=True)
class Row:
    """One pose with its figures.

    Attributes:
        name: "1" for the best, or that of a calibration.
        tip_m: contact point in the base.
        joints_rad: (6,); `start_rad` those of the start, None of a calibration.
        figures: stiffness of the arm there.
        largest: upper bounds of the stiffening by a held contact there, for uncertain joints.
        measured_n_per_m: K_s of a calibration, None elsewhere.
        k_max_n_per_m: (34) there.
        push_n: largest push of the joints there; NaN where that is not known.
        changes: of C_zz when the arm draws back by 2 mm and 20 mm.
    """

    name: str
    tip_m: FloatArray
    joints_rad: FloatArray
    start_rad: FloatArray | None
    figures: GivesWay
    largest: Largest
    measured_n_per_m: float | None
    k_max_n_per_m: float
    push_n: float
    changes: FloatArray


@dataclass(frozen=True, slots=True)
class Posture:
    """Result of a search, and its inputs.

    Attributes:
        rig: name of the rig.
        arm, tool, task, press: the inputs.
        stiffness: joint stiffness that was used.
        poses: every pose that can be reached.
        best: the best of them, each of another place.
        calibrated: the poses of the calibrations.
        median_n_per_m: K_zz of the median pose; `median_k_max_n_per_m` is (34) there.
        remarks: further remarks.
    """

    rig: str
    arm: ArmKinematics
    tool: Tool
    task: Task
    press: Press
    stiffness: JointStiffness
    poses: Poses
    best: Sequence[Row]
    calibrated: Sequence[Row]
    median_n_per_m: float
    median_k_max_n_per_m: float
    remarks: Sequence[str]


def make(
    rig: str,
    *,
    arm: str | None,
    payload: Path | None,
    press: FloatArray,
    tool_m: float | None,
    radius_m: tuple[float, float] | None,
    height_m: tuple[float, float] | None,
    travel_m: float,
    calibrations: Sequence[Path],
) -> Posture:
    """Search poses for a rig.

    Args:
        rig: a profile that comes with stepload, or a rig file.
        arm: name or file of the arm; None: that of the rig.
        press: unit vector of the press in the base.
        tool_m: flange to contact along the flange's axis; None: the TCP of a calibration, or
            `TOOL_M`.
        radius_m, height_m: where the contact may be; None: all of it.

    Raises:
        BadInputError: one of these is invalid.
        PlanError: a file is invalid.
        RefusedError: a rig of one axis, an arm of another build, or no pose.
    """
    own = plan_of(rig, payload_folder() / "stiff-flat.yaml", PROBE_N).rig
    chain = read_arm(_arm_of(own, arm))
    known, remarks = _calibrations(own, chain, calibrations, press)
    tool = _tool(tool_m, known)
    requested = press_of(rig, payload)
    reach = reach_m(chain)
    task = Task(
        press,
        radius_m or (SMALLEST_RADIUS * reach, LARGEST_RADIUS * reach),
        height_m or (LOWEST * reach, HIGHEST * reach),
        travel_m,
        requested.top_n,
    )
    assumed = np.array(chain.joint_stiffness_n_m_per_rad)
    joints = fitted(assumed, known) if known else JointStiffness(assumed, chain.stiffness_source)
    poses = search(chain, joints.values_n_m_per_rad, tool, task)
    values, figures = joints.values_n_m_per_rad, poses.figures
    median = float(np.median(figures.free_n_per_m))
    chosen = best(poses, reach)
    rows = [
        Row(
            str(number), poses.tip_m[i], poses.joints_rad[i], poses.start_rad[i], figures.at(i),
            largest(poses.jacobian[i], values, press), None,
            requested.k_max(float(figures.free_n_per_m[i])), float(poses.push_n[i]),
            poses.changes[i],
        )
        for number, i in enumerate(chosen, 1)
    ]  # fmt: skip
    return Posture(
        own.name, chain, tool, task, requested, joints, poses, rows,
        [_calibrated(chain, values, requested, each) for each in known],
        median, requested.k_max(median), [*remarks, *joints.remarks],
    )  # fmt: skip


def _calibrated(chain: ArmKinematics, values: FloatArray, requested: Press, each: Held) -> Row:
    """A calibration's pose; (34) is that of K_s as it was measured."""
    return Row(
        each.name, each.tip_m, each.joints_rad, None, each.gives_way(values),
        largest(each.jacobian, values, each.press), each.measured_n_per_m,
        requested.k_max(each.measured_n_per_m),
        float("nan"), changes(chain, values, each.tool, each.joints_rad[None])[0],
    )  # fmt: skip


def _arm_of(rig: Rig, arm: str | None) -> str:
    if arm is not None:
        return arm
    if rig.arm.kinematics is None:
        raise RefusedError(
            f"{rig.name} does not say that it has an arm of six joints (rig.arm.kinematics): a "
            "machine of one axis has no poses to choose from",
            hint=f"an arm is named in the rig file, or with --arm: {', '.join(arms())}, or a FILE",
        )
    return rig.arm.kinematics


def _calibrations(
    rig: Rig, chain: ArmKinematics, paths: Sequence[Path], press: FloatArray
) -> tuple[list[Held], list[str]]:
    """The given calibrations and the rig's own; and remarks on them."""
    found, remarks = [read_held(path, chain, press) for path in paths], []
    own = rig.system_stiffness.record
    if own is not None and own.is_file() and own.resolve() not in {p.resolve() for p in paths}:
        record = read_calibration(own)
        if why := why_not(record, chain, press):
            remarks.append(f"{own.name}, the rig's calibration, is not used: {why}.")
        else:
            found.append(held(own.name, record, chain))
    remarks += [
        f"{each.name} was made for the rig {each.rig}, this is {rig.name}."
        for each in found
        if each.rig != rig.name
    ]
    return found, remarks


def _tool(tool_m: float | None, known: Sequence[Held]) -> Tool:
    if tool_m is not None:
        return Tool((0.0, 0.0, tool_m, 0.0, 0.0, 0.0), "--tool")
    if known:
        return known[0].tool
    return Tool((0.0, 0.0, TOOL_M, 0.0, 0.0, 0.0), "assumed")
