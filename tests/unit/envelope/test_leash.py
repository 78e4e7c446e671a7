"""Plans whose leash is too short for their payload or their arm are refused before they start."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from stepload.contact.power_law import ContactLaw
from stepload.envelope.envelope import envelope_of
from stepload.envelope.leash import LEAST_ANSWER, check_leash, leash_travel
from stepload.errors import RefusedError
from stepload.plan.load import load_plan

PROCEDURES = Path(__file__).parents[3] / "procedures"
CASE = {
    "touch_force_n": 3.0, "noise_n": 0.5, "period_s": 1e-3, "position_resolution_m": 1e-6,
}  # fmt: skip


def test_the_leash_lifts_the_force_to_its_limit_on_a_rigid_surface() -> None:
    travel_m = leash_travel(60.0, 3.0, 0.5, 4e6)
    assert 3.0 + 6.0 * 0.5 + 4e6 * travel_m == pytest.approx(60.0)


def test_a_payload_is_refused_just_where_its_answer_is_lost_in_the_noise() -> None:
    leash_m = leash_travel(60.0, 3.0, 0.5, 4e6)
    told_n = 6.0 * 0.5 * (1e-3 / 0.6) ** 0.5
    limit = LEAST_ANSWER * told_n / leash_m
    check_leash(leash_m, ContactLaw(1.01 * limit, 1.0, "(3)"), **CASE)
    with pytest.raises(RefusedError, match="too soft"):
        check_leash(leash_m, ContactLaw(0.99 * limit, 1.0, "(3)"), **CASE)


def test_positions_coarser_than_the_leash_are_refused() -> None:
    stiff = ContactLaw(1e8, 1.0, "(3)")
    check_leash(2.1e-6, stiff, **CASE)
    with pytest.raises(RefusedError, match="position resolutions"):
        check_leash(1.9e-6, stiff, **CASE)


def test_preflight_of_a_real_plan_asks() -> None:
    plan = load_plan(PROCEDURES / "plastic-sphere.yaml")
    assert envelope_of(plan).refusal is None
    coarse = replace(plan.rig.arm, position_resolution_m=1e-4)
    refused = envelope_of(replace(plan, rig=replace(plan.rig, arm=coarse)))
    assert "position resolutions" in str(refused.refusal)
