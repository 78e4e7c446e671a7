"""Elastic–plastic spheres: branches, their inverse, what is refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload.contact.plastic import EARLY_MEETS, LATE_MEETS, ElasticPlasticSphere

CONTACT = ElasticPlasticSphere.from_law(6.57e8, 727.0)


def test_branches_intersect_where_documented() -> None:
    assert pytest.approx(1.483, abs=5e-4) == EARLY_MEETS
    assert pytest.approx(6.649, abs=5e-4) == LATE_MEETS


def test_elastic_branch_is_the_power_law() -> None:
    for x in (0.01, 0.5, 1.0):
        at_m = x * CONTACT.deformation_c_m
        assert CONTACT.force(at_m) == pytest.approx(6.57e8 * at_m**1.5, rel=1e-12)


@given(st.floats(1e-6, 110.0), st.floats(1.0001, 2.0))
def test_continuous_law_is_monotone(x: float, factor: float) -> None:
    at_m = x * CONTACT.deformation_c_m
    assert CONTACT.force(at_m * factor) > CONTACT.force(at_m)


@given(st.floats(1e-6, 109.0))
def test_continuous_round_trip(x: float) -> None:
    at_m = x * CONTACT.deformation_c_m
    assert CONTACT.deformation(CONTACT.force(at_m)) == pytest.approx(at_m, rel=1e-10)
