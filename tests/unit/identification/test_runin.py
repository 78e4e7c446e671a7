"""Run-in on cycles whose stiffening, loop and indentation were put in."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import trapezoid

from stepload.identification.run_in import ENERGY_CHANGE, SPAN_OF_THREE, run_in

TOP_N, K = 300.0, 6.57e8


def cycles(settling, *, low_n=3.0, loop=0.02, seed=None, points=300):
    """Loading (F/K)^(2/3) + settling[i]·F/TOP; unloading wider by loop·δ(TOP)·F(TOP−F)·4/TOP²."""
    deformation, force, number = [], [], []
    for i, extra in enumerate(settling):
        up = np.linspace(low_n, TOP_N, points)
        path = np.concatenate([up, np.full(points // 2, TOP_N), up[::-1]])
        elastic = (path / K) ** (2 / 3) + extra * path / TOP_N
        wider = loop * (TOP_N / K) ** (2 / 3) * 4 * path * (TOP_N - path) / TOP_N**2
        wider[: points + points // 2] = 0.0
        deformation.append(elastic + wider)
        force.append(path)
        number.append(np.full(path.size, i + 1))
    d, f, c = np.concatenate(deformation), np.concatenate(force), np.concatenate(number)
    if seed is not None:
        rng = np.random.default_rng(seed)
        d = np.round((d + rng.normal(0, 2e-7, d.size)) / 1e-6) * 1e-6
        f = f + rng.normal(0, 0.5, f.size)
    return d, f, c


def test_virgin_and_steady_are_apart():
    settling = [6e-6, 2e-6, 0.2e-6, 0.1e-6, 0.0]
    result = run_in(*cycles(settling), secant_force_n=TOP_N, lift_off=False)
    assert result.virgin.number == 1
    assert result.steady is not None
    assert result.steady.number == 5
    assert result.steady.chord_n_per_m > 1.08 * result.virgin.chord_n_per_m
    assert result.steady.fit.n == pytest.approx(1.5, abs=0.002)
    assert result.steady.fit.k == pytest.approx(K, rel=0.03)
    assert result.virgin.fit.n < 1.45
    assert result.residual_indentation_m is None


def test_while_it_still_changes_there_is_no_steady_cycle():
    result = run_in(*cycles([6e-6, 4e-6, 2e-6]), secant_force_n=TOP_N, lift_off=False)
    assert result.steady is None
    assert result.secant_change > result.secant_tolerance == 0.01


def test_a_wide_uncertainty_widens_the_criterion():
    data = cycles([0.9e-6, 0.4e-6, 0.0])
    strict = run_in(*data, secant_force_n=TOP_N, lift_off=False)
    loose = run_in(*data, secant_force_n=TOP_N, lift_off=False, secant_sigma=0.01)
    assert strict.steady is None
    assert loose.steady is not None
    assert loose.secant_tolerance == 0.02


def test_a_changing_loop_is_not_steady():
    parts = [cycles([0.0], loop=x) for x in (0.06, 0.05, 0.04)]
    d = np.concatenate([p[0] for p in parts])
    f = np.concatenate([p[1] for p in parts])
    c = np.repeat([1, 2, 3], parts[0][0].size)
    result = run_in(d, f, c, secant_force_n=TOP_N, lift_off=False)
    assert result.secant_change < 1e-6
    assert result.energy_change == pytest.approx(0.02 / 0.05, rel=0.05)
    assert result.steady is None


def test_loop_energy_is_the_area():
    result = run_in(*cycles([0.0], loop=0.05), secant_force_n=TOP_N, lift_off=False)
    # ∫ 0.05 δ_top · 4F(T−F)/T² dF over 5 … 98 % of T
    t = np.linspace(0.05 * 0.98 * TOP_N, 0.98 * TOP_N, 2000)
    area = trapezoid(0.05 * (TOP_N / K) ** (2 / 3) * 4 * t * (TOP_N - t) / TOP_N**2, t)
    assert result.virgin.loop_energy_j == pytest.approx(area, rel=0.02)
    elastic = trapezoid(t, (t / K) ** (2 / 3))
    assert result.virgin.stored_energy_j == pytest.approx(elastic, rel=0.01)


def test_noise_does_not_keep_an_elastic_contact_from_being_steady():
    data = cycles([0.0] * 3, loop=0.0, seed=1)
    result = run_in(*data, secant_force_n=TOP_N, lift_off=False)
    assert result.steady is not None
    assert abs(result.steady.loop_energy_j) < 0.005 * result.steady.stored_energy_j


def test_residual_indentation_is_the_shift_of_the_touch():
    data = cycles([0.0] * 3)
    touches = np.array([0.0, 1.1e-6, 1.4e-6, 1.5e-6])
    result = run_in(*data, secant_force_n=TOP_N, lift_off=True, touch_m=touches)
    assert result.residual_indentation_m == pytest.approx(1.5e-6)
    kept = run_in(*data, secant_force_n=TOP_N, lift_off=False, touch_m=touches)
    assert kept.residual_indentation_m is None


def test_shakedown_is_seen_without_lift_off():
    d, f, c = cycles([0.0] * 3, low_n=10.0)
    result = run_in(d + 1e-6 * (c == 3), f, c, secant_force_n=TOP_N, lift_off=False)
    assert result.shakedown_m == pytest.approx(1e-6, rel=1e-6)


def test_noise_of_the_loops_is_no_change_of_them():
    result = run_in(
        *cycles([0.0] * 4, seed=3, low_n=9.0), secant_force_n=TOP_N, lift_off=False,
        secant_sigma=0.01,
    )  # fmt: skip
    loops = [c.loop_energy_j for c in result.cycles]
    assert np.ptp(loops) < SPAN_OF_THREE * result.cycles[0].loop_sigma_j * 2.0
    assert result.steady is not None
    clean = run_in(*cycles([0.0] * 3), secant_force_n=TOP_N, lift_off=False)
    assert clean.energy_tolerance == ENERGY_CHANGE


def test_a_last_cycle_that_is_not_unloaded_to_the_end_does_not_cut_the_loading():
    d, f, c = cycles([0.0, 0.0, 0.0])
    last = np.flatnonzero(c == 3)
    kept = np.ones(f.size, dtype=bool)
    kept[last[(np.arange(last.size) > 300) & (f[last] < 100.0)]] = False
    result = run_in(d[kept], f[kept], c[kept], secant_force_n=TOP_N, lift_off=False)
    whole = run_in(d, f, c, secant_force_n=TOP_N, lift_off=False)
    assert [x.fit.n for x in result.cycles] == pytest.approx([x.fit.n for x in whole.cycles])
    assert result.cycles[0].chord_n_per_m == pytest.approx(whole.cycles[0].chord_n_per_m)
    assert result.cycles[0].loop_energy_j < 0.9 * whole.cycles[0].loop_energy_j
