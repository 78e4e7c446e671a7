"""Which arm a plan's rig names, and where its file is."""

from __future__ import annotations

from pathlib import Path

from stepload.plan.draft import put
from stepload.plan.kinematics import unknown_arm
from stepload.plan.model import Plan
from stepload.plan.problems import Problem
from stepload.plan.references import names_a_file
from stepload.plan.tree import Place


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
