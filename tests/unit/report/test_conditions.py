"""Conditions of an identification: from a plan, into the record and back."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from run_plans import SIM, stvf_plan

from stepload.errors import BadInputError
from stepload.feasibility.preflight import preflight_of
from stepload.identification.lateral_coupling import Across
from stepload.plan.model import DisplacementSpec, Plan, Structure
from stepload.report.conditions import FILE, Stated, from_attachments, planned, to_bytes


def warm_plan() -> Plan:
    """A plan that says how well the temperature is known and what it does."""
    plan = stvf_plan()
    payload = replace(
        plan.payload, height_m=0.05, thermal_expansion_per_k=1e-4, modulus_change_per_k=0.004
    )
    return replace(
        plan,
        payload=payload,
        rig=replace(plan.rig, load_path_m=0.6, thermal_expansion_per_k=1e-5),
        identify=replace(plan.identify, temperature_uncertainty_k=0.5),
    )


def test_what_the_temperature_does_follows_from_lengths_and_coefficients() -> None:
    sources = planned(preflight_of(warm_plan())).sources
    assert sources.temperature_sigma_k == 0.5
    assert sources.position_m_per_k == pytest.approx(0.05 * 1e-4 + 0.6 * 1e-5)
    assert sources.modulus_per_k == 0.004


def test_a_gauge_takes_the_growth_of_the_load_path_out_of_the_chain() -> None:
    plan = warm_plan()
    gauge = DisplacementSpec(driver=SIM, rate_hz=100.0, resolution_m=1e-6)
    sources = planned(
        preflight_of(replace(plan, rig=replace(plan.rig, displacement=gauge)))
    ).sources
    assert sources.position_m_per_k == pytest.approx(0.05 * 1e-4)


def test_conditions_are_read_back_from_a_record_and_refused_where_a_key_is_missing() -> None:
    conditions = planned(preflight_of(warm_plan()))
    assert from_attachments({FILE: to_bytes(conditions)}) == conditions
    old = json.loads(to_bytes(conditions))
    del old["sources"]["modulus_per_k"]
    with pytest.raises(BadInputError, match="damaged"):
        from_attachments({FILE: json.dumps(old).encode()})


def as_arm(**stiffness: object) -> Plan:
    """A plan with a serial arm."""
    plan = stvf_plan()
    system = replace(plan.rig.system_stiffness, **stiffness)  # type: ignore[arg-type]
    arm = replace(plan.rig.arm, structure=Structure.ARM)
    return replace(plan, rig=replace(plan.rig, arm=arm, system_stiffness=system))


ACROSS = {
    "across_m_per_n": (3e-8, -1e-8), "across_sigma_m_per_n": (1e-9, 2e-9),
    "across_correlation": -0.5, "at_share": (0.1, 0.0), "share_reach": 0.15,
    "record": "calibration",
}  # fmt: skip


def test_what_the_force_across_does_is_taken_from_the_plan_and_read_back() -> None:
    conditions = planned(preflight_of(as_arm(**ACROSS)))
    assert conditions.across == Across((3e-8, -1e-8), (1e-9, 2e-9), -0.5, (0.1, 0.0), 0.15)
    assert conditions.arm
    assert from_attachments({FILE: to_bytes(conditions)}) == conditions
    stated = Across(at_share=(0.0, 0.0), stated=True)
    assert planned(preflight_of(stvf_plan())).across == stated
    assert not planned(preflight_of(stvf_plan())).arm


def test_a_run_that_measures_the_system_takes_nothing_of_it_out() -> None:
    plan = as_arm(**ACROSS)
    plan = replace(plan, identify=replace(plan.identify, kind="system"))
    assert planned(preflight_of(plan)).across == Across()


def test_a_stiffness_stated_by_hand_holds_for_the_friction_of_the_contact() -> None:
    conditions = planned(preflight_of(as_arm(**ACROSS)))
    stated = Stated(system_stiffness_n_per_m=3e6).applied(conditions).across
    assert stated == Across(at_share=(0.0, 0.0), stated=True)
    assert Stated(secant_force_n=100.0).applied(conditions).across == conditions.across


ROWS = {
    "deflection_force_n": (50.0, 300.0), "deflection_m": (1.45e-5, 8.6e-5),
    "deflection_sigma_m": (3e-7, 3e-7), "deflection_common": 0.01,
}  # fmt: skip


def with_table(pose: str = "vertical", arm_pose: str = "vertical", **more: object) -> Plan:
    """A plan with a table of the system's deflection."""
    plan = stvf_plan()
    stiffness = replace(plan.rig.system_stiffness, pose=pose, **{**ROWS, **more})  # type: ignore[arg-type]
    arm = replace(plan.rig.arm, pose=arm_pose)
    return replace(plan, rig=replace(plan.rig, system_stiffness=stiffness, arm=arm))


def test_a_table_of_this_pose_is_taken_with_what_its_rows_have_in_common() -> None:
    sources = planned(preflight_of(with_table(smooth_length_n=40.0))).sources
    assert sources.deflection_force_n == ROWS["deflection_force_n"]
    assert sources.deflection_m == ROWS["deflection_m"]
    assert sources.deflection_sigma_m == ROWS["deflection_sigma_m"]
    assert sources.system_stiffness_sigma_n_per_m == pytest.approx(0.01 * 3.49e6)
    assert (sources.system_stiffness_note, sources.smooth_length_n) == ("", 40.0)


@pytest.mark.parametrize(
    "plan",
    [
        with_table(deflection_force_n=(), deflection_m=(), deflection_sigma_m=()),
        with_table(arm_pose="lateral_force"),
        with_table(arm_pose=""),
        with_table(pose=""),
        with_table(validity_problem="expired on 2025-03-31"),
    ],
)
def test_without_a_valid_table_of_this_pose_k_s_is_known_as_stated(plan: Plan) -> None:
    sources = planned(preflight_of(plan)).sources
    assert (sources.deflection_force_n, sources.deflection()) == ((), None)
    stated = plan.rig.system_stiffness.sigma_n_per_m
    assert sources.system_stiffness_sigma_n_per_m == pytest.approx(stated)
    assert sources.system_stiffness_note == ""
    assert "no_deflection_table" in {reason.code for reason in preflight_of(plan).reasons}


def test_a_gauge_needs_neither_table_nor_k_s() -> None:
    plan = with_table()
    gauge = DisplacementSpec(driver=SIM, rate_hz=100.0, resolution_m=1e-6)
    plan = replace(plan, rig=replace(plan.rig, displacement=gauge))
    sources = planned(preflight_of(plan)).sources
    assert (sources.deflection_force_n, sources.system_stiffness_note) == ((), "")
    assert not [r for r in preflight_of(plan).reasons if "deflection_table" in r.code]


def test_a_table_goes_into_the_record_and_back() -> None:
    conditions = planned(preflight_of(with_table(smooth_length_n=40.0)))
    assert from_attachments({FILE: to_bytes(conditions)}) == conditions
