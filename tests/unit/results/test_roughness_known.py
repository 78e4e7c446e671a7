"""What a plan says of the surface, as identification takes it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from stepload.envelope.envelope import envelope_of
from stepload.plan.load import load_plan
from stepload.results.conditions import planned

PLAN = Path(__file__).parents[3] / "procedures" / "plastic-sphere.yaml"


def length_of(**changes: float | None) -> float | None:
    plan = load_plan(PLAN)
    return planned(
        envelope_of(replace(plan, payload=replace(plan.payload, **changes)))
    ).rough_length_m


def test_a_rough_sphere_has_the_length_of_the_model() -> None:
    # 1.22 σ κ^-0.16 with κ = E_eq/H √(R/σ), H = 5 Y = 350 MPa, worked out by hand.
    assert length_of() == pytest.approx(3.370e-6, rel=1e-3)
    assert length_of(micro_hardness_pa=7e8) == pytest.approx(length_of() * 2**0.16, rel=1e-6)


def test_smooth_is_said_and_nothing_is_not_smooth() -> None:
    assert length_of(roughness_m=0.0) == 0.0
    assert length_of(roughness_m=None) is None
