"""The doubts of contact theory as preflight says them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from stepload.contact.materials import BluntTip, Material
from stepload.feasibility.domains import domain_reasons
from stepload.feasibility.preflight import preflight_of
from stepload.feasibility.reason import Reason
from stepload.feasibility.theory import theory_of
from stepload.plan.load import load_plan
from stepload.plan.model import Plan

PROCEDURES = Path(__file__).resolve().parents[3] / "procedures"
SILICONE = load_plan(PROCEDURES / "ur5e-silicone-sphere.yaml")


def with_payload(plan: Plan, **changes: Any) -> Plan:
    return replace(plan, payload=replace(plan.payload, **changes))


def reasons(plan: Plan) -> dict[str, Reason]:
    return {reason.code: reason for reason in preflight_of(plan).reasons}


def test_the_shipped_rubbers_stay_inside() -> None:
    assert list(domain_reasons(SILICONE, theory_of(SILICONE.payload))) == []


def test_a_deep_contact_is_a_warning_and_an_impossible_one_a_refusal() -> None:
    soft = Material("silicone", 0.17e6, 0.49, None)
    deep = reasons(with_payload(SILICONE, material=soft))["deep_contact"]
    assert deep.value == pytest.approx(0.42, abs=0.02)
    assert deep.severity == "warn"
    softer = Material("gel", 0.02e6, 0.49, None)
    assert reasons(with_payload(SILICONE, material=softer))["deep_contact"].severity == "refuse"


def test_ten_tip_radii_are_refused() -> None:
    plan = with_payload(SILICONE, geometry=BluntTip("cone", 1e-3))
    reason = reasons(plan)["tip_exceeded"]
    assert reason.value > 3.0
    assert reason.severity == "refuse"
    assert reason.remedy
