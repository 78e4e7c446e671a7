"""Rough spheres: domain flags, limits and the documented exceptions to monotonicity."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload.contact.rough import P0_BRANCH, RoughSphere
from stepload.errors import DomainError

K = 6.57e8
contacts = st.builds(RoughSphere, st.just(K), st.floats(1e-8, 3e-5), st.floats(1.0, 1e4))


def force_at(contact: RoughSphere, p0: float) -> float:
    """Force where (11) gives p0."""
    return float(K * (contact.scale_m * p0 / (1.0 - p0)) ** 1.5)


def printed(contact: RoughSphere, force_n: float) -> float:
    """(10)–(12) literally, with α."""
    smooth_m = (force_n / K) ** (2 / 3)
    alpha = contact.roughness_m / smooth_m
    p0 = 1 / (1 + 1.22 * alpha * contact.kappa**-0.16)
    a = 1.605 / math.sqrt(p0) if p0 <= 0.47 else 3.51 - 2.51 * p0
    return smooth_m * (0.5 * a**2 + 8 * p0 * a / (math.pi**2 * (4.79 - 3.17 * p0**3.13)))


@given(contacts, st.floats(1e-2, 1e4))
def test_equals_the_printed_equations(contact: RoughSphere, force_n: float) -> None:
    assert contact.deformation(force_n) == pytest.approx(printed(contact, force_n), rel=1e-11)


@given(contacts, st.floats(0.011, 0.99), st.floats(1.0001, 1.5))
def test_deformation_rises_except_across_the_branch(
    contact: RoughSphere, p0: float, factor: float
) -> None:
    low, high = force_at(contact, p0), force_at(contact, p0) * factor
    crosses = contact.pressure_ratio(low) <= P0_BRANCH < contact.pressure_ratio(high)
    if not crosses:
        assert contact.deformation(high) > contact.deformation(low)


def test_zero_force_has_a_finite_limit() -> None:
    contact = RoughSphere(K, 7.5e-6, 257.0)
    assert contact.deformation(0.0) == pytest.approx(1.5715 * 7.5e-6 * 257.0**-0.16, rel=1e-4)


def test_tends_to_the_smooth_sphere() -> None:
    contact = RoughSphere(K, 1e-15, 257.0)
    smooth_m = (300.0 / K) ** (2 / 3)
    assert contact.deformation(300.0) / smooth_m == pytest.approx(1.00035, abs=1e-5)


@pytest.mark.parametrize("force_n", [-1.0, math.nan, math.inf])
def test_force_outside_the_model_is_refused(force_n: float) -> None:
    contact = RoughSphere(K, 7.5e-6, 257.0)
    with pytest.raises(DomainError, match="contact force"):
        contact.deformation(force_n)
