"""Every threshold of the identification at its edge, and single figures worked out by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pressed_runs import there_and_back

from stepload.errors import DomainError
from stepload.identification.conditions import Conditions, Sources, white_sigmas
from stepload.identification.estimators import (
    EXPONENT_HALF_WIDTH,
    confidence_band,
    decide,
    undetermined,
)
from stepload.identification.fit import Fit, Flag
from stepload.identification.identifiability import Binding, identifiability
from stepload.identification.identify import identify
from stepload.identification.recursive import MEMORY_SHARE, RsRtls
from stepload.identification.run_in import run_in
from stepload.identification.samples import select
from stepload.identification.smooth import NORMAL_95, fit_with_smooth_error, smooth_correlation
from stepload.identification.system_stiffness import fit_system_stiffness
from stepload.units import format_quantity

K, N = 6e8, 1.5
FORCE = np.linspace(5.0, 300.0, 60)
DEFORMATION = (FORCE / K) ** (1.0 / N)


def fit(name: str = "joint", **changes: Any) -> Fit:
    values: dict[str, Any] = {
        "estimator": name, "k": K, "n": N, "zero_m": 0.0, "secant_n_per_m": 300.0 / DEFORMATION[-1],
        "secant_force_n": 300.0, "covariance": None, "force_rms_n": 0.0, "points": 60, "doubts": (),
    }  # fmt: skip
    return Fit(**(values | changes))


# --- feasibility and judgement


def test_k_max_by_hand() -> None:
    found = identifiability(300.0, 2e-6, 3.5e6)
    k_r = 1.5e8
    assert found.resolution_stiffness_n_per_m == pytest.approx(k_r)
    expected = 20 * k_r * 3.5e6 / max(2 * 2 * 20 * 5 * 3.5e6, 2 * 20 * 5 * 3.5e6 + 5 * k_r)
    assert found.k_max_n_per_m == pytest.approx(expected)
    assert found.limit_stiff_resolution_n_per_m == pytest.approx(20 * 3.5e6 / 5)
    assert found.limit_stiff_system_n_per_m == pytest.approx(k_r / 20)
    assert found.binding is Binding.SYSTEM_STIFFNESS
    gauge = identifiability(300.0, 2e-6, None)
    assert gauge.k_max_n_per_m == pytest.approx(k_r / 20)
    assert math.isinf(gauge.limit_stiff_resolution_n_per_m)


def conditions(**changes: Any) -> Conditions:
    values: dict[str, Any] = {"secant_force_n": 300.0, "sources": Sources(3.5e6)}
    names = set(Conditions.__dataclass_fields__)
    defaults: dict[str, Any] = {
        "elastic_limit_n": None, "position_resolution_m": 2e-6, "touch_force_n": 3.0,
        "roughness_m": None, "p": 2.0, "s": 20.0, "t": 5.0,
    }  # fmt: skip
    values |= {name: value for name, value in defaults.items() if name in names}
    return Conditions(**(values | changes))


def headline_of(**changes: Any) -> Any:
    given = conditions(**changes)
    run = there_and_back(FORCE, DEFORMATION + FORCE / 3.5e6, given)
    selected = select(DEFORMATION, FORCE)
    return identify(selected, run)


def test_the_rig_is_judged_at_the_peak_force_and_by_the_coarser_resolution() -> None:
    sources = Sources(3.5e6, position_noise_m=2e-6)
    found = headline_of(position_resolution_m=1e-6, sources=sources)
    peak_n = float(FORCE.max())
    assert found.k_max_n_per_m == identifiability(peak_n, 4e-6, 3.5e6).k_max_n_per_m
    value = format_quantity(found.headline.value_n_per_m, "N/m")
    assert found.reasons[-1].startswith(f"chord stiffness {value} is ")


def test_the_asked_accuracy_decides_what_is_identified() -> None:
    sources = Sources(3.5e6, smooth_error_m=1e-6, smooth_length_n=50.0)
    half = headline_of(sources=sources).headline.half_width
    for t, verdict in ((0.99 / half, "identified"), (1.01 / half, "marginal")):
        assert headline_of(sources=sources, t=t).verdict == verdict


# --- the fit that is selected


def test_an_exponent_is_undetermined_beyond_its_limit() -> None:
    edge = EXPONENT_HALF_WIDTH / NORMAL_95
    assert undetermined(1.5, 0.999 * edge) == ()
    assert undetermined(1.5, 1.001 * edge)[0].flag is Flag.EXPONENT_UNDETERMINED
    assert undetermined(1.5, None) == ()


def test_fits_compare_with_the_paper_where_their_exponents_agree() -> None:
    def comparable(n: float, **options: Any) -> bool:
        fits = {"joint": fit(n=n, zero_m=options.pop("zero_m", 0.0)), "rs_btls": fit("rs_btls")}
        return decide(fits, **options).comparable_with_paper

    assert comparable(1.519)
    assert not comparable(1.521)
    assert not comparable(1.479)
    assert comparable(1.5 + 0.99 * NORMAL_95 * 0.05, covariance=np.diag([0.0, 0.05**2, 0.0]))
    assert not comparable(1.5 + 1.01 * NORMAL_95 * 0.05, covariance=np.diag([0.0, 0.05**2, 0.0]))
    assert not comparable(1.5, zero_m=1e-6, roughness_m=1e-6)
    assert comparable(1.5, zero_m=1e-6)


# --- points and samples


def test_the_system_takes_its_share_of_the_travel() -> None:
    force = np.array([0.0, 35.0])
    travel = np.array([1e-6, 2e-5])
    found = travel - Conditions(Sources(3.5e6), 300.0, 3.0, 1e-6).bend(force)
    assert found == pytest.approx([1e-6, 1e-5])
    for bad in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(DomainError, match="system stiffness"):
            Conditions(Sources(bad), 300.0, 3.0, 1e-6).bend(force)


# --- the recursive fit


def test_samples_at_rest_within_the_band_do_not_enter() -> None:
    force = np.array([10.0, 11.9, 12.1, 12.1, 10.0, 0.0, 14.0])
    deformation = np.array([1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, -1e-6])
    expected = [True, False, True, False, True, False, False]
    recursive = RsRtls(1.0, rest_band_n=2.0)
    used = [recursive.update(d, f) for d, f in zip(deformation, force, strict=True)]
    assert used == expected


def test_a_memory_that_spans_too_little_of_the_force_is_flagged() -> None:
    flagged = []
    for last in (0.5, 0.05):
        recursive = RsRtls(0.9, rest_band_n=-1.0)
        for newton in (*FORCE, *np.linspace((1.0 - last) * 300.0, 300.0, 200)):
            recursive.update((newton / K) ** (1.0 / N), newton)
        flags = {doubt.flag for doubt in recursive.fit().doubts}
        flagged.append(Flag.HOLD_WINDUP in flags)
    # A memory of ten of 200 steps over half of the range spans less of it than a quarter.
    assert flagged == [True, True]
    whole = RsRtls(1.0, rest_band_n=-1.0)
    for newton in FORCE:
        whole.update((newton / K) ** (1.0 / N), newton)
    assert Flag.HOLD_WINDUP not in {doubt.flag for doubt in whole.fit().doubts}
    assert MEMORY_SHARE == 0.25


def test_white_sigmas_of_both_channels() -> None:
    sources = Sources(
        1e6, force_noise_n=0.3, force_resolution_n=1.2, position_noise_m=1e-6,
        position_resolution_m=6e-6,
    )  # fmt: skip
    deformation, force = np.array([1e-6, -4e-6]), np.array([100.0, 300.0])
    sigma_m, sigma_n = white_sigmas(sources, deformation, force)
    assert sigma_n == pytest.approx(math.hypot(0.3, 1.2 / math.sqrt(12.0)))
    assert sigma_m == pytest.approx(math.hypot(1e-6, 6e-6 / math.sqrt(12.0), sigma_n / 1e6))
    assert white_sigmas(Sources(None), deformation, force) == pytest.approx((4e-12, 3e-4))
    small = white_sigmas(Sources(None), 1e-3 * deformation, 1e-6 * force)
    assert small == pytest.approx((4e-15, 3e-10)), "what is left to a channel scales with it"


# --- smooth errors, K_s, run-in, comparison


def test_a_smooth_error_is_correlated_over_its_length() -> None:
    found = smooth_correlation(np.array([0.0, 50.0, 100.0]), 50.0)
    assert found[0] == pytest.approx([1.0, math.exp(-0.5), math.exp(-2.0)])
    for bad in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(DomainError, match="length"):
            smooth_correlation(FORCE, bad)


def test_a_known_white_error_is_not_counted_as_smooth_but_for_a_quarter() -> None:
    chance = np.random.default_rng(1)
    columns = np.stack([np.ones_like(FORCE), FORCE], axis=1)
    y = 1e-6 * chance.normal(size=FORCE.size)
    plain = fit_with_smooth_error(columns, y, FORCE, 50.0)
    half = fit_with_smooth_error(columns, y, FORCE, 50.0, white_sd=0.5e-6)
    square = plain.rms**2 * FORCE.size
    share = 1.0 - 0.25e-12 * 58 / square
    assert half.smooth_sd == pytest.approx(plain.smooth_sd * math.sqrt(share))
    most = fit_with_smooth_error(columns, y, FORCE, 50.0, white_sd=1.0)
    assert most.smooth_sd == pytest.approx(0.5 * plain.smooth_sd)
    with pytest.raises(DomainError, match="at least 4"):
        fit_with_smooth_error(columns[:3], y[:3], FORCE[:3], 50.0)


def ramp(stiffness: float = 3.5e6, **options: Any) -> Any:
    time = np.linspace(0.0, 10.0, 4000)
    force = 500.0 * (1.0 - np.abs(time - 5.0) / 5.0)
    wave = 2e-7 * np.sin(force / 30.0)
    return fit_system_stiffness(time, force / stiffness + 1e-5 + wave, force, **options)


def test_stiffness_uses_the_forces_above_its_share_of_the_top() -> None:
    for fraction in (0.4, 0.6):
        found = ramp(min_force_fraction=fraction)
        low, high = found.force_range_n
        assert fraction * 500.0 <= low < (fraction + 0.02) * 500.0
        assert high > 0.98 * 500.0
        assert found.stiffness_n_per_m == pytest.approx(3.5e6, rel=0.03)
    for bad in (-0.1, 0.9, 1.5):
        with pytest.raises(DomainError, match="min_force_fraction"):
            ramp(min_force_fraction=bad)
    with pytest.raises(DomainError, match="must be positive"):
        ramp(-3.5e6)
    known = ramp(known_error_m=1e-7)
    assert known.smooth_degrees is None
    assert ramp().smooth_degrees is not None
    assert ramp().sigma_n_per_m > known.sigma_n_per_m
    assert known.stiffness_upper_n_per_m >= known.stiffness_n_per_m + NORMAL_95 * (
        known.sigma_n_per_m
    )


def cycles(secants: list[float], loops: list[float]) -> Any:
    """Linear loading and unloading cycles with these stiffnesses and loop widths."""
    deformation, force, number = [], [], []
    up = np.linspace(0.0, 100.0, 400)
    for index, (secant, loop) in enumerate(zip(secants, loops, strict=True), 1):
        for branch, width in ((up, 0.0), (up[::-1], loop)):
            force.append(branch)
            deformation.append(branch / secant - width * 5e-6 * branch * (100.0 - branch) / 2500.0)
            number.append(np.full(branch.size, index))
    return run_in(
        np.concatenate(deformation), np.concatenate(force), np.concatenate(number),
        secant_force_n=80.0, lift_off=False,
    )  # fmt: skip


def test_cycles_are_steady_within_one_percent_of_stiffness_and_ten_of_energy() -> None:
    loops = [1.0, 1.0, 1.0]
    assert cycles([1e6, 1e6, 1.009e6], loops).steady is not None
    assert cycles([1e6, 1e6, 1.012e6], loops).steady is None
    assert cycles([1e6, 1.012e6, 1e6], loops).steady is None
    assert cycles([9e5, 1e6, 1e6, 1e6], [1.0, *loops]).steady is not None
    even = [1e6] * 3
    assert cycles(even, [1.0, 1.0, 1.09]).steady is not None
    assert cycles(even, [1.0, 1.0, 1.13]).steady is None
    assert cycles(even[:2], loops[:2]).steady is None
    thin = cycles(even, [0.0, 0.0, 0.0002])
    assert thin.steady is not None
    found = cycles(even, [1.0, 1.0, 1.0])
    assert found.energy_tolerance == pytest.approx(0.1)
    assert found.secant_tolerance == 0.01
    # The parabola's area between 5 and 98 N, which both branches reach.
    up = np.linspace(4.9, 98.0, 4000)
    area = float(np.trapezoid(-5e-6 * up * (100.0 - up) / 2500.0, up))
    assert found.cycles[0].loop_energy_j == pytest.approx(area, rel=0.02)
    assert found.cycles[0].stored_energy_j == pytest.approx(0.5 * 98.0**2 / 1e6, rel=0.01)


def test_a_band_carries_both_parameters_and_their_correlation() -> None:
    covariance = np.array([[4e-4, -1e-5, 0.0], [-1e-5, 1e-6, 0.0], [0.0, 0.0, 0.0]])
    x = np.array([1e-5, 1e-4])
    lower_n, upper_n = confidence_band(fit(), covariance, x)
    variance = 4e-4 - 2e-5 * np.log(x) + 1e-6 * np.log(x) ** 2
    assert np.log(upper_n / (K * x**N)) == pytest.approx(1.959964 * np.sqrt(variance))
    assert np.log(K * x**N / lower_n) == pytest.approx(1.959964 * np.sqrt(variance))
    with pytest.raises(DomainError, match="positive deformations"):
        confidence_band(fit(), covariance, np.array([0.0]))


def test_a_bend_of_the_rig_is_a_doubt_about_its_stiffness() -> None:
    time = np.linspace(0.0, 10.0, 4000)
    force = 500.0 * (1.0 - np.abs(time - 5.0) / 5.0)
    bent = force / 3.5e6 * (1.0 + 0.2 * force / 500.0)
    found = fit_system_stiffness(time, bent, force, known_error_m=1e-8)
    assert found.bend_sigma_n_per_m > 0.0
    own = found.error_gain_n_per_m2 * 1e-8
    assert found.sigma_n_per_m == pytest.approx(math.hypot(own, found.bend_sigma_n_per_m))


def test_the_bound_of_the_damping_is_below_what_was_fitted() -> None:
    time = np.linspace(0.0, 10.0, 4000)
    travel = 1.4e-4 * (1.0 - np.abs(time - 5.0) / 5.0)
    force = np.maximum(3.5e6 * travel + 2e5 * np.gradient(travel, time), 0.0)
    bounds = [
        fit_system_stiffness(time, travel, force, known_error_m=error_m)
        for error_m in (1e-9, 1e-6, 1e-4)
    ]
    for found in bounds:
        assert found.damping_n_s_per_m == pytest.approx(2e5, rel=0.1)
    lows = [found.damping_lower_bound_n_s_per_m for found in bounds]
    assert lows[0] > 0.9 * bounds[0].damping_n_s_per_m
    assert lows[0] > lows[1] > lows[2] == 0.0
