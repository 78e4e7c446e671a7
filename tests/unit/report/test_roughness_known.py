"""What a plan says of the surface, as identification takes it."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from evaluated_runs import pressed

from stepload.errors import BadInputError
from stepload.feasibility.preflight import preflight_of
from stepload.identification.conditions import ROUGH_LENGTH_SIGMA, Conditions
from stepload.plan.load import load_plan
from stepload.report.analyse import identify_payload
from stepload.report.conditions import FILE, from_attachments, planned, to_bytes

PLAN = Path(__file__).parents[3] / "procedures" / "plastic-sphere.yaml"


def conditions_of(**changes: float | None) -> Conditions:
    plan = load_plan(PLAN)
    return planned(preflight_of(replace(plan, payload=replace(plan.payload, **changes))))


def length_of(**changes: float | None) -> float | None:
    return conditions_of(**changes).rough_length_m


def sigma_of(**changes: float | None) -> float:
    return conditions_of(**changes).rough_length_sigma


def test_a_rough_sphere_has_the_length_of_the_model() -> None:
    # 1.22 σ κ^-0.16 with κ = E_eq/H √(R/σ), H = 5 Y = 350 MPa, worked out by hand.
    assert length_of() == pytest.approx(3.370e-6, rel=1e-3)
    assert length_of(micro_hardness_pa=7e8) == pytest.approx(length_of() * 2**0.16, rel=1e-6)


def test_smooth_is_said_and_nothing_is_not_smooth() -> None:
    assert length_of(roughness_m=0.0) == 0.0
    assert length_of(roughness_m=None) is None


def test_what_is_stated_of_roughness_and_hardness_is_how_well_the_length_is_known() -> None:
    # 1.22 σ κ^-0.16 goes with σ^1.08 and H^0.16.
    assert sigma_of() == sigma_of(roughness_m=None) == ROUGH_LENGTH_SIGMA
    assert sigma_of(roughness_m=2e-6, roughness_sigma_m=2e-7) == ROUGH_LENGTH_SIGMA
    assert sigma_of(roughness_m=2e-6, roughness_sigma_m=8e-7) == pytest.approx(1.08 * 0.4)
    both = {"micro_hardness_pa": 4e8, "micro_hardness_sigma_pa": 4e8}
    assert sigma_of(roughness_m=2e-6, roughness_sigma_m=8e-7, **both) == pytest.approx(
        math.hypot(1.08 * 0.4, 0.16)
    )
    # The same by the lengths themselves.
    more, less = (length_of(roughness_m=2e-6 * f) for f in (1.001, 0.999))
    assert math.log(more / less) / 0.002 == pytest.approx(1.08, rel=1e-3)


def test_a_record_keeps_how_well_it_is_known() -> None:
    told = conditions_of(roughness_m=2e-6, roughness_sigma_m=8e-7)
    kept = json.loads(to_bytes(told))
    assert from_attachments({FILE: to_bytes(told)}) == told
    for wrong in (0.0, -0.1, "0.4", None, math.inf):
        spoiled = json.dumps(kept | {"rough_length_sigma": wrong}).encode()
        with pytest.raises(BadInputError, match="rough_length_sigma"):
            from_attachments({FILE: spoiled})


def test_the_identification_of_a_run_takes_it() -> None:
    data, _ = pressed(6)
    told = conditions_of()
    for sigma in (0.2, 0.5):
        found = identify_payload(data, replace(told, rough_length_sigma=sigma))
        assert found.run.conditions.rough_length_sigma == sigma
