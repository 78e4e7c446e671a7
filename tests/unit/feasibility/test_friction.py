"""What preflight says of friction at the contact of an arm."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from run_plans import preflight_for, stvf_plan

from stepload.feasibility.bounds import LEAST_CLASS_RATIO
from stepload.feasibility.conditions import (
    ARM_MISALIGNMENT_RAD,
    UNKNOWN_OFFSET_M,
    conditions_of,
    gauge_offset_of,
    misalignment_of,
)
from stepload.feasibility.reason import Severity
from stepload.identification.lateral import TURN_RAD_PER_N
from stepload.plan.model import DisplacementSpec, Plan, Provenance, Structure

CODES = {"friction_unknown"}


def plan_with(structure: Structure = Structure.ARM, **stiffness: Any) -> Plan:
    plan = stvf_plan()
    system = replace(plan.rig.system_stiffness, stuck_ratio=1.2, **stiffness)
    arm = replace(plan.rig.arm, structure=structure)
    return replace(plan, rig=replace(plan.rig, arm=arm, system_stiffness=system))


def said(plan: Plan) -> dict[str, Severity]:
    return {r.code: r.severity for r in preflight_for(plan).reasons if r.code in CODES}


def test_of_an_arm_whose_record_knows_no_friction_the_result_is_doubted() -> None:
    """A K_s that a person states holds for the friction of the contact."""
    recorded = plan_with(record="calibration")
    assert said(recorded) == {"friction_unknown": Severity.WARN}
    assert said(plan_with()) == {}
    stiff = replace(recorded, identify=replace(recorded.identify, kind="system"))
    assert said(stiff) == {}


def test_a_gauge_across_the_contact_does_without() -> None:
    plan = plan_with()
    gauge = DisplacementSpec(driver="sim", rate_hz=100.0, resolution_m=1e-7, noise_m=2e-8)
    assert said(replace(plan, rig=replace(plan.rig, displacement=gauge))) == {}


@pytest.mark.parametrize(
    ("stiffness", "warned"),
    [
        ({"provenance": Provenance.INDICATIVE}, True),
        ({"provenance": Provenance.INDICATIVE, "stuck_ratio": LEAST_CLASS_RATIO}, False),
        ({"provenance": Provenance.INDICATIVE, "stuck_ratio": None}, False),
        ({"provenance": Provenance.MEASURED}, False),
    ],
)
def test_a_stuck_ratio_of_one_pose_beside_a_guess_is_warned_of(
    stiffness: dict[str, Any], warned: bool
) -> None:
    plan = plan_with()
    system = replace(plan.rig.system_stiffness, **stiffness)
    plan = replace(plan, rig=replace(plan.rig, system_stiffness=system))
    told = [r for r in preflight_for(plan).reasons if r.code == "stuck_ratio_of_a_guess"]
    assert [r.severity for r in told] == [Severity.WARN] * warned
    guided = replace(plan.rig.arm, structure=Structure.MACHINE)
    plan = replace(plan, rig=replace(plan.rig, arm=guided))
    assert "stuck_ratio_of_a_guess" not in {r.code for r in preflight_for(plan).reasons}


def with_gauge(structure: Structure, offset_m: float | None) -> Plan:
    plan = plan_with(structure)
    gauge = DisplacementSpec(
        driver="sim", rate_hz=100.0, resolution_m=1e-7, noise_m=2e-8, offset_m=offset_m
    )
    return replace(plan, rig=replace(plan.rig, displacement=gauge))


def test_a_gauge_on_an_arm_counts_as_beside_the_contact_until_its_offset_is_stated() -> None:
    def notes(plan: Plan) -> list[float]:
        return [r.value for r in preflight_for(plan).reasons if r.code == "gauge_offset"]

    unknown = with_gauge(Structure.ARM, None)
    assert gauge_offset_of(unknown.rig) == UNKNOWN_OFFSET_M
    preflight = preflight_for(unknown)
    secant = preflight.theory.law.secant(preflight.plan.procedure.top_force_n)
    expected = UNKNOWN_OFFSET_M * TURN_RAD_PER_N * secant
    assert notes(unknown) == [pytest.approx(expected)]
    assert notes(with_gauge(Structure.ARM, 0.004)) == []
    assert gauge_offset_of(with_gauge(Structure.ARM, 0.004).rig) == 0.004
    assert notes(with_gauge(Structure.MACHINE, None)) == []
    assert gauge_offset_of(with_gauge(Structure.MACHINE, 0.004).rig) == 0.0
    assert gauge_offset_of(plan_with().rig) == 0.0


def test_a_sensor_counts_as_askew_on_an_arm_until_its_angle_is_stated() -> None:
    plan = plan_with()
    assert misalignment_of(plan.rig) == ARM_MISALIGNMENT_RAD
    assert misalignment_of(plan_with(Structure.MACHINE).rig) == 0.0
    square = replace(plan.rig.force, misalignment_rad=0.004)
    rig = replace(plan.rig, force=square)
    assert misalignment_of(rig) == 0.004
    told = conditions_of(replace(plan, rig=rig), preflight_for(plan).theory)
    assert told.misalignment_rad == 0.004
    assert told.yields_m_per_n == pytest.approx(1.0 / rig.system_stiffness.stiffness_n_per_m)


def test_a_calibration_with_lateral_force_leaves_no_doubt() -> None:
    assert said(plan_with(record="calibration", at_share=(0.1, 0.0))) == {}
    known = {"across_m_per_n": (3e-8, 0.0), "across_sigma_m_per_n": (1e-9, 1e-7)}
    assert said(plan_with(record="calibration", **known)) == {}
