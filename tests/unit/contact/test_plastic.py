"""Elastic–plastic spheres: the printed jumps, the continuous law, the ends of the model."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepload.contact.checks import Domain
from stepload.contact.plastic import (
    EARLY_MEETS,
    LATE_MEETS,
    MODEL_END_FORCE,
    ElasticPlasticSphere,
)
from stepload.errors import DomainError

CONTACT = ElasticPlasticSphere.from_law(6.57e8, 727.0)
quick = settings(max_examples=60, deadline=None)
EPS = 1e-9


def force_ratio(x: float) -> float:
    return CONTACT.force(x * CONTACT.deformation_c_m).value / CONTACT.force_c_n


@pytest.mark.parametrize(("x", "jump"), [(1.0, 0.030), (6.0, 0.0168)])
def test_force_jumps_as_printed(x: float, jump: float) -> None:
    assert force_ratio(x * (1 + EPS)) / force_ratio(x * (1 - EPS)) - 1 == pytest.approx(
        jump, abs=5e-5
    )


@pytest.mark.parametrize(("load", "jump"), [(1.0, -0.0205), (13.2, -0.0133)])
def test_deformation_jumps_as_printed(load: float, jump: float) -> None:
    before = CONTACT.deformation(load * CONTACT.force_c_n * (1 - EPS)).value
    after = CONTACT.deformation(load * CONTACT.force_c_n * (1 + EPS)).value
    assert after / before - 1 == pytest.approx(jump, abs=1e-4)


def test_branches_intersect_where_documented() -> None:
    assert pytest.approx(1.483, abs=5e-4) == EARLY_MEETS
    assert pytest.approx(6.649, abs=5e-4) == LATE_MEETS


def test_elastic_branch_is_the_power_law() -> None:
    for x in (0.01, 0.5, 1.0):
        at_m = x * CONTACT.deformation_c_m
        assert CONTACT.force(at_m).value == pytest.approx(6.57e8 * at_m**1.5, rel=1e-12)


@quick
@given(st.floats(1e-6, 110.0), st.floats(1.0001, 2.0))
def test_continuous_law_is_monotone(x: float, factor: float) -> None:
    at_m = x * CONTACT.deformation_c_m
    assert CONTACT.continuous_force(at_m * factor).value > CONTACT.continuous_force(at_m).value


@pytest.mark.parametrize("x", [EARLY_MEETS, LATE_MEETS])
def test_continuous_law_does_not_jump(x: float) -> None:
    at_m = x * CONTACT.deformation_c_m
    below, above = (CONTACT.continuous_force(at_m * (1 + side * EPS)).value for side in (-1, 1))
    assert above / below - 1 == pytest.approx(0.0, abs=1e-8)


@quick
@given(st.floats(1e-6, 109.0))
def test_continuous_round_trip(x: float) -> None:
    at_m = x * CONTACT.deformation_c_m
    force = CONTACT.continuous_force(at_m)
    assert force.inside
    assert CONTACT.continuous_deformation(force.value).value == pytest.approx(at_m, rel=1e-10)


@quick
@given(st.floats(1e-6, 109.0))
def test_printed_round_trip_within_the_jumps(x: float) -> None:
    at_m = x * CONTACT.deformation_c_m
    back = CONTACT.deformation(CONTACT.force(at_m).value).value
    on_an_edge = 0.97 < x < 1.05 or 5.85 < x < 6.15
    assert back == pytest.approx(at_m, rel=0.021 if on_an_edge else 1e-9)


def test_no_model_beyond_the_end() -> None:
    end_m = 110.0 * CONTACT.deformation_c_m
    assert CONTACT.force(end_m * (1 - EPS)).inside
    assert CONTACT.force(end_m * 1.001).domain is Domain.ABOVE
    end_n = MODEL_END_FORCE * CONTACT.force_c_n
    assert CONTACT.deformation(end_n * (1 - EPS)).inside
    assert CONTACT.deformation(end_n * 1.001).domain is Domain.ABOVE
    assert force_ratio(110.0) == pytest.approx(MODEL_END_FORCE, abs=0.05)
    assert force_ratio(6.0 * (1 - EPS)) == pytest.approx(13.2, abs=0.05)


def test_bodies_apart_carry_no_force() -> None:
    assert CONTACT.force(-1e-6) == (0.0, Domain.INSIDE)
    assert CONTACT.deformation(0.0) == (0.0, Domain.INSIDE)


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
