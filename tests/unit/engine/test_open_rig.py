"""Devices of a plan are what the plan says, or are closed again."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from stepload.engine.open_rig import opened
from stepload.errors import DeviceError
from stepload.feasibility.preflight import preflight_of
from stepload.plan.load import load_plan
from stepload.plan.model import Alignment, Plan

PLAN = Path(__file__).resolve().parents[3] / "procedures" / "plastic-sphere.yaml"


def _with_rates(arm_hz: float, force_hz: float) -> Plan:
    plan = load_plan(PLAN)
    world = f"rates {arm_hz:g} {force_hz:g}"
    arm = replace(plan.rig.arm, driver="sim", options={"world": world, "rate": arm_hz})
    force = replace(plan.rig.force, driver="sim", options={"world": world, "rate": force_hz})
    return replace(plan, rig=replace(plan.rig, arm=arm, force=force))


@pytest.mark.parametrize(
    ("arm_hz", "force_hz", "named"),
    [(500.0, 1000.0, "rig.arm"), (2000.0, 1000.0, "rig.arm"), (1000.0, 500.0, "rig.force")],
)
def test_a_device_with_another_rate_than_planned_is_refused(
    arm_hz: float, force_hz: float, named: str
) -> None:
    with (
        pytest.raises(DeviceError, match=f"{named} runs at [0-9e+.]+ Hz, the plan says 1000 Hz"),
        opened(preflight_of(_with_rates(arm_hz, force_hz)), dry_run=False),
    ):
        pass


def test_an_arm_that_does_not_tell_where_it_is_held_is_not_used(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("stepload_drivers.sim.arm.WorldArm.held_m", lambda _: math.nan)
    with (
        pytest.raises(DeviceError, match="does not tell where its controller holds it"),
        opened(preflight_of(_with_rates(1000.0, 1000.0)), dry_run=False),
    ):
        pass


@pytest.mark.parametrize("dry_run", [True, False])
def test_an_arm_that_cannot_go_sideways_is_known_before_it_moves(dry_run: bool) -> None:
    """The simulated rig has one axis unless the plan gives it a mount."""
    plan = _with_rates(1000.0, 1000.0)
    plan = replace(plan, procedure=replace(plan.procedure, alignment=Alignment()))
    with (
        pytest.raises(DeviceError, match="can go across its approach, and this one cannot"),
        opened(preflight_of(plan), dry_run=dry_run),
    ):
        pass
