"""Galin and Sneddon's half-space against closed forms, and the limits of profiles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stepload.contact.elastic import (
    contact_radius,
    edge_slope,
    equivalent_modulus,
    law_for,
)
from stepload.contact.half_space import half_space
from stepload.contact.limit import elastic_limit, no_limit_reason
from stepload.contact.materials import (
    Geometry,
    Material,
    PowerProfile,
    Profile,
    RoundedCone,
    SharpCone,
    Sphere,
)
from stepload.errors import DomainError

ACETAL = Material("acetal", 2.75e9, 0.3, 70e6)
ALUMINIUM = Material("aluminium", 70e9, 0.33, 276e6)
E = equivalent_modulus(ACETAL, ALUMINIUM)
FORCES = np.array([1.0, 30.0, 300.0])
RADIUS = 28.7e-3
PARABOLA = Profile(exponents=(2.0,), coefficients=(0.5 / RADIUS,))


@pytest.mark.parametrize("shape", [PowerProfile(2.0, 17.4), SharpCone(0.4), PowerProfile(3.5, 1e3)])
def test_every_power_agrees_with_its_law(shape: Geometry) -> None:
    law, curve = law_for(shape, ACETAL, ALUMINIUM), half_space(shape, E, FORCES)
    for force, deformation, radius in zip(*curve, strict=True):
        assert deformation == pytest.approx(law.deformation(force), rel=1e-6)
        assert radius == pytest.approx(contact_radius(shape, deformation), rel=1e-5)


def test_a_sphere_agrees_with_sneddon() -> None:
    """δ = a artanh(a/R), F = E_eq ((R² + a²) artanh(a/R) − a R) for the sphere itself."""
    curve = half_space(Sphere(1e-3), E, FORCES)
    share = curve.contact_radius_m / 1e-3
    artanh = np.arctanh(share)
    assert curve.deformation_m == pytest.approx(curve.contact_radius_m * artanh, rel=1e-6)
    assert pytest.approx(E * 1e-6 * ((1.0 + share**2) * artanh - share), rel=1e-6) == FORCES


def test_a_rounded_cone_is_its_tip_first_and_its_flank_at_last() -> None:
    angle = math.radians(60.0)
    cone = RoundedCone(1e-3, angle, 1.0)
    tip = law_for(Sphere(1e-3), ACETAL, ALUMINIUM).deformation(0.1)
    assert half_space(cone, E, 0.1).deformation_m[0] == pytest.approx(tip, rel=2e-4)
    flank = law_for(SharpCone(math.pi / 2 - angle), ACETAL, ALUMINIUM).deformation(1e7)
    assert half_space(cone, E, 1e7).deformation_m[0] == pytest.approx(flank, rel=4e-3)
    law = law_for(cone, ACETAL, ALUMINIUM, 1e5)
    assert 1.5 < law.n < 2.0
    assert law_for(cone, ACETAL, ALUMINIUM, 1.0) == law_for(Sphere(1e-3), ACETAL, ALUMINIUM)
    assert edge_slope(cone, 1e-2) == pytest.approx(1.0 / math.tan(angle))


def test_a_table_of_a_parabola_is_one() -> None:
    r = np.array([0.0, 3.0, 5.0, 6.0, 8.0]) * 1e-3  # the contact is inside the first interval
    table = Profile(table_m=tuple(zip(r.tolist(), (0.5 * r * r / RADIUS).tolist(), strict=True)))
    found, exact = (half_space(shape, E, FORCES[1:]) for shape in (table, PARABOLA))
    assert found.deformation_m == pytest.approx(exact.deformation_m, rel=1e-9)
    with pytest.raises(DomainError, match="leaves the profile"):
        half_space(table, E, 1e6)


def test_a_profile_has_the_limit_of_its_curvature_where_that_rules() -> None:
    sphere = elastic_limit(Sphere(RADIUS), ACETAL, ALUMINIUM)
    parabola = elastic_limit(PARABOLA, ACETAL, ALUMINIUM)
    assert sphere is not None
    assert parabola is not None
    assert parabola.force_n == pytest.approx(sphere.force_n)
    at_c = math.sqrt(RADIUS * sphere.deformation_m)
    # The fourth power acts on the axis with C_4 m/(m - 1) = 32/9 of its gap, the second with 4.
    for share, there in ((0.9 * 0.02, True), (1.1 * 0.02, False)):
        fourth = share * 4.0 / (32.0 / 9.0) * 0.5 / RADIUS / at_c**2
        shape = Profile(exponents=(2.0, 4.0), coefficients=(0.5 / RADIUS, fourth))
        assert (elastic_limit(shape, ACETAL, ALUMINIUM) is not None) is there
        assert bool(no_limit_reason(shape, ACETAL, ALUMINIUM)) is not there
    assert elastic_limit(Profile(exponents=(3.0,), coefficients=(1.0,)), ACETAL, ALUMINIUM) is None
