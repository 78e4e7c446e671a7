"""The shake that proves the force channels: within the limits, as short as it can, told or not."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import date
from typing import Any

import pytest
from run_plans import envelope_for, stvf_plan, ur_plan

from stepload.envelope.envelope import Envelope
from stepload.envelope.shake import CROSS_SHARE, FORCE_SHARE, LONGEST_S, PLANNED_HALF_WIDTH
from stepload.plan.model import Plan, SecondForce

MAKERS = [stvf_plan, ur_plan]


def with_force(plan: Plan, **changes: Any) -> Plan:
    return replace(plan, rig=replace(plan.rig, force=replace(plan.rig.force, **changes)))


def with_second(plan: Plan, **changes: Any) -> Plan:
    second = replace(plan.rig.second_force, **changes)
    return replace(plan, rig=replace(plan.rig, second_force=second))


def codes(envelope: Envelope) -> list[str]:
    return [reason.code for reason in envelope.reasons]


@pytest.mark.parametrize("mass_kg", [1.0, 3.0, 20.0])
@pytest.mark.parametrize("make", MAKERS)
def test_a_shake_keeps_what_the_arm_and_the_run_allow(make: Any, mass_kg: float) -> None:
    plan = with_force(make(), tool_mass_kg=mass_kg)
    envelope = envelope_for(plan)
    limits, shake = envelope.run_limits, envelope.telling_shake
    assert shake is not None
    near = 1.0 + 1e-9
    commanded = shake.acceleration_m_s2 / shake.follow
    inertia_n = mass_kg * commanded
    assert commanded <= near * limits.acceleration_m_s2
    assert 0.5 * shake.travel_m * shake.omega_rad_s <= near * limits.retract_speed_m_s
    assert shake.travel_m <= near * plan.procedure.retract_m
    assert inertia_n <= near * CROSS_SHARE * limits.cross_tolerance_n
    foreseen_n = inertia_n * (1.0 + shake.omega_rad_s * limits.reaction_s)
    assert foreseen_n <= near * FORCE_SHARE * limits.force_limit_n
    assert shake.duration_s <= LONGEST_S
    assert max(shake.half_widths) <= PLANNED_HALF_WIDTH
    (stage,) = [stage for stage in envelope.stages if stage.name == "prove the force channels"]
    assert stage.total_s == shake.duration_s
    assert "shake" in codes(envelope)


@pytest.mark.parametrize("make", MAKERS)
def test_noise_makes_a_shake_longer_and_then_useless(make: Any) -> None:
    durations = []
    for noise_n in (0.1, 0.7, 40.0):
        envelope = envelope_for(
            with_force(make(touch_force_n=10.0), tool_mass_kg=1.0, noise_n=noise_n)
        )
        durations.append(envelope.shake.duration_s if envelope.shake else math.nan)
        if noise_n < 1.0:
            assert envelope.telling_shake is not None
        else:
            assert envelope.telling_shake is None
    assert durations[0] < durations[1]


def test_a_shake_that_tells_nothing_says_why() -> None:
    for plan, why in (
        (with_force(ur_plan(), tool_mass_kg=0.05), "beside a noise of"),
        (
            with_force(stvf_plan(touch_force_n=20.0), tool_mass_kg=1.0, resolution_n=5.0),
            "resolution",
        ),
        (with_force(stvf_plan(retract_m=1e-5), tool_mass_kg=1.0), "lost in the arm's positions"),
    ):
        envelope = envelope_for(plan)
        (reason,) = [each for each in envelope.reasons if each.code == "shake_tells_nothing"]
        assert why in reason.message
        assert "rig.force.tool_mass" in reason.remedy
        assert envelope.telling_shake is None
        assert "prove the force channels" not in [stage.name for stage in envelope.stages]


def test_a_mass_that_cannot_be_told_does_not_keep_the_other_from_being_told() -> None:
    plan = with_second(with_force(ur_plan(), tool_mass_kg=1.0), tool_mass_kg=1.0)
    envelope = envelope_for(plan)
    assert envelope.telling_shake is not None
    assert [channel.key for channel in envelope.telling_shake.channels] == ["rig.force"]
    (reason,) = [each for each in envelope.reasons if each.code == "shake_tells_nothing"]
    assert "second force channel" in reason.message
    assert "rig.second_force.tool_mass" in reason.remedy


@pytest.mark.parametrize(("touch_n", "heavy"), [(2.4, True), (2.5, False)])
def test_a_tool_whose_inertia_passes_for_a_touch_is_told(touch_n: float, heavy: bool) -> None:
    """The arm decelerates by 1.2 m/s² at the most."""
    envelope = envelope_for(with_force(ur_plan(touch_force_n=touch_n), tool_mass_kg=2.0))
    assert ("tool_inertia" in codes(envelope)) is heavy


def test_without_a_mass_there_is_no_shake() -> None:
    envelope = envelope_for(ur_plan())
    assert envelope.shake is None
    assert not {"shake", "shake_tells_nothing"} & set(codes(envelope))
