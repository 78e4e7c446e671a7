"""What of F_c the ladder of forces may count on, and what is said about it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist
from typing import Any

import pytest

from stepload.feasibility.bounds import cross_blind_n
from stepload.feasibility.preflight import Preflight, derive
from stepload.feasibility.theory import DECLARED, chance_of_yield, theory_of
from stepload.plan.load import load_plan
from stepload.plan.model import Plan

PROCEDURES = Path(__file__).resolve().parents[3] / "procedures"
SPHERE = load_plan(PROCEDURES / "plastic-sphere.yaml")
SURE: dict[str, Any] = {
    "youngs_modulus_sigma_pa": 2.75e9 * 0.01, "poisson_ratio_sigma": 0.005,
    "yield_strength_sigma_pa": 70e6 * 0.01,
}  # fmt: skip


def pressed(top_n: float, **payload: Any) -> Preflight:
    procedure = replace(
        SPHERE.procedure, top_force_n=top_n, step_n=top_n / 5,
        levels_n=tuple(top_n * i / 5 for i in range(1, 6)),
    )  # fmt: skip
    identify = replace(SPHERE.identify, accept_unidentifiable="not what is looked at here")
    plan = replace(
        SPHERE, payload=replace(SPHERE.payload, **payload), procedure=procedure, identify=identify
    )
    return derive(plan)


def test_almost_all_of_f_c_is_refused_and_said_why() -> None:
    found = pressed(690.0)
    assert found.theory.elastic_limit_n == pytest.approx(727.0, abs=0.1)
    [reason] = [r for r in found.reasons if r.code == "top_force_above_safe_limit"]
    assert (reason.value, reason.limit) == (690.0, found.largest_safe_force_n)
    assert found.theory.counted.lower_n == pytest.approx(491.8, abs=0.1)
    assert found.limits is None


def test_every_rung_lies_below_the_lower_end() -> None:
    found = pressed(400.0)
    lower_n = found.theory.counted.lower_n
    assert lower_n == pytest.approx(491.8, abs=0.1)
    limits = found.run_limits
    assert limits.used_limit_n == lower_n
    assert limits.elastic_limit_n == found.theory.elastic_limit_n
    hidden_n = cross_blind_n(SPHERE.rig, SPHERE.rig.force.noise_n)
    assert (
        limits.force_limit_n
        == limits.allowed_n
        == pytest.approx((0.95 * lower_n - 4.0 - hidden_n - 4.5) / 1.02)
    )
    assert found.largest_safe_force_n < limits.force_limit_n < lower_n
    assert pressed(0.999 * found.largest_safe_force_n).limits is not None
    assert pressed(1.001 * found.largest_safe_force_n).limits is None


def test_what_a_person_knows_better_allows_more() -> None:
    material = replace(SPHERE.payload.material, **SURE)
    plate = replace(SPHERE.payload.plate, **(SURE | {"youngs_modulus_sigma_pa": 70e7}))
    geometry = replace(SPHERE.payload.geometry, radius_sigma_m=28.7e-6)
    found = pressed(600.0, material=material, plate=plate, geometry=geometry)
    assert found.limits is not None
    assert pressed(600.0).limits is None
    vague = replace(SPHERE.payload.material, yield_strength_sigma_pa=7e6)
    assert pressed(300.0).limits is not None
    assert pressed(400.0, material=vague).limits is None


def limits_of(**payload: Any) -> tuple[float, str, float, str]:
    theory = theory_of(replace(SPHERE.payload, **payload))
    counted = theory.counted
    return theory.elastic_limit_n, theory.limit_equation, counted.lower_n, counted.equation


def test_of_a_declared_limit_and_of_theory_the_lower_end_counts() -> None:
    theory = "(13) elastic-plastic sphere"
    lower_n = theory_of(SPHERE.payload).counted.lower_n
    assert limits_of(declared_force_limit_n=400.0) == (400.0, DECLARED, 400.0, DECLARED)
    assert limits_of(declared_force_limit_n=600.0) == (600.0, DECLARED, lower_n, theory)
    elastic_n, equation, counted_n, why = limits_of(declared_force_limit_n=4000.0)
    assert (equation, counted_n, why) == (theory, lower_n, theory)
    assert elastic_n == pytest.approx(727.0, abs=0.1)


def test_a_person_may_state_how_well_a_declared_limit_is_known() -> None:
    _, _, counted_n, why = limits_of(
        declared_force_limit_n=400.0, declared_force_limit_sigma_n=40.0
    )
    assert counted_n == pytest.approx(400.0 * math.exp(-0.2))
    assert why == DECLARED


def test_the_chance_that_a_force_yields_the_payload_is_that_of_its_limit() -> None:
    theory = theory_of(SPHERE.payload)
    counted = theory.counted
    assert chance_of_yield(SPHERE.payload, theory, counted.lower_n) == counted.probability
    assert chance_of_yield(SPHERE.payload, theory, counted.value_n) == pytest.approx(0.5, abs=1e-3)
    low = chance_of_yield(SPHERE.payload, theory, 375.0)
    assert low == pytest.approx(NormalDist().cdf(math.log(375.0 / 727.05) / 0.19543), rel=1e-2)
    declared = replace(SPHERE.payload, declared_force_limit_n=400.0)
    assert chance_of_yield(declared, theory_of(declared), 300.0) is None
    vague = replace(declared, declared_force_limit_sigma_n=40.0)
    assert chance_of_yield(vague, theory_of(vague), 400.0) == pytest.approx(0.5)


@pytest.mark.parametrize("path", sorted(PROCEDURES.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_shipped_plan_that_ran_before_still_runs(path: Path) -> None:
    plan: Plan = load_plan(path)
    refused = ("aluminium-sphere", "plastic-cone", "plastic-cube", "plastic-prism",
               "plastic-pyramid")  # fmt: skip
    assert (derive(plan).verdict == "refused") == (path.stem in refused)
