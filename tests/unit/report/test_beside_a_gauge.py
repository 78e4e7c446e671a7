"""The arm's side is handed down beside a gauge: its position, and what is known of the system."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from evaluated_runs import a_preflight
from evaluated_runs import pressed as made_by_hand
from run_plans import SIM

from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.identification.verdict import judge
from stepload.plan.model import DisplacementSpec
from stepload.report.conditions import FILE, from_attachments, planned, to_bytes
from stepload.report.press_data import PressData
from stepload.report.run_data import pressed


def with_a_gauge() -> Preflight:
    plan = a_preflight().plan
    gauge = DisplacementSpec(driver=SIM, rate_hz=1000.0, resolution_m=1e-7, noise_m=5e-8)
    return preflight_of(replace(plan, rig=replace(plan.rig, displacement=gauge)))


def gauged(gain: float = 1.0) -> PressData:
    data, _ = made_by_hand(6)
    payload_m = gain * (np.maximum(data.force_n, 0.0) / 6.57e8) ** (2.0 / 3.0)
    return replace(data, gauge=True, travel_m=payload_m, arm_m=5e-3 + data.travel_m)


def test_the_conditions_of_a_gauge_hold_the_arms_side_and_are_read_back() -> None:
    conditions = planned(with_a_gauge())
    without = planned(a_preflight())
    assert conditions.arm_sources == without.sources
    assert without.arm_sources is None
    assert from_attachments({FILE: to_bytes(conditions)}) == conditions


@pytest.mark.parametrize(("gain", "fires"), [(1.0, False), (1.4, True)])
def test_a_gauge_of_a_run_is_held_against_its_arm(gain: float, fires: bool) -> None:
    found = judge(pressed(gauged(gain), planned(with_a_gauge())))
    assert any("the gauge changes by" in why for why in found.headline.why) is fires
    assert (found.headline.verdict != "identified") or not fires
