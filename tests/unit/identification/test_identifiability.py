"""K_max against the paper's figures, its limit cases and its inverses."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload.errors import DomainError
from stepload.identification.identifiability import Binding, gauge_resolution_for, identifiability

forces = st.floats(1.0, 1e4)
resolutions = st.floats(1e-8, 1e-4)
stiffnesses = st.floats(1e3, 1e9)


def test_stvf_is_ten_to_the_6_9() -> None:
    assert round(math.log10(identifiability(300.0, 2e-6, 3.49e6).k_max_n_per_m), 1) == 6.9


@given(forces, resolutions, stiffnesses)
def test_the_max_switches_where_k_r_is_p_s_k_s(force: float, step: float, k_s: float) -> None:
    found = identifiability(force, step, k_s)
    k_r = found.resolution_stiffness_n_per_m
    expected = Binding.SYSTEM_STIFFNESS if k_r > 40.0 * k_s else Binding.RESOLUTION
    assert found.binding is expected
    assert found.k_max_n_per_m <= found.limit_stiff_system_n_per_m * (1 + 1e-12)


@given(forces, stiffnesses)
def test_limit_cases(force: float, k_s: float) -> None:
    fine = identifiability(force, force / (k_s * 1e12), k_s)
    assert fine.k_max_n_per_m == pytest.approx(fine.limit_stiff_resolution_n_per_m, rel=1e-6)
    coarse = identifiability(force, force / (k_s * 1e-6), k_s)
    assert coarse.k_max_n_per_m == pytest.approx(coarse.limit_stiff_system_n_per_m)


@given(forces, stiffnesses)
def test_the_gauge_asked_for_is_just_enough(force: float, secant: float) -> None:
    step = gauge_resolution_for(secant, force)
    assert identifiability(force, step, None).k_max_n_per_m == pytest.approx(secant)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_no_number_that_is_not_finite_and_positive(bad: float) -> None:
    with pytest.raises(DomainError):
        identifiability(bad, 2e-6, 3.49e6)
    with pytest.raises(DomainError):
        identifiability(300.0, 2e-6, bad)
