"""Where each equation of contact theory ends, and single numbers worked out by hand."""

from __future__ import annotations

import math

import pytest

from stepload.contact.elastic import (
    equivalent_radius,
    law_for,
    profile_constant,
)
from stepload.contact.limit import elastic_limit, no_limit_reason
from stepload.contact.materials import (
    BluntTip,
    FlatPunch,
    Geometry,
    Material,
    PowerProfile,
    SharpCone,
    Sphere,
)
from stepload.contact.plastic import ElasticPlasticSphere
from stepload.contact.power_law import ContactLaw, secant_stiffness
from stepload.contact.rough import RoughSphere, roughness_number
from stepload.errors import DomainError

SOFT = Material("soft", 2e9, 0.3, 50e6)
HARD = Material("hard", 2e11, 0.25, 5e8)
E_EQ = 1.0 / ((1.0 - 0.09) / 2e9 + (1.0 - 0.0625) / 2e11)
NOT_POSITIVE = [0.0, -1.0, math.nan, math.inf]


@pytest.mark.parametrize(("m", "constant"), [(1.0, 0.5 * math.pi), (2.0, 2.0), (4.0, 8.0 / 3.0)])
def test_the_profile_constant(m: float, constant: float) -> None:
    assert profile_constant(m) == pytest.approx(constant)


@pytest.mark.parametrize(
    ("geometry", "radius_m"),
    [
        (Sphere(0.02), 0.02),
        (Sphere(0.02, 0.06), 0.015),
        (BluntTip("cone", 0.003), 0.003),
        (PowerProfile(2.0, 25.0), 0.02),
        (FlatPunch(0.01), None),
        (SharpCone(0.3), None),
    ],
)
def test_the_equivalent_radius(geometry: Geometry, radius_m: float | None) -> None:
    assert equivalent_radius(geometry) == (radius_m and pytest.approx(radius_m))


@pytest.mark.parametrize(
    ("geometry", "k", "n"),
    [
        (Sphere(0.02), 4.0 / 3.0 * E_EQ * math.sqrt(0.02), 1.5),
        (SharpCone(0.3), 2.0 * E_EQ / (math.pi * math.tan(0.3)), 2.0),
        (FlatPunch(0.01), 0.02 * E_EQ, 1.0),
        (PowerProfile(4.0, 1e5), 1.6 * E_EQ * (8.0 / 3.0 * 1e5) ** -0.25, 1.25),
    ],
)
def test_each_geometry_has_its_law(geometry: Geometry, k: float, n: float) -> None:
    law = law_for(geometry, SOFT, HARD)
    assert law.k == pytest.approx(k)
    assert law.n == pytest.approx(n)


@pytest.mark.parametrize("value", NOT_POSITIVE)
def test_dimensions_that_are_no_dimensions_are_refused(value: float) -> None:
    shapes: list[Geometry] = [
        Sphere(value), Sphere(0.01, value), BluntTip("cone", value), FlatPunch(value),
        PowerProfile(2.0, value), PowerProfile(3.0, value), PowerProfile(value, 1.0),
    ]  # fmt: skip
    for shape in shapes:
        with pytest.raises(DomainError):
            law_for(shape, SOFT, HARD)


def test_the_elastic_limit_by_hand() -> None:
    pressure = math.pi * (0.454 + 0.41 * 0.3) * 2.8 * 50e6
    limit = elastic_limit(Sphere(0.02), SOFT, HARD)
    assert limit is not None
    assert limit.force_n == pytest.approx(pressure**3 * 0.02**2 / (6.0 * E_EQ**2))
    assert limit.deformation_m == pytest.approx((pressure / (2.0 * E_EQ)) ** 2 * 0.02)
    assert no_limit_reason(Sphere(0.02), Material("x", 2e9, 0.3), HARD) != ""


def test_the_law_ends_where_the_bodies_part() -> None:
    law = ContactLaw(4e8, 1.5, "(7)")
    assert law.force(-1e-6) == law.force(0.0) == 0.0
    assert law.force(4e-6) == pytest.approx(4e8 * 8e-9)
    assert law.deformation(law.force(4e-6)) == pytest.approx(4e-6)
    assert law.deformation(0.0) == 0.0
    assert law.secant(100.0) == pytest.approx(100.0 / law.deformation(100.0))
    assert law.tangent(100.0) == pytest.approx(1.5 * law.secant(100.0))
    for value in (math.nan, math.inf, -math.inf):
        with pytest.raises(DomainError):
            law.force(value)
        with pytest.raises(DomainError):
            law.deformation(value)
    with pytest.raises(DomainError):
        law.deformation(-1e-9)
    for value in NOT_POSITIVE:
        with pytest.raises(DomainError):
            secant_stiffness(4e8, 1.5, value)
        with pytest.raises(DomainError):
            ContactLaw(value, 1.5, "")
        with pytest.raises(DomainError):
            ContactLaw(1.0, value, "")


def test_the_plastic_sphere_branch_by_branch() -> None:
    sphere = ElasticPlasticSphere(100.0, 1e-5)
    for x, ratio in (
        (0.9, 0.9**1.5), (1.4, 1.4**1.5), (1.6, 1.03 * 1.6**1.425), (6.6, 1.03 * 6.6**1.425),
        (6.7, 1.4 * 6.7**1.263), (110.0, 1.4 * 110.0**1.263),
    ):  # fmt: skip
        assert sphere.force(x * 1e-5) == pytest.approx(100.0 * ratio)
        assert sphere.deformation(100.0 * ratio) == pytest.approx(1e-5 * x)
    assert sphere.force(0.0) == sphere.force(-1.0) == 0.0
    assert ElasticPlasticSphere.from_law(8e8, 100.0).deformation_c_m == pytest.approx(
        (100.0 / 8e8) ** (2.0 / 3.0)
    )
    for value in NOT_POSITIVE:
        with pytest.raises(DomainError):
            ElasticPlasticSphere(value, 1e-5)
        with pytest.raises(DomainError):
            ElasticPlasticSphere(100.0, value)


def test_roughness_by_hand() -> None:
    assert roughness_number(2e9, 1e9, 0.04, 1e-6) == pytest.approx(2.0 * 200.0)
    rough = RoughSphere(4e8, 1e-6, 400.0)
    assert rough.scale_m == pytest.approx(1.22e-6 * 400.0**-0.16)
    smooth_m = (10.0 / 4e8) ** (2.0 / 3.0)
    assert rough.pressure_ratio(10.0) == pytest.approx(smooth_m / (smooth_m + rough.scale_m))
