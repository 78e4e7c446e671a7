"""Lateral force: what is taken out, how sure it is, and what runs tell of it."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.identification.lateral_coupling import (
    CROSS_COMPLIANCE,
    EXTRAPOLATED,
    LEAST_GAIN,
    Across,
    AcrossFit,
    fit_across,
)
from stepload.identification.smooth import smooth_correlation
from stepload.identification.system_stiffness import Cells, SeriesContact

K_S = 1e5
C = np.array([4e-6, -1.5e-6])
"""What the arm of these tests gives way along the axis, in m per newton across it."""
DRY, GREASED = np.array([0.2, -0.1]), np.array([0.06, -0.03])
LENGTH_N = 8.0
CONTACT = SeriesContact(2e8, 1.0, 0.1)


def cells(share: np.ndarray, seed: int, noise_m: float = 1e-6, points: int = 60) -> Cells:
    """A run against a block: up and down, with a smooth error and force across in proportion."""
    rng = np.random.default_rng(seed)
    force = np.concatenate([np.linspace(2.0, 50.0, points), np.linspace(50.0, 2.0, points)])
    across = np.outer(force, share)
    rate = np.repeat([1e-5, -1e-5], points)
    grid = np.linspace(0.0, 50.0, 60)
    alike = smooth_correlation(grid, LENGTH_N) + 1e-8 * np.eye(60)
    error = np.interp(force, grid, noise_m * (np.linalg.cholesky(alike) @ rng.standard_normal(60)))
    travel = force / K_S + across @ C + CONTACT.deformation_m(force) - 2e-3 * rate + error
    return Cells(force, travel + 1e-4 * rng.standard_normal(), rate, across, rate >= 0.0)


def fitted(*shares: np.ndarray, seed: int = 0, noise_m: float = 1e-6) -> AcrossFit:
    return fit_across(
        [cells(share, 100 * seed + i, noise_m) for i, share in enumerate(shares)],
        contacts=[CONTACT] * len(shares),
        length_n=LENGTH_N,
    )


def doubt(known: Across, share: np.ndarray, stiffness_n_per_m: float) -> float:
    """Standard uncertainty in m of the correction per newton of axial force."""
    return float(np.hypot.reduce(known.errors_m_per_n(share, stiffness_n_per_m)))


def test_what_is_taken_out_has_the_sign_of_the_travel_that_it_makes() -> None:
    across_n = np.array([[10.0, 0.0], [0.0, 10.0]])
    force_n = np.array([50.0, 50.0])
    plain = Across((C[0], C[1]))
    assert plain.taken_m(force_n, across_n) == pytest.approx(10.0 * C)
    beside = Across((C[0], C[1]), at_share=(0.1, 0.0))
    assert beside.taken_m(force_n, across_n) == pytest.approx(10.0 * C - 5.0 * C[0])
    assert Across(at_share=(0.1, 0.0)).taken_m(force_n, across_n) == pytest.approx([0.0, 0.0])


def test_at_the_shares_of_the_calibration_nothing_is_in_doubt_and_beyond_them_more() -> None:
    known = Across((C[0], C[1]), (1e-7, 2e-7), 0.0, (0.1, 0.0), reach=0.1)
    assert doubt(known, np.array([0.1, 0.0]), K_S) == 0.0
    assert doubt(known, np.array([0.2, 0.0]), K_S) == pytest.approx(1e-8)
    assert doubt(known, np.array([0.1, 0.1]), K_S) == pytest.approx(2e-8)
    beyond = 0.3 - 0.1 * EXTRAPOLATED
    assert doubt(known, np.array([0.4, 0.0]), K_S) == pytest.approx(
        np.hypot(3e-8, CROSS_COMPLIANCE / K_S * beyond)
    )


def test_errors_that_belong_together_cancel_in_one_direction() -> None:
    alike = Across((0.0, 0.0), (1e-7, 1e-7), -1.0, reach=0.3)
    assert doubt(alike, np.array([0.1, 0.1]), K_S) == pytest.approx(0.0, abs=1e-15)
    assert doubt(alike, np.array([0.1, -0.1]), K_S) == pytest.approx(2e-8)


def test_noise_of_the_force_across_becomes_noise_of_the_travel() -> None:
    assert Across((3e-6, 4e-6)).noise_m(np.sqrt(2.0) * 0.1) == pytest.approx(5e-7)
    assert Across((3e-6, 4e-6)).noise_m(np.nan) == Across().noise_m(0.1) == 0.0


def test_a_dry_and_a_greased_block_tell_one_direction_and_claim_nothing_of_the_other() -> None:
    found = fitted(DRY, GREASED)
    assert found.directions.shape == (1, 2)
    along = found.directions[0]
    assert abs(along @ DRY) == pytest.approx(np.linalg.norm(DRY), rel=1e-3)
    c = np.array(found.across.per_newton_m)
    assert abs(c @ along - C @ along) < 3.0 * found.sigma_m_per_n[0]
    assert found.sigma_m_per_n[0] < LEAST_GAIN * CROSS_COMPLIANCE / K_S
    square = np.array([-along[1], along[0]])
    assert c @ square == pytest.approx(0.0, abs=1e-12)
    assert square @ found.across.covariance @ square == pytest.approx(
        (CROSS_COMPLIANCE * 1.0 / found.stiffness_n_per_m) ** 2, rel=1e-6
    )
    assert along @ found.across.covariance @ along == pytest.approx(found.sigma_m_per_n[0] ** 2)


def test_moves_both_ways_tell_both_directions() -> None:
    aside = np.array([0.05, 0.15])
    found = fitted(DRY, GREASED, aside, -aside)
    assert found.directions.shape == (2, 2)
    off = np.array(found.across.per_newton_m) - C
    assert off @ np.linalg.solve(found.across.covariance, off) < 12.0


def test_runs_of_one_friction_tell_its_share_and_nothing_else() -> None:
    found = fitted(DRY, DRY)
    assert found.across.per_newton_m is None
    assert found.across.at_share == pytest.approx(tuple(DRY))
    assert not found.directions.size


def test_the_shares_that_it_holds_at_are_those_of_the_mean_and_how_far_the_runs_went() -> None:
    found = fitted(DRY, GREASED)
    assert found.across.at_share == pytest.approx(tuple(0.5 * (DRY + GREASED)), abs=1e-6)
    assert found.across.reach == pytest.approx(0.5 * np.linalg.norm(DRY - GREASED), rel=1e-4)
    assert found.shares == pytest.approx(np.stack([DRY, GREASED]))


def test_its_error_is_as_large_as_it_says() -> None:
    """Over 40 pairs of runs: c along the one direction, over its standard uncertainty."""
    off = []
    for seed in range(40):
        found = fitted(DRY, GREASED, seed=seed + 1)
        off.append((found.across.per_newton_m - C) @ found.directions[0] / found.sigma_m_per_n[0])
    assert 0.5 < float(np.sqrt(np.mean(np.square(off)))) < 1.1
    assert sum(abs(each) < 1.96 for each in off) >= 37


def test_a_share_that_points_the_other_way_than_the_calibration_counts_as_unknown() -> None:
    """A sensor that was turned by half a turn since then shows the payload's share like that."""
    known = Across((1e-6, 0.0), (1e-9, 1e-9), 0.0, at_share=(0.1, 0.0), reach=0.3)
    along, against = (doubt(known, np.array([t, 0.0]), K_S) for t in (0.1, -0.1))
    assert against > 20.0 * along
    assert against == pytest.approx(CROSS_COMPLIANCE / K_S * 0.1, rel=0.01)
