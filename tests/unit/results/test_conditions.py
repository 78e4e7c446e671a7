"""Conditions of an identification: from a plan, into the record and back."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from run_plans import SIM, stvf_plan

from stepload.envelope.envelope import envelope_of
from stepload.plan.model import DisplacementSpec, Plan
from stepload.results.conditions import FILE, from_attachments, planned, to_bytes


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
    sources = planned(envelope_of(warm_plan())).sources
    assert sources.temperature_sigma_k == 0.5
    assert sources.position_m_per_k == pytest.approx(0.05 * 1e-4 + 0.6 * 1e-5)
    assert sources.modulus_per_k == 0.004


def test_a_gauge_takes_the_growth_of_the_load_path_out_of_the_chain() -> None:
    plan = warm_plan()
    gauge = DisplacementSpec(SIM, 100.0, 1e-6)
    sources = planned(envelope_of(replace(plan, rig=replace(plan.rig, displacement=gauge)))).sources
    assert sources.position_m_per_k == pytest.approx(0.05 * 1e-4)


def test_a_plan_that_says_nothing_of_temperature_has_none_in_its_budget() -> None:
    sources = planned(envelope_of(stvf_plan())).sources
    known = (sources.temperature_sigma_k, sources.position_m_per_k, sources.modulus_per_k)
    assert known == (0.0, 0.0, 0.0)


def test_conditions_are_read_back_from_a_record_also_from_one_that_knew_no_temperature() -> None:
    conditions = planned(envelope_of(warm_plan()))
    assert from_attachments({FILE: to_bytes(conditions)}) == conditions
    old = json.loads(to_bytes(planned(envelope_of(stvf_plan()))))
    for key in ("temperature_sigma_k", "position_m_per_k", "modulus_per_k"):
        del old["sources"][key]
    found = from_attachments({FILE: json.dumps(old).encode()})
    assert found == planned(envelope_of(stvf_plan()))
