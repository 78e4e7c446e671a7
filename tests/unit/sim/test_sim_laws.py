"""The simulated payloads against the contact theory, and their memory against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload.contact import power_law
from stepload.contact.plastic import ElasticPlasticSphere
from stepload.contact.rough import RoughSphere
from stepload.rig.world import DEFAULT_SPEC, PayloadTruth
from stepload_drivers.sim.contact import contact_of
from stepload_drivers.sim.laws import ContactLaw

SPHERE = PayloadTruth("smooth", 6.57e8, 1.5, 727.0, 0.0, 0.0, 0.0, math.inf)
HERTZ = power_law.ContactLaw(SPHERE.k, 1.5, "(7)")
ROUGH = replace(SPHERE, law="rough", roughness_m=7.5e-6, kappa=262.0)
PLASTIC = replace(SPHERE, law="elastic_plastic")


def contact_law(payload):
    return contact_of(replace(DEFAULT_SPEC, payload=payload)).law


def travel(law: ContactLaw, start_m: float, end_m: float, parts: int = 4000) -> float:
    """Work in J taken up by `law` on the way; its memory goes along."""
    work = 0.0
    before = law.evaluate(start_m)[0]
    for i in range(1, parts + 1):
        here_m = start_m + (end_m - start_m) * i / parts
        after = law.evaluate(here_m)[0]
        law.remember(here_m)
        work += 0.5 * (before + after) * (end_m - start_m) / parts
        before = after
    return work


@given(k=st.floats(1e4, 1e12), n=st.floats(1.0, 3.0), deformation_m=st.floats(1e-8, 1e-3))
def test_smooth_law_is_the_power_law(k: float, n: float, deformation_m: float) -> None:
    law, power = contact_law(replace(SPHERE, k=k, n=n)), power_law.ContactLaw(k, n, "")
    assert law.evaluate(deformation_m)[0] == pytest.approx(power.force(deformation_m), rel=1e-12)


@pytest.mark.parametrize("force_n", [0.02, 0.1, 1.0, 3.0, 100.0, 300.0, 3000.0])
def test_rough_law_inverts_the_rough_sphere(force_n: float) -> None:
    theory = RoughSphere(ROUGH.k, ROUGH.roughness_m, ROUGH.kappa)
    assert not 0.43 < theory.pressure_ratio(force_n) < 0.52, "the smoothed gap of (12)"
    deformation_m = theory.deformation(force_n)
    assert contact_law(ROUGH).evaluate(deformation_m)[0] == pytest.approx(force_n, rel=2e-3)


@given(x=st.floats(0.01, 100.0))
def test_elastic_plastic_loading_is_the_continuous_theory(x: float) -> None:
    theory = ElasticPlasticSphere.from_law(PLASTIC.k, PLASTIC.elastic_limit_n)
    deformation_m = x * theory.deformation_c_m
    expected = theory.force(deformation_m)
    assert contact_law(PLASTIC).evaluate(deformation_m)[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("share", [0.05, 0.2, 0.5])
@pytest.mark.parametrize("n", [1.0, 1.5, 2.5])
def test_full_cycle_loses_the_declared_share_of_the_loading_work(share: float, n: float) -> None:
    law = contact_law(replace(SPHERE, k=1e6**n, n=n, hysteresis=share))
    for _ in range(2):
        loaded = travel(law, 0.0, 50e-6)
        returned = -travel(law, 50e-6, 0.0)
        assert (loaded - returned) / loaded == pytest.approx(share, rel=2e-3)


def test_hysteresis_loads_on_the_law_itself_and_rejoins_it_after_a_small_cycle() -> None:
    law = contact_law(replace(SPHERE, hysteresis=0.2))
    travel(law, 0.0, 40e-6)
    assert law.evaluate(40e-6)[0] == pytest.approx(HERTZ.force(40e-6), rel=1e-9)
    travel(law, 40e-6, 38e-6)
    assert law.evaluate(38e-6)[0] < 0.9 * HERTZ.force(38e-6)
    travel(law, 38e-6, 50e-6)
    assert law.evaluate(50e-6)[0] == pytest.approx(HERTZ.force(50e-6), rel=1e-3)


def test_beyond_the_elastic_limit_an_indentation_stays() -> None:
    law = contact_law(PLASTIC)
    deepest_m = 5.0 * (727.0 / PLASTIC.k) ** (2.0 / 3.0)
    loaded, returned = travel(law, 0.0, deepest_m), -travel(law, deepest_m, 0.0)
    assert 0.05 * deepest_m < law.residual_m < 0.5 * deepest_m
    assert returned < 0.95 * loaded
    assert law.evaluate(law.residual_m)[0] == 0.0
    again = travel(law, 0.0, deepest_m)
    assert again == pytest.approx(returned, rel=1e-6), "reloading is elastic"
    assert law.evaluate(deepest_m * 1.01)[0] > law.evaluate(deepest_m)[0]
