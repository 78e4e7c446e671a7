"""Loss per cycle of loops that were put in."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.estimators.cycles import loss
from stepload.estimators.fit import Missing
from stepload.estimators.smooth import smooth_correlation

K, N, TOP_N = 6.57e8, 1.5, 300.0


def cycles(loops, *, seed=None, lag_s=0.0, low=15.0, seconds=6.0):
    """Cycles at 1 kHz whose way down is wider by loop · 4 (F/T)(1 − F/T) of the deformation."""
    count = int(seconds * 1000)
    time, deformation, force, cycle = [], [], [], []
    for i, loop in enumerate(loops):
        up = np.linspace(low, TOP_N, count)
        path = np.concatenate([up, np.full(count // 4, TOP_N), up[::-1]])
        deep = (path / K) ** (1.0 / N)
        wider = loop * (TOP_N / K) ** (1.0 / N) * 4.0 * path * (TOP_N - path) / TOP_N**2
        wider[: count + count // 4] = 0.0
        start = i * (path.size * 1e-3 + 1.0)
        time.append(start + 1e-3 * np.arange(path.size))
        deformation.append(deep + wider)
        force.append(path)
        cycle.append(np.full(path.size, i + 1))
    t, d, f, c = (np.concatenate(part) for part in (time, deformation, force, cycle))
    if lag_s:
        f = np.concatenate([
            np.interp(t[c == i] - lag_s, t[c == i], f[c == i]) for i in np.unique(c)
        ])  # fmt: skip
    if seed is not None:
        rng = np.random.default_rng(seed)
        d = np.round((d + rng.normal(0.0, 2e-7, d.size)) / 1e-6) * 1e-6
        f = f + rng.normal(0.0, 0.5, f.size)
    return t, d, f, c


def true_j(loop, low=15.0):
    high = 0.98 * TOP_N
    force = np.linspace(low, high, 10001)
    wider = loop * (TOP_N / K) ** (1.0 / N) * 4.0 * force * (TOP_N - force) / TOP_N**2
    return float(np.sum(0.5 * (wider[1:] + wider[:-1]) * np.diff(force)))


def test_energy_of_one_cycle_and_of_two():
    one = loss(*cycles([0.05]), lag_sigma_s=0.0)
    assert len(one.cycles) == 1
    assert one.cycles[0].energy_j == pytest.approx(true_j(0.05), rel=0.02)
    assert one.cycles[0].resolved
    assert one.change is None
    two = loss(*cycles([0.06, 0.02]), lag_sigma_s=0.0)
    assert [c.cycle for c in two.cycles] == [1, 2]
    assert two.cycles[1].energy_j == pytest.approx(true_j(0.02), rel=0.03)
    assert two.change == pytest.approx(two.cycles[1].share - two.cycles[0].share)
    assert two.change < -3 * two.change_sigma


def test_share_is_of_the_energy_stored():
    found = loss(*cycles([0.05]), lag_sigma_s=0.0).cycles[0]
    high = 0.98 * TOP_N
    # ∫ F dδ of the law between the two forces.
    work = (high ** (1 + 1 / N) - 15.0 ** (1 + 1 / N)) * K ** (-1 / N) / (N + 1)
    assert found.stored_j == pytest.approx(work, rel=0.02)
    assert found.share == pytest.approx(found.energy_j / found.stored_j)


def test_no_loop_is_not_resolved_in_noise_and_quanta():
    for seed in range(5):
        found = loss(*cycles([0.0, 0.0], seed=seed), lag_sigma_s=1e-3)
        assert not any(each.resolved for each in found.cycles)


def test_a_loop_that_a_lag_explains_is_not_resolved():
    late = cycles([0.0], lag_s=-2e-3)
    unaware = loss(*late, lag_sigma_s=0.0).cycles[0]
    aware = loss(*late, lag_sigma_s=2e-3).cycles[0]
    assert unaware.resolved
    assert not aware.resolved
    assert aware.sigma_j == pytest.approx(unaware.energy_j, rel=0.3)


def test_what_has_no_loop_is_told():
    t, d, f, c = cycles([0.05])
    assert isinstance(loss(t, d, f, np.zeros_like(c), lag_sigma_s=0.0), Missing)
    up = slice(0, 6000)
    only_up = loss(t[up], d[up], f[up], c[up], lag_sigma_s=0.0)
    assert isinstance(only_up, Missing)
    assert "no unloading" in only_up.why
    few = loss(t[:5], d[:5], f[:5], c[:5], lag_sigma_s=0.0)
    assert isinstance(few, Missing)
    assert "fewer than" in few.why


def test_an_error_of_travel_that_differs_from_branch_to_branch_is_in_the_uncertainty():
    t, d, f, c = cycles([0.05])
    top, size_m, length_n = int(np.argmax(f)), 1e-6, 50.0
    grid = np.linspace(0.0, TOP_N, 80)
    root = np.linalg.cholesky(smooth_correlation(grid, length_n) + 1e-9 * np.eye(80))
    rng, found = np.random.default_rng(5), []
    for _ in range(60):
        up, down = (np.interp(f, grid, size_m * root @ rng.standard_normal(80)) for _ in "12")
        moved = d + np.where(np.arange(f.size) <= top, up, down)
        each = loss(t, moved, f, c, lag_sigma_s=0.0, travel_sigma_m=size_m, length_n=length_n)
        found.append((each.cycles[0].energy_j - true_j(0.05)) / each.cycles[0].sigma_j)
    assert 0.75 < float(np.sqrt(np.mean(np.square(found)))) < 1.25
