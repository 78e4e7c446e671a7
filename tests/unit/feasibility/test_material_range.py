"""A material that is known as a range only: every bound holds at both ends of it, and between."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from stepload.contact.elastic import law_for
from stepload.contact.limit_uncertainty import limit_in
from stepload.contact.material_range import softest, stiffest
from stepload.contact.materials import Material
from stepload.contact.power_law import ContactLaw
from stepload.feasibility.preflight import Preflight, derive, preflight_of
from stepload.feasibility.press import series_stiffness
from stepload.feasibility.theory import theory_of
from stepload.plan.load import load_plan
from stepload.plan.model import Plan

Planned = Callable[..., Plan]
PLAN = """\
stepload: 1
payload:
  name: grey print
  geometry: {shape: sphere, radius: 28.7 mm}
  material: {name: some plastic, youngs_modulus: %s, poisson_ratio: %s}
  plate: {name: aluminium 6061, youngs_modulus: 70 GPa, poisson_ratio: 0.33, %s}
  force_limit: 400 N
rig: {profile: stvf, %s}
procedure: {step: 100 N, top_force: 200 N, hold: 1 s, surface_distance: 5 mm, %s}
identify: {%s}
"""


@pytest.fixture
def planned_for(tmp_path: Path) -> Planned:
    def plan_of(
        modulus: str = "0.5 GPa to 2 GPa",
        ratio: str = "0.2 to 0.5",
        *,
        plate: str = "yield_strength: 276 MPa",
        rig: str = "",
        procedure: str = "surface_uncertainty: 1 mm",
        identify: str = "",
    ) -> Plan:
        path = tmp_path / "plan.yaml"
        path.write_text(PLAN % (modulus, ratio, plate, rig, procedure, identify))
        return load_plan(path)

    return plan_of


def codes(preflight: Preflight) -> dict[str, str]:
    return {reason.code: reason.severity for reason in preflight.reasons}


def test_the_ends_are_those_of_modulus_and_poissons_ratio_together(planned_for: Planned) -> None:
    payload = planned_for().payload
    theory = theory_of(payload)
    soft, stiff = softest(payload.material), stiffest(payload.material)
    assert (soft.youngs_modulus_pa, soft.poisson_ratio) == (0.5e9, 0.2)
    assert (stiff.youngs_modulus_pa, stiff.poisson_ratio) == (2e9, 0.5)
    assert theory.softest == law_for(payload.geometry, soft, payload.plate)
    assert theory.stiffest == law_for(payload.geometry, stiff, payload.plate)
    assert theory.softest.k < theory.law.k < theory.stiffest.k
    assert theory.is_range
    across = replace(payload.material, poisson_ratio_ends=(-0.3, 0.2))
    assert (softest(across).poisson_ratio, stiffest(across).poisson_ratio) == (0.0, -0.3)


def test_no_body_of_the_range_is_hit_harder_than_the_budget_says(planned_for: Planned) -> None:
    """The preflight of each body between the ends allows at least as much as that of the range."""
    preflight = preflight_of(planned_for())
    limits = preflight.run_limits
    stiff = preflight.theory.stiffest
    assert limits.tangent_n_per_m == stiff.tangent(limits.force_limit_n)
    for modulus in ("0.5 GPa", "0.8 GPa", "1.4 GPa", "2 GPa"):
        for ratio in ("0.2", "0.35", "0.5"):
            known = preflight_of(planned_for(modulus, ratio)).run_limits
            assert known.force_limit_n == limits.force_limit_n
            assert limits.guarded_speed_m_s <= known.guarded_speed_m_s
            assert limits.fast_speed_m_s <= known.fast_speed_m_s
            assert limits.ahead_m <= known.ahead_m
    hardest = preflight_of(planned_for("2 GPa", "0.5"))
    assert limits.guarded_speed_m_s == hardest.run_limits.guarded_speed_m_s
    assert limits.ahead_m == hardest.run_limits.ahead_m
    assert [term.value for term in preflight.force_budget] == [
        term.value for term in hardest.force_budget
    ]


def test_distances_hold_for_the_softest_end(planned_for: Planned) -> None:
    plan = planned_for()
    touch = plan.procedure.touch_force_n
    soft = theory_of(plan.payload).softest
    stiffness = plan.rig.system_stiffness.stiffness_n_per_m
    lost_m = plan.rig.arm.lost_motion_m
    pressed = [force / stiffness + soft.deformation(force) + lost_m for force in (touch, 200.0)]
    assert plan.procedure.search_distance_m == pytest.approx(3e-3 + 2.0 * pressed[0])
    assert plan.procedure.retract_m == pytest.approx(max(5e-4, 2.0 * pressed[1]))
    wide = planned_for("10 MPa to 500 MPa")
    assert wide.procedure.retract_m == planned_for("10 MPa", "0.2").procedure.retract_m > 5e-4


def test_a_payload_that_may_be_too_stiff_to_be_told_is_refused(planned_for: Planned) -> None:
    wide = preflight_of(planned_for("0.2 GPa to 6 GPa"))
    assert codes(wide)["unidentifiable"] == "refuse"
    assert "unidentifiable" not in codes(preflight_of(planned_for("0.2 GPa to 2 GPa")))
    expected = wide.theory.law.secant(200.0)
    assert expected < wide.identifiability.k_max_n_per_m  # type: ignore[union-attr]


def test_the_declared_limit_counts_and_that_of_a_plate_that_is_known(planned_for: Planned) -> None:
    soft = theory_of(planned_for().payload)
    assert (soft.elastic_limit_n, soft.counted.lower_n) == (400.0, 400.0)
    payload = planned_for("20 GPa to 210 GPa").payload
    hard = theory_of(payload)
    plate = limit_in(payload.plate, stiffest(payload.material), payload.geometry)
    assert plate is not None
    assert hard.elastic_limit_n == plate.force_n < 400.0
    assert hard.counted.lower_n == plate.lower_end(2.0)
    assert "aluminium 6061" in hard.limit_equation
    known = limit_in(payload.plate, softest(payload.material), payload.geometry)
    assert known is not None
    assert known.force_n > plate.force_n


@pytest.mark.parametrize("n", [1.0, 1.5, 2.0])
def test_the_budget_of_an_approach_grows_with_the_stiffness_of_what_is_met(n: float) -> None:
    """Why the stiffest end is enough: no softer contact is hit harder, whatever rig."""
    from run_plans import stvf_plan, ur_plan

    from stepload.feasibility.bounds import press_rig
    from stepload.feasibility.command_backlog import catch_up_force
    from stepload.feasibility.press import force_budget

    for plan in (stvf_plan(), ur_plan()):
        for lag_s in (0.0, plan.rig.arm.lag_s, 0.2):
            rig = replace(press_rig(plan.rig, 0.3), lag_s=lag_s)
            before = 0.0
            for exponent in range(60):
                tangent = ContactLaw(10.0 ** (exponent / 5.0), n, "").tangent(250.0)
                terms = force_budget(
                    rig, speed_m_s=1e-3, threshold_n=3.0, tangent_n_per_m=tangent,
                    delay_s=rig.reaction_s,
                )  # fmt: skip
                force_n = math.fsum(term.value for term in terms)
                caught_n = catch_up_force(rig, 1e-5, tangent)
                assert force_n + caught_n >= before
                assert series_stiffness(rig.stiffness_n_per_m, tangent) <= rig.stiffness_n_per_m
                before = force_n + caught_n


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("ur16e-polyurethane-sphere", marks=pytest.mark.long),
        "plastic-cone",
        "plastic-sphere",
    ],
)
def test_whatever_body_of_a_range_is_met_its_own_bounds_are_no_tighter(name: str) -> None:
    """Of drawn ranges and drawn bodies in them, on rigs and shapes that we ship."""
    drawn = random.Random(name)
    shipped = load_plan(Path(__file__).parents[3] / "procedures" / f"{name}.yaml")
    compared = 0
    for _ in range(12):
        low_pa = 10.0 ** drawn.uniform(6.5, 10.0)
        moduli = (low_pa, low_pa * 10.0 ** drawn.uniform(0.1, 1.9))
        low = drawn.uniform(-0.5, 0.4)
        ratios = (low, drawn.uniform(low + 0.01, 0.5))
        limit_n = drawn.uniform(100.0, 900.0)
        ranged = derive(
            _of_body(
                shipped,
                limit_n,
                Material(
                    "x",
                    math.sqrt(math.prod(moduli)),
                    0.5 * sum(ratios),
                    youngs_modulus_ends_pa=moduli,
                    poisson_ratio_ends=ratios,
                ),
            )
        )
        if ranged.limits is None:
            continue
        for share in (0.0, drawn.random(), 1.0):
            modulus_pa = moduli[0] * (moduli[1] / moduli[0]) ** share
            for ratio in (*ratios, max(low, min(0.0, ratios[1]))):
                body = Material("x", modulus_pa, ratio)
                known = derive(_of_body(shipped, limit_n, body)).run_limits
                compared += 1
                for bound in ("force_limit_n", "guarded_speed_m_s", "fast_speed_m_s", "ahead_m"):
                    assert getattr(ranged.limits, bound) <= getattr(known, bound) * (1.0 + 1e-9)
    assert compared > 20


def _of_body(plan: Plan, limit_n: float, body: Material) -> Plan:
    top_n = 0.6 * limit_n
    return replace(
        plan,
        payload=replace(plan.payload, material=body, declared_force_limit_n=limit_n),
        procedure=replace(plan.procedure, levels_n=(0.5 * top_n, top_n), top_force_n=top_n),
        identify=replace(plan.identify, secant_force_n=top_n),
    )
