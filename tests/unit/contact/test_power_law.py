"""The power law and its parameters for every geometry."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepload.contact.elastic import (
    equivalent_modulus,
    equivalent_radius,
    law_for,
    profile_constant,
)
from stepload.contact.materials import (
    BluntTip,
    FlatPunch,
    Geometry,
    Material,
    PowerProfile,
    SharpCone,
    Sphere,
)
from stepload.contact.power_law import ContactLaw, secant_stiffness
from stepload.errors import DomainError

PLASTIC = Material("acetal", 2.75e9, 0.3)
STEEL = Material("steel", 200e9, 0.29)

quick = settings(max_examples=40, deadline=None)
stiffnesses = st.floats(1e3, 1e16)
exponents = st.floats(0.8, 3.0)
forces = st.floats(1e-3, 1e4)


@quick
@given(stiffnesses, exponents, forces)
def test_force_inverts_deformation(k: float, n: float, force_n: float) -> None:
    law = ContactLaw(k, n, "test")
    assert law.force(law.deformation(force_n)) == pytest.approx(force_n, rel=1e-10)


@quick
@given(stiffnesses, exponents, forces)
def test_secant_is_force_over_deformation(k: float, n: float, force_n: float) -> None:
    law = ContactLaw(k, n, "test")
    assert law.secant(force_n) == pytest.approx(force_n / law.deformation(force_n), rel=1e-10)


@quick
@given(stiffnesses, exponents, forces)
def test_tangent_is_the_slope(k: float, n: float, force_n: float) -> None:
    law = ContactLaw(k, n, "test")
    at_m = law.deformation(force_n)
    slope = (law.force(at_m * 1.00001) - law.force(at_m * 0.99999)) / (2e-5 * at_m)
    assert law.tangent(force_n) == pytest.approx(slope, rel=1e-6)
    assert n * secant_stiffness(k, n, force_n) == law.tangent(force_n)


@quick
@given(stiffnesses, exponents, forces, st.floats(1.0001, 10.0))
def test_force_rises_with_deformation(k: float, n: float, force_n: float, step: float) -> None:
    law = ContactLaw(k, n, "test")
    at_m = law.deformation(force_n)
    assert law.force(at_m * step) > law.force(at_m)


@quick
@given(stiffnesses, exponents, forces, st.floats(1e-3, 1e3))
def test_secant_does_not_depend_on_the_unit_of_length(
    k: float, n: float, force_n: float, metre: float
) -> None:
    """Writing δ in another unit turns K into K/unit^n and the secant into secant/unit."""
    other = secant_stiffness(k / metre**n, n, force_n)
    assert other * metre == pytest.approx(secant_stiffness(k, n, force_n), rel=1e-9)


def test_bodies_apart_carry_no_force() -> None:
    law = ContactLaw(1e9, 1.5, "test")
    assert law.force(-1e-3) == 0.0
    assert law.force(0.0) == 0.0
    assert law.deformation(0.0) == 0.0


@pytest.mark.parametrize("force_n", [-1.0, math.nan, math.inf])
def test_deformation_refuses_what_is_no_contact_force(force_n: float) -> None:
    with pytest.raises(DomainError, match="contact force is"):
        ContactLaw(1e9, 1.5, "test").deformation(force_n)


@pytest.mark.parametrize("force_n", [0.0, -1.0, math.nan, math.inf])
def test_secant_refuses_zero_force(force_n: float) -> None:
    with pytest.raises(DomainError, match="secant force is"):
        secant_stiffness(1e9, 1.5, force_n)


@pytest.mark.parametrize("deformation_m", [math.nan, math.inf, -math.inf])
def test_force_refuses_infinite_deformation(deformation_m: float) -> None:
    with pytest.raises(DomainError, match="deformation is"):
        ContactLaw(1e9, 1.5, "test").force(deformation_m)


@pytest.mark.parametrize(("k", "n"), [(0.0, 1.5), (math.nan, 1.5), (1e9, 0.0), (1e9, math.inf)])
def test_law_refuses_unphysical_parameters(k: float, n: float) -> None:
    with pytest.raises(DomainError, match="must be finite and greater than 0"):
        ContactLaw(k, n, "test")


@pytest.mark.parametrize(
    ("exponent", "constant"), [(1, math.pi / 2), (2, 2.0), (3, 3 * math.pi / 4), (4, 8 / 3)]
)
def test_profile_constants(exponent: float, constant: float) -> None:
    assert profile_constant(exponent) == pytest.approx(constant, rel=1e-13)


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


def test_sphere_on_sphere_uses_both_radii() -> None:
    assert equivalent_radius(Sphere(0.02, 0.02)) == pytest.approx(0.01)
    on_plane = law_for(Sphere(0.01), PLASTIC, STEEL)
    assert law_for(Sphere(0.02, 0.02), PLASTIC, STEEL).k == pytest.approx(on_plane.k)


def test_equivalent_modulus_is_symmetric_and_below_each_plane_modulus() -> None:
    modulus = equivalent_modulus(PLASTIC, STEEL)
    assert modulus == equivalent_modulus(STEEL, PLASTIC)
    assert modulus < 2.75e9 / (1 - 0.09)


@pytest.mark.parametrize(
    "geometry",
    [
        Sphere(0.0),
        Sphere(math.nan),
        Sphere(0.01, 0.0),
        Sphere(0.01, -0.01),
        BluntTip("cone", -1e-3),
        SharpCone(0.0),
        SharpCone(math.pi / 2),
        SharpCone(math.nan),
        FlatPunch(math.inf),
        PowerProfile(0.0, 1.0),
        PowerProfile(2.0, 0.0),
        PowerProfile(3.0, -1.0),
    ],
)
def test_geometry_outside_the_theory_is_refused(geometry: Geometry) -> None:
    with pytest.raises(DomainError):
        law_for(geometry, PLASTIC, STEEL)


@pytest.mark.parametrize(
    ("material", "text"),
    [
        (Material("x", 0.0, 0.3), "Young's modulus of 'x' is 0 Pa"),
        (Material("x", math.nan, 0.3), "Young's modulus of 'x' is nan Pa"),
        (Material("x", 1e9, -1.0), "Poisson's ratio of 'x' is -1"),
        (Material("x", 1e9, 0.51), "at most 0.5"),
        (Material("x", 1e9, math.nan), "Poisson's ratio of 'x' is nan"),
        (Material("x", 1e9, 0.3, -5.0), "yield strength of 'x' is -5 Pa"),
    ],
)
def test_material_outside_the_theory_is_refused(material: Material, text: str) -> None:
    for pair in ((material, STEEL), (STEEL, material)):
        with pytest.raises(DomainError, match=text):
            law_for(Sphere(0.01), *pair)


def test_incompressible_body_is_allowed() -> None:
    assert law_for(Sphere(0.01), Material("rubber", 1e7, 0.5), STEEL).k > 0
