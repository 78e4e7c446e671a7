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
    LevelAnswer,
    check_leash,
    check_levels,
    lead_m,
    leash_of,
    leash_travel,
    level_answers,
    told_force,
    uncounted_lead_m,
)
from stepload.errors import RefusedError
from stepload.plan.load import load_plan

PROCEDURES = Path(__file__).parents[3] / "procedures"
TOLD_N = 6.0 * 0.5 * (1e-3 / 0.6) ** 0.5
CASE = {"touch_force_n": 3.0, "told_n": TOLD_N, "position_resolution_m": 1e-6, "share": 0.6}


def test_the_leash_lifts_the_force_to_its_limit_on_a_rigid_surface() -> None:
    travel_m = leash_travel(60.0, 3.0, 0.5, 4e6)
    assert 3.0 + 6.0 * 0.5 + 4e6 * travel_m == pytest.approx(60.0)


def test_a_payload_is_refused_just_where_its_answer_is_lost_in_the_noise() -> None:
    leash_m = leash_travel(60.0, 3.0, 0.5, 4e6)
    assert told_force(0.5, 1e-3) == pytest.approx(TOLD_N)
    limit = LEAST_ANSWER * TOLD_N / (0.6 * leash_m)
    check_leash(leash_m, ContactLaw(1.01 * limit, 1.0, "(3)"), **CASE)
    with pytest.raises(RefusedError, match="too soft"):
        check_leash(leash_m, ContactLaw(0.99 * limit, 1.0, "(3)"), **CASE)


def near(law: ContactLaw, *levels_n: float) -> tuple[LevelAnswer, ...]:
    return level_answers(
        law, levels_n=levels_n, limit_n=60.0, band_n=1.0, noise_n=0.5, stiffness_n_per_m=4e6
    )


LEVELS = {"told_n": TOLD_N, "share": 0.6, "limit_n": 60.0}


def test_a_payload_is_refused_whose_answer_is_lost_near_a_level() -> None:
    """The leash is shortest just below the highest level: 60 N less 49 N less six sigma."""
    series = LEAST_TOP_ANSWER * TOLD_N / (0.6 * (60.0 - 49.0 - 3.0) / 4e6)
    limit = 1.0 / (1.0 / series - 1.0 / 4e6)
    softer, stiffer = (ContactLaw(share * limit, 1.0, "(3)") for share in (0.99, 1.01))
    check_levels(near(stiffer, 25.0, 50.0), **LEVELS)
    with pytest.raises(RefusedError, match=r"too soft for this rig near 50 N: 1.2 um, all that"):
        check_levels(near(softer, 25.0, 50.0), **LEVELS)
    check_levels(near(softer, 25.0), **LEVELS)


def test_a_payload_that_is_soft_at_first_is_refused_at_its_first_level() -> None:
    soft = ContactLaw(4e10, 3.0, "(3)")
    with pytest.raises(RefusedError, match="near 2 N"):
        check_levels(near(soft, 2.0, 30.0), **LEVELS)
    check_levels(near(soft, 30.0), **LEVELS)


@pytest.mark.parametrize(
    ("answer_n", "lead", "tangent", "leash"),
    [
        (15.9, 0.0, 0.1, (0.5, 1.0)),
        (8.0, 0.0, 0.1, (0.5, 1.0)),
        (5.0, 0.0, 0.1, (0.8, 1.6)),
        (4.0, 0.0, 0.1, (1.0, 2.0)),
        (1.0, 0.0, 0.1, (1.0, 2.0)),
        (5.0, 0.0, 2.5, (0.7, 1.4)),
        (5.0, 0.0, 1e9, (0.5, 1.0)),
        (10.0, 0.05, 0.1, (0.5, 1.0)),
        (10.0, 0.1, 0.1, (0.6, 1.2)),
        (16.0, 0.0, 0.1, (1.0, 1.0)),
        (16.0, 0.2, 0.1, (1.0, 1.0)),
        (16.0, 0.3, 0.1, (1.1, 1.1)),
        (16.0, 3.0, 0.1, (2.0, 2.0)),
        (16.0, 0.3, 1e9, (1.0, 1.0)),
        (80.0, 0.5, 0.1, (1.1, 1.1)),
    ],
)
def test_the_leash_is_one_of_something_rigid_and_more_where_a_soft_payload_needs_it(
    answer_n: float, lead: float, tangent: float, leash: tuple[float, float]
) -> None:
    """On a payload as stiff as `tangent` it comes to no more than a leash on a rigid one. Without
    a stop where the payload answers plainly, and in halves where it does not."""
    answers = (LevelAnswer(20.0, 1e-3, 500.0), LevelAnswer(50.0, 1e-5, answer_n))
    got = leash_of(answers, told_n=1.0, half_step_m=lead * 1e-5, tangent=tangent)
    assert got == pytest.approx(leash)
    assert got.proved <= 1.0001 or got.proved * tangent / (1.0 + tangent) <= 1.0


def test_the_lead_of_a_target_is_half_a_step_and_the_smooth_error_of_the_position() -> None:
    rig = load_plan(PROCEDURES / "plastic-sphere.yaml").rig
    system = replace(rig.system_stiffness, smooth_error_m=2e-6)
    rig = replace(rig, system_stiffness=system)
    half_m = 0.5 * rig.arm.position_resolution_m
    assert lead_m(rig) == pytest.approx(half_m + 4e-6)
    assert lead_m(rig, 3.0) == pytest.approx(half_m + 6e-6)
    assert uncounted_lead_m(rig) == pytest.approx(2e-6)


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
