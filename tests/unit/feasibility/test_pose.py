"""A stiffness holds where it was calibrated: what an open arm elsewhere makes of it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from stepload.errors import RefusedError
from stepload.feasibility.stiffness import plan_where_it_stands
from stepload.plan.load import load_plan
from stepload.plan.model import Plan, Provenance, RecordPolicy
from stepload.rig.device import ArmConfiguration

PLAN = Path(__file__).resolve().parents[3] / "procedures" / "plastic-sphere.yaml"
JOINTS = (0.1, -1.5, 1.2, -1.3, -1.57, 0.0)
TCP = (0.0, 0.0, 0.12, 0.0, 0.0, 0.0)
HERE = ArmConfiguration(JOINTS, TCP)


def at(off_rad: float, *, tcp_z_m: float = 0.12) -> ArmConfiguration:
    joints = (JOINTS[0], JOINTS[1] + off_rad, *JOINTS[2:])
    return ArmConfiguration(joints, (0.0, 0.0, tcp_z_m, 0.0, 0.0, 0.0))


def calibrated(policy: RecordPolicy = RecordPolicy.WARN) -> Plan:
    plan = load_plan(PLAN)
    stiffness = replace(
        plan.rig.system_stiffness, joints_rad=JOINTS, tcp_offset=TCP, policy=policy,
        provenance=Provenance.MEASURED,
    )  # fmt: skip
    return replace(plan, rig=replace(plan.rig, system_stiffness=stiffness))


@pytest.mark.parametrize("stands", [None, HERE, at(2.9e-3), at(math.tau), at(0.0, tcp_z_m=0.1205)])
def test_near_its_pose_and_without_a_word_the_calibration_holds(
    stands: ArmConfiguration | None,
) -> None:
    plan = calibrated(RecordPolicy.REFUSE)
    assert plan_where_it_stands(plan, stands) is plan


@pytest.mark.parametrize("stands", [at(3.1e-3), at(-0.5), at(0.0, tcp_z_m=0.13)])
def test_elsewhere_it_is_refused_where_the_policy_says_so(stands: ArmConfiguration) -> None:
    with pytest.raises(RefusedError, match="another pose than the arm stands in"):
        plan_where_it_stands(calibrated(RecordPolicy.REFUSE), stands)


def test_elsewhere_it_is_as_uncertain_as_the_joints_are_off() -> None:
    plan = calibrated()
    known = plan.rig.system_stiffness
    found = plan_where_it_stands(plan, at(0.1)).rig.system_stiffness
    assert found.provenance is Provenance.INDICATIVE
    assert found.sigma_n_per_m == pytest.approx(0.34 * known.stiffness_n_per_m)
    assert "a joint is off by 5.73°" in found.validity_problem
    far = plan_where_it_stands(plan, at(2.0)).rig.system_stiffness
    other_tool = plan_where_it_stands(plan, at(0.0, tcp_z_m=0.2)).rig.system_stiffness
    assert far.sigma_n_per_m == other_tool.sigma_n_per_m == known.stiffness_n_per_m


def test_the_run_that_measures_the_stiffness_may_stand_anywhere() -> None:
    plan = calibrated(RecordPolicy.REFUSE)
    plan = replace(plan, identify=replace(plan.identify, kind="system"))
    assert plan_where_it_stands(plan, at(1.0)) is plan
