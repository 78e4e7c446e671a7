"""Verdicts of plans: who goes, who is refused, and with which numbers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from stepload.contact.materials import FlatPunch
from stepload.errors import RefusedError
from stepload.feasibility.preflight import preflight_of
from stepload.feasibility.reason import PlanVerdict, Severity
from stepload.plan.load import load_plan
from stepload.plan.model import Plan

PROCEDURES = Path(__file__).resolve().parents[3] / "procedures"


@pytest.fixture(scope="module")
def sphere() -> Plan:
    return load_plan(PROCEDURES / "plastic-sphere.yaml")


def with_top(plan: Plan, top_n: float) -> Plan:
    levels = tuple(top_n * i / 6 for i in range(1, 7))
    return replace(
        plan,
        procedure=replace(plan.procedure, top_force_n=top_n, step_n=levels[0], levels_n=levels),
    )


def codes(plan: Plan, severity: str) -> set[str]:
    return {r.code for r in preflight_of(plan).reasons if r.severity == severity}


def test_what_too_few_cycles_cannot_show_is_a_note(sphere: Plan) -> None:
    def noted(**changes: object) -> list[str]:
        plan = replace(sphere, procedure=replace(sphere.procedure, **changes))  # type: ignore[arg-type]
        found = [r for r in preflight_of(plan).reasons if r.code in ("one_cycle", "no_unloading")]
        assert all(r.severity is Severity.NOTE for r in found)
        return [r.code for r in found]

    assert (sphere.procedure.cycles, sphere.procedure.unload) == (2, True)
    assert noted() == noted(cycles=3) == []
    assert noted(cycles=1) == noted(cycles=1, unload=False) == ["one_cycle"]
    assert noted(unload=False) == ["no_unloading"]


def test_the_largest_safe_force_is_the_edge(sphere: Plan) -> None:
    safe_n = preflight_of(sphere).largest_safe_force_n
    assert "top_force_above_safe_limit" not in codes(with_top(sphere, 0.99 * safe_n), "refuse")
    assert "top_force_above_safe_limit" in codes(with_top(sphere, 1.01 * safe_n), "refuse")


def test_a_top_force_below_what_the_sensor_can_find_is_refused(tmp_path: Path) -> None:
    """Nobody wrote the touch force: that it is too high is no error of the plan."""
    text = (PROCEDURES / "plastic-sphere.yaml").read_text()
    text = text.replace("payloads/", f"{PROCEDURES}/payloads/").replace("50 N", "0.5 N")
    for top_n, refused in ((2.0, True), (20.0, False)):
        path = tmp_path / f"{top_n:g}.yaml"
        path.write_text(text.replace("300 N", f"{top_n} N"))
        plan = load_plan(path)
        assert (plan.procedure.touch_force_n >= plan.procedure.levels_n[0]) == refused
        assert ("no_safe_way_to_press" in codes(plan, "refuse")) == refused


@pytest.mark.parametrize("name", ["plastic-cone", "plastic-pyramid"])
def test_tips_at_300_n_are_refused_whatever_the_plan_accepts(name: str) -> None:
    plan = load_plan(PROCEDURES / f"{name}.yaml")
    accepting = replace(plan, identify=replace(plan.identify, accept_unidentifiable="yes, really"))
    check = preflight_of(accepting)
    assert check.verdict is PlanVerdict.REFUSED
    assert check.largest_safe_force_n < check.theory.elastic_limit_n < 300.0


def test_an_unidentifiable_payload_goes_only_in_writing() -> None:
    plan = load_plan(PROCEDURES / "aluminium-sphere.yaml")
    low = with_top(plan, 0.9 * preflight_of(plan).largest_safe_force_n)
    assert "unidentifiable" in codes(low, Severity.REFUSE)
    identify = replace(low.identify, accept_unidentifiable="to show that it cannot be done")
    accepted = preflight_of(replace(low, identify=identify))
    assert accepted.verdict is PlanVerdict.WARN


def test_no_limit_no_run(sphere: Plan) -> None:
    payload = replace(sphere.payload, geometry=FlatPunch(5e-3), declared_force_limit_n=None)
    with pytest.raises(RefusedError, match="no elastic limit"):
        preflight_of(replace(sphere, payload=payload))
