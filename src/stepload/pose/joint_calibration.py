"""Joint stiffness from calibrations: measured in some poses, applied to all others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stepload.errors import BadInputError
from stepload.identification.fit import FloatArray
from stepload.plan.calibration import CalibrationRecord, read_calibration
from stepload.plan.kinematics import JOINTS, ArmKinematics
from stepload.pose.chain import Tool, frames, jacobian
from stepload.pose.compliance import GivesWay, compliance, gives_way

FACTOR = 2.0
"""Factor within which assumed joint stiffness is expected to be right."""
SAME_WAY_DEG = 5.0
"""Largest difference of tool and press directions to those of a calibration."""
LEAST_SIGMA = 0.01
"""No arm is known to less than 1 % from its joints alone."""


@dataclass(frozen=True, slots=True)
class Held:
    """The pose of a calibration.

    Attributes:
        name: of its file.
        rig: that it was made for.
        joints_rad: (6,) at its start pose.
        tool: that it was made with.
        jacobian: (6, 6) at its contact point; `press` the direction of its tool, (3,).
        tip_m: its contact point in the base.
        measured_n_per_m, sigma_n_per_m: K_s.
    """

    name: str
    rig: str
    joints_rad: FloatArray
    tool: Tool
    jacobian: FloatArray
    press: FloatArray
    tip_m: FloatArray
    measured_n_per_m: float
    sigma_n_per_m: float

    def gives_way(self, stiffness: FloatArray) -> GivesWay:
        """Stiffness of the arm there, for joint stiffness (6,)."""
        return gives_way(compliance(self.jacobian, stiffness), self.press)

    def by(self, stiffness: FloatArray) -> float:
        """K_zz of the arm there in N/m, for joint stiffness (6,)."""
        return float(self.gives_way(stiffness).free_n_per_m)


def why_not(record: CalibrationRecord, arm: ArmKinematics, press: FloatArray) -> str:
    """Why a calibration cannot be used for a press of that direction; "" if it can."""
    if record.simulated:
        return "it was made in a dry run"
    if len(record.joints_rad) != JOINTS:
        return f"it tells {len(record.joints_rad)} joints where {JOINTS} are needed"
    if record.tcp_offset is None:
        return "it does not tell the TCP"
    cosine = float(np.clip(held("", record, arm).press @ press, -1.0, 1.0))
    turned = math.degrees(math.acos(cosine))
    if turned <= SAME_WAY_DEG:
        return ""
    return (
        f"z of its TCP points {turned:.0f}° away from the press (allowed {SAME_WAY_DEG:g}°), so "
        "that it was made pressing another way, or with a TCP that is turned"
    )


def read_held(path: Path, arm: ArmKinematics, press: FloatArray) -> Held:
    """The pose of the calibration in a file.

    Raises:
        PlanError: it is none.
        BadInputError: it has no joint angles, or cannot be used for a press of that direction.
    """
    record = read_calibration(path)
    if why := why_not(record, arm, press):
        raise BadInputError(
            f"{path}: this calibration says nothing of the arm's joints: {why}",
            hint="calibrate the arm itself, pressing the same way; stepload 0.1 and later keep "
            "joints and TCP",
        )
    return held(path.name, record, arm)


def held(name: str, record: CalibrationRecord, arm: ArmKinematics) -> Held:
    """The pose of a calibration, after the check of `why_not`."""
    assert record.tcp_offset is not None
    tool = Tool(record.tcp_offset, f"TCP of {name}")
    joints = np.array(record.joints_rad)
    placed = frames(arm, joints)
    contact = placed[-1] @ tool.matrix
    return Held(
        name, record.rig, joints, tool, jacobian(placed, contact[:3, 3]), contact[:3, 2],
        contact[:3, 3], record.stiffness_n_per_m, record.sigma_n_per_m,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class JointStiffness:
    """Joint stiffness and its origin.

    Attributes:
        values_n_m_per_rad: (6,).
        source: origin of the values, in words.
        remarks: remarks on it.
    """

    values_n_m_per_rad: FloatArray
    source: str
    remarks: tuple[str, ...] = ()


def fitted(values: FloatArray, calibrations: Sequence[Held]) -> JointStiffness:
    """Assumed joint stiffness (6,) times the factor that calibrations measured, a weighted mean."""
    factors = np.array([each.measured_n_per_m / each.by(values) for each in calibrations])
    sigmas = np.array([each.sigma_n_per_m / each.measured_n_per_m for each in calibrations])
    weights = np.maximum(sigmas, LEAST_SIGMA) ** -2.0
    factor = float(np.exp(np.average(np.log(factors), weights=weights)))
    names = ", ".join(each.name for each in calibrations)
    remarks = tuple(
        f"{each.name}: K_s is {own:.3g} times what the assumed joints give, more than a factor of "
        f"{FACTOR:g} away: something else than the joints gives way, or it is of another arm."
        for each, own in zip(calibrations, factors, strict=True)
        if not 1.0 / FACTOR <= own <= FACTOR
    )
    return JointStiffness(values * factor, f"assumed, times {factor:.3g} by {names}", remarks)
