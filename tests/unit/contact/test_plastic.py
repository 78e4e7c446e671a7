"""Elastic–plastic spheres: branches, their inverse, what is refused."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepload.contact.plastic import EARLY_MEETS, LATE_MEETS, ElasticPlasticSphere
from stepload.errors import DomainError

CONTACT = ElasticPlasticSphere.from_law(6.57e8, 727.0)
quick = settings(max_examples=60, deadline=None)
EPS = 1e-9


def test_branches_intersect_where_documented() -> None:
    assert pytest.approx(1.483, abs=5e-4) == EARLY_MEETS
    assert pytest.approx(6.649, abs=5e-4) == LATE_MEETS


def test_elastic_branch_is_the_power_law() -> None:
    for x in (0.01, 0.5, 1.0):
        at_m = x * CONTACT.deformation_c_m
        assert CONTACT.force(at_m) == pytest.approx(6.57e8 * at_m**1.5, rel=1e-12)


@quick
@given(st.floats(1e-6, 110.0), st.floats(1.0001, 2.0))
def test_continuous_law_is_monotone(x: float, factor: float) -> None:
    at_m = x * CONTACT.deformation_c_m
    assert CONTACT.force(at_m * factor) > CONTACT.force(at_m)


@pytest.mark.parametrize("x", [EARLY_MEETS, LATE_MEETS])
def test_continuous_law_does_not_jump(x: float) -> None:
    at_m = x * CONTACT.deformation_c_m
    below, above = (CONTACT.force(at_m * (1 + side * EPS)) for side in (-1, 1))
    assert above / below - 1 == pytest.approx(0.0, abs=1e-8)


@quick
@given(st.floats(1e-6, 109.0))
def test_continuous_round_trip(x: float) -> None:
    at_m = x * CONTACT.deformation_c_m
    assert CONTACT.deformation(CONTACT.force(at_m)) == pytest.approx(at_m, rel=1e-10)


def test_bodies_apart_carry_no_force() -> None:
    assert CONTACT.force(-1e-6) == 0.0
    assert CONTACT.deformation(0.0) == 0.0


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_not_a_number_is_refused(value: float) -> None:
    with pytest.raises(DomainError):
        CONTACT.force(value)
    with pytest.raises(DomainError):
        CONTACT.deformation(value)


def test_minus_infinity_and_negative_force_are_refused() -> None:
    with pytest.raises(DomainError):
        CONTACT.force(-math.inf)
    with pytest.raises(DomainError, match="contact force is -1 N"):
        CONTACT.deformation(-1.0)


@pytest.mark.parametrize("args", [(0.0, 1e-4), (727.0, 0.0), (math.nan, 1e-4)])
def test_unphysical_contact_is_refused(args: tuple[float, float]) -> None:
    with pytest.raises(DomainError):
        ElasticPlasticSphere(*args)
