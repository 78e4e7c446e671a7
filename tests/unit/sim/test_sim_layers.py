"""What lies over and under a simulated contact, against the truth that results are held to."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload.engine.first_loading import true_deformation
from stepload.errors import DomainError
from stepload.rig.world import DEFAULT_SPEC, PayloadTruth
from stepload_drivers.sim.contact import contact_of
from stepload_drivers.sim.laws import ContactLaw

K, F_C = 6.57e8, 727.0
SPHERE = PayloadTruth("smooth", K, 1.5, F_C, 0.0, 0.0, 0.0, math.inf)
ROUGH = replace(SPHERE, law="rough", roughness_m=7.5e-6, kappa=262.0)
WORLDS = {
    "smooth": SPHERE,
    "plastic": replace(SPHERE, law="elastic_plastic", elastic_limit_n=60.0),
    "rough and plastic": replace(ROUGH, law="rough_elastic_plastic", elastic_limit_n=60.0),
    "pad": replace(SPHERE, pad_stiffness_n_per_m=4e6, pad_depth_m=25e-6),
    "stop": replace(SPHERE, hard_stop_m=30e-6, stop_stiffness_n_per_m=5e6),
    "seating": replace(SPHERE, seating_m=2.5e-6, seating_depth_m=20e-6),
    "dmt": replace(SPHERE, adhesion_n=5.0),
    "jkr": replace(SPHERE, adhesion_n=5.0, adhesion_law="jkr"),
    "creep": replace(SPHERE, creep=0.2),
    "everything": replace(
        ROUGH,
        law="rough_elastic_plastic",
        elastic_limit_n=100.0,
        pad_stiffness_n_per_m=4e6,
        pad_depth_m=25e-6,
        hard_stop_m=50e-6,
        stop_stiffness_n_per_m=5e6,
        adhesion_n=2.0,
        seating_m=2e-6,
        seating_depth_m=40e-6,
        creep=0.1,
    ),
}


def contact_law(payload):
    return contact_of(replace(DEFAULT_SPEC, payload=payload)).law


def press(law: ContactLaw, end_m: float, parts: int = 500) -> float:
    """Load slowly to a deformation; the force there."""
    for i in range(1, parts + 1):
        law.remember(end_m * i / parts)
    return law.evaluate(end_m)[0]


@pytest.mark.parametrize("name", WORLDS)
@pytest.mark.parametrize("force_n", [20.0, 55.0, 130.0, 300.0])
def test_the_world_first_reaches_a_force_where_the_truth_says(name: str, force_n: float) -> None:
    payload = WORLDS[name]
    deformation_m = true_deformation(payload, force_n)
    assert press(contact_law(payload), deformation_m) == pytest.approx(force_n, rel=2e-3)


@pytest.mark.parametrize("name", WORLDS)
def test_tangent_is_the_derivative_in_every_world(name: str) -> None:
    law = contact_law(WORLDS[name])
    press(law, 12e-6)
    for deformation_m in (14.1e-6, 33.3e-6, 61.7e-6):
        step = 1e-6 * deformation_m
        rise = law.evaluate(deformation_m + step)[0] - law.evaluate(deformation_m - step)[0]
        assert law.evaluate(deformation_m)[1] == pytest.approx(rise / (2.0 * step), rel=2e-3)


def test_a_rough_payload_is_touched_at_its_highest_asperities() -> None:
    first_touch_m = true_deformation(ROUGH, 0.0)
    assert first_touch_m == pytest.approx(1.5715 * 7.5e-6 * 262.0**-0.16, rel=1e-4)
    with pytest.raises(DomainError):
        true_deformation(ROUGH, -1.0)


@given(stiffness=st.floats(1e5, 1e9), depth_m=st.floats(1e-7, 5e-5), force_n=st.floats(0.5, 500.0))
def test_a_pad_of_any_stiffness(stiffness: float, depth_m: float, force_n: float) -> None:
    payload = replace(SPHERE, pad_stiffness_n_per_m=stiffness, pad_depth_m=depth_m)
    deformation_m = (force_n / K) ** (2.0 / 3.0) + min(force_n / stiffness, depth_m)
    assert contact_law(payload).evaluate(deformation_m)[0] == pytest.approx(force_n, rel=1e-6)


def test_plastic_flow_of_a_rough_body_leaves_a_set_and_reloads_elastically() -> None:
    law = contact_law(WORLDS["rough and plastic"])
    deepest_m = true_deformation(WORLDS["rough and plastic"], 300.0)
    press(law, deepest_m)
    set_m = law.residual_m
    assert 0.05 * deepest_m < set_m < 0.5 * deepest_m
    law.remember(0.0)
    assert law.evaluate(0.9 * set_m)[0] == 0.0
    assert 0.0 < law.evaluate(1.3 * set_m)[0] < 20.0
    assert law.evaluate(deepest_m)[0] == pytest.approx(300.0, rel=5e-3)


def test_dmt_pulls_with_its_force_until_it_parts() -> None:
    law = contact_law(WORLDS["dmt"])
    assert law.evaluate(1e-12)[0] == pytest.approx(-5.0, abs=1e-3)
    assert law.evaluate(0.0) == (0.0, 0.0)


def test_jkr_is_drawn_along_and_parts_late() -> None:
    """Least force −P, parting at −5/9 P and δ = −0.2752 δ0; no pull before they have touched."""
    law = contact_law(WORLDS["jkr"])
    scale_m = (4.0 * 5.0 / K) ** (2.0 / 3.0)
    assert law.evaluate(-1e-9)[0] == 0.0
    assert law.evaluate(1e-15)[0] == pytest.approx(-8.0 / 9.0 * 5.0, rel=1e-6)
    law.remember(20e-6)
    places = [20e-6 - (20e-6 + 0.2751 * scale_m) * i / 4000 for i in range(4001)]
    forces = []
    for place_m in places:
        force_n, stiffness = law.evaluate(place_m)
        assert stiffness >= 0.0
        forces.append(force_n)
        law.remember(place_m)
    assert min(forces) == pytest.approx(-5.0, rel=1e-6)
    assert forces[-1] == pytest.approx(-5.0 / 1.8, rel=0.03)
    law.remember(-0.2760 * scale_m)
    assert law.evaluate(-0.2751 * scale_m)[0] == 0.0, "parted: it has to touch again"


def test_creep_grows_evenly_over_decades_and_comes_back() -> None:
    payload = replace(SPHERE, creep=0.3, creep_time_s=0.1, creep_decades=2)
    _, creep = contact_of(replace(DEFAULT_SPEC, payload=payload))
    assert creep is not None
    deformation_m, held_s, seen = 50e-6, 0.0, {}
    creep.remember(deformation_m)
    for _ in range(100_000):
        creep.flow(1e-3)
        creep.remember(deformation_m + creep.residual_m)
        held_s += 1e-3
        seen[round(held_s, 3)] = creep.residual_m / deformation_m
    for time_s in (0.1, 1.0, 10.0, 100.0):
        exact = sum(0.1 * -math.expm1(-time_s / tau) for tau in (0.1, 1.0, 10.0))
        assert seen[time_s] == pytest.approx(exact, rel=1e-6)
    creep.remember(0.0)
    for _ in range(100):
        creep.flow(1.0)
    assert creep.residual_m == pytest.approx(0.0, abs=1e-8)


def test_a_soft_path_is_stiff_again_at_high_force() -> None:
    """δ_s(F) = F/K_s + s F_s/K_s (1 − e^(−F/F_s)); the spring K_s itself is not in the law."""
    spec = replace(DEFAULT_SPEC, payload=SPHERE, softness=0.4, softness_force_n=100.0)
    law = contact_of(spec).law
    stiffness = spec.system_stiffness_n_per_m
    for force_n in (1.0, 30.0, 300.0):
        given_m = 0.4 * 100.0 / stiffness * -math.expm1(-force_n / 100.0)
        deformation_m = (force_n / K) ** (2.0 / 3.0) + given_m
        assert law.evaluate(deformation_m)[0] == pytest.approx(force_n, rel=1e-9)
