"""What every level needs for an interval: it hangs on the rig, not on the payload."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from stepload.feasibility.preflight import Preflight, derive, preflight_of
from stepload.feasibility.reason import PlanVerdict, Severity
from stepload.feasibility.until import MARGIN, Need, Until, until_of
from stepload.plan.checks import LEAST_LEVELS
from stepload.plan.load import load_plan
from stepload.plan.model import Plan

PROCEDURES = Path(__file__).resolve().parents[3] / "procedures"
LEVELS = tuple(50.0 * (i + 1) for i in range(6))


@pytest.fixture(scope="module")
def plan() -> Plan:
    plan = load_plan(PROCEDURES / "plastic-sphere.yaml")
    return replace(plan, procedure=replace(plan.procedure, until=0.15))


@pytest.fixture(scope="module")
def preflight(plan: Plan) -> Preflight:
    return preflight_of(plan)


@pytest.fixture(scope="module")
def wanting(plan: Plan) -> Preflight:
    """Of a plan that asks for more than theory expects."""
    return preflight_of(asking(plan, 0.05))


def softer(plan: Plan, factor: float) -> Plan:
    """The plan with a payload that deforms `factor` times as much."""
    materials = [
        replace(body, youngs_modulus_pa=body.youngs_modulus_pa / factor**1.5)
        for body in (plan.payload.material, plan.payload.plate)
    ]
    payload = replace(
        plan.payload, material=materials[0], plate=materials[1], declared_force_limit_n=727.0
    )
    return replace(plan, payload=payload)


def asking(plan: Plan, until: float | None) -> Plan:
    return replace(plan, procedure=replace(plan.procedure, until=until))


def told(preflight: Preflight) -> tuple[Need, ...]:
    assert preflight.until is not None
    return preflight.until.needs


def needs(plan: Plan, preflight: Preflight) -> tuple[Need, ...]:
    found = until_of(plan, preflight.theory)
    assert found is not None
    return found.needs


def needed(plan: Plan) -> tuple[Need, ...]:
    return needs(plan, derive(plan))


def test_a_payload_with_just_that_deformation_has_just_that_interval(
    plan: Plan, preflight: Preflight
) -> None:
    top = told(preflight)[-1]
    found = needed(softer(plan, top.needed_m / top.expected_m))[-1]
    assert found.half_width == pytest.approx(0.15, rel=0.02)
    assert found.expected_m == pytest.approx(found.needed_m, rel=0.02)
    # without the margin: a half width that is smaller by it is what the sources alone give
    least = softer(plan, top.least_m / top.expected_m)
    assert needed(least)[-1].half_width / MARGIN == pytest.approx(0.15, rel=0.02)


def test_what_is_needed_hangs_on_the_rig_and_not_on_the_payload(
    plan: Plan, preflight: Preflight
) -> None:
    soft = needed(softer(plan, 2.0))
    for one, other in zip(told(preflight)[3:], soft[3:], strict=True):
        assert other.expected_m == pytest.approx(2.0 * one.expected_m, rel=0.01)
        assert other.needed_m == pytest.approx(one.needed_m, rel=0.05)
        assert other.least_m == pytest.approx(one.least_m, rel=0.05)


def test_where_the_deflection_table_has_no_rows_more_deformation_is_needed(
    preflight: Preflight,
) -> None:
    assert preflight.until is not None
    remarked = [bool(preflight.until.conditions.table_remarks(level)) for level in LEVELS]
    assert remarked[0]
    assert not remarked[-1]
    assert all(math.isfinite(need.needed_m) for need in preflight.until.needs)


def test_the_expected_level_is_the_first_that_is_enough_and_never_too_early(
    preflight: Preflight,
) -> None:
    assert preflight.until is not None
    until = preflight.until
    place = until.expected
    assert place is not None
    assert until.needs[place].expected_m >= until.needs[place].needed_m
    assert until.needs[place - 1].expected_m < until.needs[place - 1].needed_m
    easy = tuple(replace(need, needed_m=0.0) for need in until.needs)
    assert Until(0.15, easy, until.conditions).expected == LEAST_LEVELS - 1


def test_what_theory_does_not_expect_is_said_before_anything_moves(wanting: Preflight) -> None:
    found = wanting
    (reason,) = [each for each in found.reasons if each.code == "until_not_expected"]
    assert reason.severity is Severity.WARN
    assert reason.limit == 0.05
    assert reason.value > 0.05
    assert found.verdict is PlanVerdict.WARN


def test_what_no_deformation_can_reach_is_refused(plan: Plan) -> None:
    force = replace(plan.rig.force, gain_uncertainty=0.1)
    crooked = replace(asking(plan, 0.05), rig=replace(plan.rig, force=force))
    found = preflight_of(crooked)
    assert [each.severity for each in found.reasons if each.code == "until_impossible"] == [
        Severity.REFUSE
    ]
    assert found.verdict is PlanVerdict.REFUSED
