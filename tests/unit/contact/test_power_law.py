"""The power law and its parameters for every geometry."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload.contact.elastic import law_for
from stepload.contact.materials import FlatPunch, Material, PowerProfile, SharpCone, Sphere
from stepload.contact.power_law import ContactLaw, secant_stiffness

PLASTIC = Material("acetal", 2.75e9, 0.3)
STEEL = Material("steel", 200e9, 0.29)

stiffnesses = st.floats(1e3, 1e16)
exponents = st.floats(0.8, 3.0)
forces = st.floats(1e-3, 1e4)


@given(stiffnesses, exponents, forces)
def test_force_inverts_deformation(k: float, n: float, force_n: float) -> None:
    law = ContactLaw(k, n, "test")
    assert law.force(law.deformation(force_n)) == pytest.approx(force_n, rel=1e-10)


@given(stiffnesses, exponents, forces)
def test_tangent_is_the_slope(k: float, n: float, force_n: float) -> None:
    law = ContactLaw(k, n, "test")
    at_m = law.deformation(force_n)
    slope = (law.force(at_m * 1.00001) - law.force(at_m * 0.99999)) / (2e-5 * at_m)
    assert law.tangent(force_n) == pytest.approx(slope, rel=1e-6)
    assert n * secant_stiffness(k, n, force_n) == law.tangent(force_n)


@given(stiffnesses, exponents, forces, st.floats(1e-3, 1e3))
def test_secant_does_not_depend_on_the_unit_of_length(
    k: float, n: float, force_n: float, metre: float
) -> None:
    """Writing δ in another unit turns K into K/unit^n and the secant into secant/unit."""
    other = secant_stiffness(k / metre**n, n, force_n)
    assert other * metre == pytest.approx(secant_stiffness(k, n, force_n), rel=1e-9)


def test_general_exponent_contains_sphere_and_cone() -> None:
    sphere = law_for(Sphere(0.02), PLASTIC, STEEL)
    nearly = law_for(PowerProfile(2.0 + 1e-9, 1 / 0.04), PLASTIC, STEEL)
    assert nearly.k == pytest.approx(sphere.k, rel=1e-7)
    assert nearly.n == pytest.approx(1.5, rel=1e-8)
    assert law_for(PowerProfile(2.0, 1 / 0.04), PLASTIC, STEEL) == sphere

    slope = math.radians(10)
    cone = law_for(SharpCone(slope), PLASTIC, STEEL)
    general = law_for(PowerProfile(1.0, math.tan(slope)), PLASTIC, STEEL)
    assert cone.n == general.n == 2.0
    assert cone.k == pytest.approx(general.k, rel=1e-12)


def test_general_exponent_tends_to_the_flat_punch() -> None:
    radius_m = 0.005
    punch = law_for(FlatPunch(radius_m), PLASTIC, STEEL)
    assert punch.n == 1.0
    blunt = law_for(PowerProfile(100.0, radius_m**-100), PLASTIC, STEEL)
    assert blunt.k == pytest.approx(punch.k, rel=0.04)
    assert blunt.n == pytest.approx(1.0, abs=0.011)
