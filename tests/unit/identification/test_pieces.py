"""A shift between cycles is no compliance: every piece of a run has an intercept of its own."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.identification.system_stiffness import fit_system_stiffness, piece_shifts

KS = 3.49e6
RATE_HZ = 100.0


def cycles(shifts_m, *, tops_n=None, unload=True):
    """Time, travel, force and cycle of loadings (and unloadings) shifted against each other."""
    tops_n = tops_n or [300.0] * len(shifts_m)
    force, travel, number = [], [], []
    for index, (shift_m, top_n) in enumerate(zip(shifts_m, tops_n, strict=True)):
        corners = [9.0, top_n, top_n, *([9.0] if unload else [])]
        leg = np.interp(np.arange(0.0, 12.0, 1 / RATE_HZ), [0.0, 5.0, 7.0, 12.0][: len(corners)],
                        corners)  # fmt: skip
        force.append(leg)
        travel.append(leg / KS + shift_m)
        number.append(np.full(leg.size, index + 1))
    together = np.concatenate(force)
    time_s = np.arange(together.size) / RATE_HZ
    return time_s, np.concatenate(travel), together, np.concatenate(number)


def test_set_between_cycles_does_not_bias_the_stiffness():
    """Only the second loading reaches the upper half: one common zero would bend the line."""
    time_s, travel_m, force_n, cycle = cycles([0.0, 8e-6], tops_n=[180.0, 300.0])
    fit = fit_system_stiffness(time_s, travel_m, force_n, piece=cycle)
    assert fit.stiffness_n_per_m == pytest.approx(KS, rel=1e-3)
    assert fit.msde_m < 1e-8
    hidden = fit_system_stiffness(time_s, travel_m, force_n)
    assert abs(hidden.stiffness_n_per_m / KS - 1.0) > 0.02
    assert hidden.smooth_error_m > 1e-6


def test_a_run_of_one_piece_is_as_before():
    time_s, travel_m, force_n, cycle = cycles([3e-6])
    one = fit_system_stiffness(time_s, travel_m, force_n, piece=cycle)
    plain = fit_system_stiffness(time_s, travel_m, force_n)
    assert one.stiffness_n_per_m == plain.stiffness_n_per_m
    assert one.intercept_n == plain.intercept_n


def test_shifts_are_those_put_in_and_count_from_the_first_of_equals():
    shifts = [2e-6, 5e-6, -1e-6]
    _, travel_m, force_n, cycle = cycles(shifts)
    cell = np.floor(force_n / 5.0).astype(int)
    found, known = piece_shifts(travel_m, cell, cycle)
    assert known.all()
    for number, shift_m in enumerate(shifts, start=1):
        assert found[cycle == number] == pytest.approx(shift_m - shifts[0], abs=1e-12)


def test_a_piece_without_a_force_in_common_is_left_out():
    cell, piece = np.array([0, 1, 2, 7, 8]), np.array([1, 1, 1, 2, 2])
    shift_m, known = piece_shifts(np.array([0.0, 1.0, 2.0, 90.0, 91.0]) * 1e-6, cell, piece)
    assert known.tolist() == [True, True, True, False, False]
    assert np.isfinite(shift_m).all()
    time_s, travel_m, force_n, cycle = cycles([0.0, 50e-6])
    apart = np.where((cycle == 2) & (force_n > 250.0), 3, cycle)
    kept = (cycle == 1) | (apart == 3)
    only_low = (cycle == 1) & (force_n > 240.0)
    use = kept & ~only_low
    fit = fit_system_stiffness(time_s[use], travel_m[use], force_n[use], piece=apart[use])
    assert fit.force_range_n[1] < 245.0
    assert fit.stiffness_n_per_m == pytest.approx(KS, rel=1e-3)
