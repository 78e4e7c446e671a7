"""Plans whose leash is too short for their payload or their arm are refused before they start."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from stepload.contact.power_law import ContactLaw
from stepload.envelope.envelope import derive, envelope_of
from stepload.envelope.leash import (
    LEAST_ANSWER,
    LEAST_TOP_ANSWER,
    check_leash,
    check_levels,
    leash_travel,
)
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


LEVELS = {
    "levels_n": (25.0, 50.0), "limit_n": 60.0, "band_n": 1.0, "noise_n": 0.5, "period_s": 1e-3,
    "stiffness_n_per_m": 4e6,
}  # fmt: skip


def test_a_payload_is_refused_whose_answer_is_lost_near_a_level() -> None:
    """The leash is shortest just below the highest level: 60 N less 49 N less six sigma."""
    told_n = LEAST_TOP_ANSWER * 6.0 * 0.5 * (1e-3 / 0.6) ** 0.5
    series = told_n / ((60.0 - 49.0 - 3.0) / 4e6)
    limit = 1.0 / (1.0 / series - 1.0 / 4e6)
    check_levels(ContactLaw(1.01 * limit, 1.0, "(3)"), **LEVELS)
    with pytest.raises(RefusedError, match=r"too soft for this rig near 50 N: 2 um, all that"):
        check_levels(ContactLaw(0.99 * limit, 1.0, "(3)"), **LEVELS)
    check_levels(ContactLaw(0.99 * limit, 1.0, "(3)"), **(LEVELS | {"levels_n": (25.0,)}))


def test_a_payload_that_is_soft_at_first_is_refused_at_its_first_level() -> None:
    soft = ContactLaw(3.7e10, 3.0, "(3)")
    with pytest.raises(RefusedError, match="near 2 N"):
        check_levels(soft, **(LEVELS | {"levels_n": (2.0, 30.0)}))
    check_levels(soft, **(LEVELS | {"levels_n": (30.0,)}))


def test_preflight_of_a_plan_asks_at_its_levels() -> None:
    """The same soft payload: at 300 N of an F_lim of 313 N, and with more room above."""
    plan = load_plan(PROCEDURES / "plastic-sphere.yaml")
    material = replace(plan.payload.material, youngs_modulus_pa=1e6, yield_strength_pa=None)
    for limit_n, found in ((345.0, "too soft for this rig near 300 N"), (400.0, "None")):
        payload = replace(plan.payload, material=material, declared_force_limit_n=limit_n)
        assert found in str(derive(replace(plan, payload=payload)).refusal)


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
