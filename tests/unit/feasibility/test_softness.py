"""Payloads so soft that a sound run is slow, or near its end by a rule, are named beforehand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from stepload.feasibility.preflight import preflight_of
from stepload.feasibility.reason import Reason, Severity
from stepload.plan.load import load_plan
from stepload.plan.model import Plan, SecondForce

PROCEDURES = Path(__file__).resolve().parents[3] / "procedures"
CODES = {"one_channel_soft", "search_short", "slow_steps"}


@pytest.fixture(scope="module")
def sphere() -> Plan:
    return load_plan(PROCEDURES / "plastic-sphere.yaml")


def _softer(plan: Plan, factor: float) -> Plan:
    material = plan.payload.material
    material = replace(material, youngs_modulus_pa=material.youngs_modulus_pa / factor)
    payload = replace(plan.payload, material=material, declared_force_limit_n=727.0)
    return replace(plan, payload=payload)


def _warnings(plan: Plan) -> dict[str, Reason]:
    found = {r.code: r for r in preflight_of(plan).reasons if r.code in CODES}
    assert all(
        r.severity is Severity.WARN and r.remedy and r.value == r.value for r in found.values()
    )
    return found


def test_shipped_plans_for_sound_rigs_are_not_called_soft() -> None:
    for name in ("plastic-sphere", "ur5e-silicone-sphere", "ur16e-polyurethane-sphere"):
        assert not _warnings(load_plan(PROCEDURES / f"{name}.yaml"))


def test_a_search_that_ends_before_a_soft_payload_answers(sphere: Plan) -> None:
    soft = _softer(sphere, 1000.0)
    shorter = replace(sphere.procedure, search_distance_m=2.05e-3)
    assert "search_short" not in _warnings(replace(sphere, procedure=shorter))
    reason = _warnings(replace(soft, procedure=shorter))["search_short"]
    assert reason.value > reason.limit == 2.05e-3


@pytest.mark.parametrize(("factor", "warned"), [(1.0, False), (1e5, True)])
def test_a_soft_payload_with_one_channel_is_warned_of_and_not_refused(
    sphere: Plan, factor: float, warned: bool
) -> None:
    alone = replace(sphere, rig=replace(sphere.rig, second_force=SecondForce()))
    assert "one_channel_soft" not in _warnings(_softer(sphere, factor))
    found = _warnings(_softer(alone, factor))
    assert ("one_channel_soft" in found) == warned
    if warned:
        reason, limits = found["one_channel_soft"], preflight_of(_softer(alone, factor)).run_limits
        most_n = 50.0 + limits.stiffness_n_per_m * limits.travel_m(50.0)
        assert reason.value == pytest.approx(most_n)
        assert reason.limit == limits.used_limit_n < reason.value
