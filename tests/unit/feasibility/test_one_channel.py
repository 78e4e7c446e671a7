"""A second channel that is the first one once more is refused, with the reason."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from stepload.feasibility.preflight import preflight_of, refusal_of
from stepload.feasibility.reason import PlanVerdict, Severity
from stepload.feasibility.reasons import one_channel_reasons, same_device
from stepload.plan.load import load_plan
from stepload.plan.model import ForceSpec, Plan, SecondForce, SecondForceSource

PROCEDURES = Path(__file__).resolve().parents[3] / "procedures"
HOST = {"host": "192.168.1.10"}
BOX = {"host": "192.168.1.1", "port": 49152, "http_port": 80}
CAN = {"interface": "socketcan", "channel": "can0", "base": 32}


@pytest.fixture(scope="module")
def plan() -> Plan:
    return load_plan(PROCEDURES / "demo-wire.yaml")


Named = tuple[str, dict[str, Any]]


def sensor(plan: Plan, named: Named) -> ForceSpec:
    return replace(plan.rig.force, driver=named[0], options=named[1])


def with_channels(plan: Plan, first: Named, second: Named | None) -> Plan:
    """`second` None: the arm's own force."""
    force = sensor(plan, first)
    channel = (
        SecondForce(SecondForceSource.ARM, tolerance_n=11.0)
        if second is None
        else SecondForce(SecondForceSource.SENSOR, tolerance_n=11.0, sensor=sensor(plan, second))
    )
    return replace(plan, rig=replace(plan.rig, force=force, second_force=channel))


def said(plan: Plan) -> list[str]:
    reasons = list(one_channel_reasons(plan))
    assert all(r.severity is Severity.REFUSE for r in reasons)
    assert all(r.code == "channels_are_one" and r.remedy for r in reasons)
    return [r.message for r in reasons]


def test_the_arms_own_sensor_is_no_second_channel_beside_itself(plan: Plan) -> None:
    own = with_channels(plan, ("ur_force", HOST), None)
    assert len(said(own)) == 1
    preflight = preflight_of(own)
    assert preflight.verdict is PlanVerdict.REFUSED
    assert "second_force.source: none" in refusal_of(preflight).message


def test_the_arms_own_sensor_alone_or_as_the_second_channel_is_sound(plan: Plan) -> None:
    own_sensor, own = ("ati_net", BOX), ("ur_force", HOST)
    alone = with_channels(plan, own, None)
    alone = replace(alone, rig=replace(alone.rig, second_force=SecondForce()))
    assert said(alone) == []
    assert said(with_channels(plan, own_sensor, own)) == []
    assert said(with_channels(plan, own_sensor, None)) == []


@pytest.mark.parametrize(
    ("name", "first", "second", "same"),
    [
        ("ati_net", BOX, {**BOX, "http_port": 8080}, True),
        ("ati_net", BOX, {**BOX, "host": "192.168.1.2"}, False),
        ("ur_force", HOST, {**HOST, "range": 20.0}, True),
        ("ati_can", CAN, {**CAN, "calibration": 3}, True),
        ("ati_can", CAN, {**CAN, "base": 33}, False),
        ("line_serial", {"port": "a", "unit": "N"}, {"port": "a", "unit": "kN"}, True),
        ("line_serial", {"port": "a", "unit": "N"}, {"port": "b", "unit": "N"}, False),
        ("sim", {}, {}, False),
    ],
)
def test_one_device_named_twice(plan: Plan, name, first, second, same) -> None:
    choices = (name, first), (name, second)
    assert same_device(*(sensor(plan, each) for each in choices)) is same
    assert len(said(with_channels(plan, *choices))) == same
