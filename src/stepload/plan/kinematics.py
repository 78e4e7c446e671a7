"""Kinematics of an arm: a file of its Denavit–Hartenberg parameters.

Six files come with stepload, in the folder `arms`; a lab writes one for an arm of its own. They are
read as strictly as a plan: every quantity with its unit, no key that means nothing.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import (
    Angle,
    Length,
    Name,
    Offset,
    Quantity,
    Remark,
    Torque,
    Version,
)
from stepload.declaration.sections import SECTION, key, put
from stepload.errors import BadInputError, guess, printable
from stepload.plan.model import Plan
from stepload.plan.problems import Problem
from stepload.plan.reader import read_file
from stepload.plan.references import names_a_file
from stepload.plan.shelf import ARMS, Disk, shipped_names
from stepload.plan.source import Source
from stepload.plan.tree import Place

JOINTS = 6
_JointStiffness = Annotated[float, Quantity("N m/rad", 1.0, 1e9)]
_Mass = Annotated[float, Quantity("kg", 0.0, 1e4)]


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class ArmKinematics:
    """An arm of six revolute joints, base upright; every list has one number for each joint.

    Joint i turns about z of frame i-1 by its angle and `theta`, then come d along that axis, a
    along the new x and the twist alpha about it (the standard convention).
    """

    stepload_arm: Annotated[Version, key("Version of the format.")]
    name: Annotated[Name, key("What the arm is called.")]
    source: Annotated[Remark, key("Where these numbers come from.")]
    a_m: Annotated[tuple[Offset, ...], key("Length a of each link.")]
    d_m: Annotated[tuple[Offset, ...], key("Offset d of each joint.")]
    alpha_rad: Annotated[tuple[Angle, ...], key("Twist α of each link.")]
    theta_rad: Annotated[
        tuple[Angle, ...],
        key("What is added to the angle that the arm tells of each joint."),
    ] = (0.0,) * JOINTS
    low_rad: Annotated[tuple[Angle, ...], key("Lowest angle of each joint.")]
    high_rad: Annotated[tuple[Angle, ...], key("Highest angle of each joint.")]
    joint_stiffness_n_m_per_rad: Annotated[
        tuple[_JointStiffness, ...],
        key("Torsional stiffness of each joint; joints of equal stiffness count as the same gear."),
    ]
    stiffness_source: Annotated[Remark, key("Where the joint stiffness comes from.")]
    link_radius_m: Annotated[Length, key("Half the thickness of the links.")]
    mass_kg: Annotated[tuple[_Mass, ...], key("Mass of each link.")] = ()
    centre_x_m: Annotated[tuple[Offset, ...], key("Its centre, x in the link's frame.")] = ()
    centre_y_m: Annotated[tuple[Offset, ...], key("The same, y.")] = ()
    centre_z_m: Annotated[tuple[Offset, ...], key("The same, z.")] = ()
    max_torque_n_m: Annotated[tuple[Torque, ...], key("Largest torque of each joint.")] = ()


def arms() -> tuple[str, ...]:
    """Names of the arms that come with stepload."""
    return shipped_names(ARMS)


def unknown_arm(name: str) -> tuple[str, str] | None:
    """Message and hint where `name` is neither a file's nor that of an arm that is known."""
    if names_a_file(name) or name in (known := arms()):
        return None
    return (
        f"no arm is named {printable(name)!r}",
        f"{guess(name, known)}there are {', '.join(known)}; or a FILE.yaml of its DH parameters",
    )


def settle_kinematics(plan: Plan, at: Place, problems: list[Problem]) -> None:
    """Put the path of the arm's file into the draft of a plan; a name must be one that is known.

    `at` is where the name stands: paths start at the directory of that file. The file itself is
    read only where poses are asked for; no run needs it.
    """
    name = plan.rig.arm.kinematics
    if name is None:
        return
    if problem := unknown_arm(name):
        problems.append(at.problem(f"kinematics: {problem[0]}", problem[1]))
    elif names_a_file(name):
        home = at.source.path
        put(plan.rig.arm, "kinematics", str((home.parent if home else Path()) / name))


def read_arm(name: str) -> ArmKinematics:
    """The arm of a name, or of a file.

    Raises:
        BadInputError: no such name.
        PlanError: no such file, or no arm; every problem with its place.
    """
    if problem := unknown_arm(name):
        raise BadInputError(problem[0], hint=problem[1])
    disk = Disk()
    return parse_arm(disk.file(Path(name)) if names_a_file(name) else disk.shipped(ARMS, name))


def parse_arm(source: Source) -> ArmKinematics:
    """The arm in `source`; raises as `read_arm`."""
    return read_file(ArmKinematics, source, _impossible)


def _impossible(source: Source, arm: ArmKinematics) -> Iterator[Problem]:
    needed = {
        "a": arm.a_m, "d": arm.d_m, "alpha": arm.alpha_rad, "theta": arm.theta_rad,
        "low": arm.low_rad, "high": arm.high_rad,
        "joint_stiffness": arm.joint_stiffness_n_m_per_rad,
    }  # fmt: skip
    known = {
        "mass": arm.mass_kg, "centre_x": arm.centre_x_m, "centre_y": arm.centre_y_m,
        "centre_z": arm.centre_z_m, "max_torque": arm.max_torque_n_m,
    }  # fmt: skip
    for name, numbers in (needed | known if any(known.values()) else needed).items():
        if len(numbers) != JOINTS:
            yield source.problem(
                1, 1, f"{name}: {len(numbers)} numbers, expected {JOINTS}, one for each joint",
                "mass, centre_x, centre_y, centre_z and max_torque belong together: all, or none",
            )  # fmt: skip
    if any(low >= high for low, high in zip(arm.low_rad, arm.high_rad, strict=False)):
        yield source.problem(1, 1, "low: an angle is not below that of `high`")
