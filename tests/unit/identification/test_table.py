"""The table of the system's deflection and the smooth error's length, from simulated K_s runs."""

from __future__ import annotations

import numpy as np
import pytest
from long_ones import long

from stepload.identification.pooled_stiffness import (
    MeasuredTable,
    measure_length,
    measured_table,
    pool,
)
from stepload.identification.smooth import smooth_correlation
from stepload.identification.system_stiffness import (
    SeriesContact,
    SystemStiffnessFit,
    fit_system_stiffness,
)

KS, CS, RATE_HZ = 3.49e6, 3.87e4, 100.0
CONTACT = SeriesContact(5e10, 1.5, 0.1)
QUANTUM_M = 2e-6


def soft_m(force_n: np.ndarray) -> np.ndarray:
    """A load path twice as soft near 0 N as at 300 N."""
    return force_n / KS + 8e-6 * (1.0 - np.exp(-force_n / 60.0))


def run(
    seed: int, law=lambda force: force / KS, smooth_m: float = 1e-7, zero_m: float = 0.0
) -> SystemStiffnessFit:
    """The fit of one loading in 30 N steps."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, 30.0, 1 / RATE_HZ)
    inside = time_s % 3.0
    force = 30.0 * (time_s // 3.0) + 30.0 * np.minimum(inside, 1.0) + 3.0
    rate = np.where(inside < 1.0, 30.0, 0.0)
    grid = np.linspace(0.0, 340.0, 80)
    root = np.linalg.cholesky(smooth_correlation(grid, 50.0) + 1e-9 * np.eye(80))
    error = np.interp(force, grid, smooth_m * root @ rng.standard_normal(80))
    travel = zero_m + law(force) - CS / KS * rate / KS + CONTACT.deformation_m(force) + error
    travel = QUANTUM_M * np.floor(travel / QUANTUM_M + rng.random())
    piece = np.ones(force.size, int)
    return fit_system_stiffness(
        time_s, travel, force, contact=CONTACT, piece=piece, resolution_m=QUANTUM_M, length_n=50.0
    )


def table_of(*fits: SystemStiffnessFit) -> MeasuredTable:
    return measured_table(fits, pool(fits), resolution_m=QUANTUM_M)


def test_a_straight_load_path_gives_the_line_within_its_uncertainty() -> None:
    made = [table_of(*(run(10 * group + i) for i in range(3))) for group in range(8)]
    far = []
    for each in made:
        assert each.table is not None
        force, deep = np.array(each.table.force_n), np.array(each.table.deflection_m)
        left = deep - force / KS
        far += list((left - left.mean()) / np.array(each.table.sigma_m))
        assert 4 <= force.size <= 24
        assert force[-1] > 285.0
        assert force[0] < 60.0
    assert np.mean(np.abs(far) < 1.96) > 0.9


def test_a_soft_beginning_is_in_the_table_which_no_line_tells() -> None:
    table = table_of(*(run(seed, soft_m, zero_m=seed * 7e-6) for seed in range(3))).table
    assert table is not None
    force = np.linspace(60.0, 290.0, 50)
    shape = table.at(force) - table.at(force[:1])
    truth = soft_m(force) - soft_m(force[:1])
    assert shape == pytest.approx(truth, abs=1.2e-6)
    line = (force - force[0]) / pool([run(0, soft_m)]).stiffness_n_per_m
    assert np.abs(line - truth).max() > 2.0 * np.abs(shape - truth).max()


def test_it_begins_at_zero_and_has_the_contact_in_common() -> None:
    found = table_of(run(1), run(2, zero_m=5e-5))
    assert found.table is not None
    assert found.table.at(np.zeros(1))[0] == 0.0
    assert found.table.deflection_m[0] == pytest.approx(found.table.force_n[0] / KS, abs=1.5e-6)
    share = run(1).contact_share
    assert found.common == pytest.approx(0.1 * share, rel=0.05)


def test_more_runs_make_its_rows_surer() -> None:
    one, three = table_of(run(1)), table_of(*(run(seed) for seed in range(3)))
    assert one.table is not None
    assert three.table is not None
    assert three.table.sigma_m[0] < 0.7 * one.table.sigma_m[0]


def test_a_table_is_of_the_loading_where_the_unloading_lies_elsewhere() -> None:
    time_s = np.arange(0.0, 60.0, 0.01)
    force = 305.0 - 300.0 * np.abs(time_s - 30.0) / 30.0
    loading = time_s < 30.0
    travel = force / KS + np.where(loading, 0.0, 5e-6 * np.sin(np.pi * force / 300.0))
    fit = fit_system_stiffness(time_s, travel, force, contact=SeriesContact(5e20, 1.5, 0.1),
                               loading=loading)  # fmt: skip
    table = measured_table([fit], pool([fit]), resolution_m=0.0).table
    assert table is not None
    found = np.diff(table.deflection_m) * KS / np.diff(table.force_n)
    assert found == pytest.approx(np.ones(found.size), rel=0.02)


FORCE = np.linspace(9.0, 300.0, 60)


def misfits(length_n: float, count: int, seed: int, white: float = 0.2) -> list:
    rng = np.random.default_rng(seed)
    root = np.linalg.cholesky(smooth_correlation(FORCE, length_n) + 1e-9 * np.eye(60))
    return [
        (FORCE, 5e-7 * (root @ rng.standard_normal(60) + white * rng.standard_normal(60)))
        for _ in range(count)
    ]


@pytest.mark.parametrize("length_n", [*long([15.0]), 40.0])
def test_the_length_of_the_smooth_error_is_measured_from_several_runs(length_n: float) -> None:
    found = [measure_length(misfits(length_n, 3, seed)) for seed in range(8)]
    told = [each for each in found if each is not None]
    assert len(told) >= 6
    assert sum(each.low_n <= length_n <= each.high_n for each in told) >= len(told) - 1
    assert all(each.length_n / 1.49 > each.low_n for each in told)


def test_runs_that_repeat_one_error_tell_no_more_than_one() -> None:
    """A short run that cannot tell alone, told three times: as three it would tell."""
    for seed in range(6, 30):
        one = misfits(60.0, 1, seed, white=0.5)
        if measure_length(one) is None and measure_length(one * 3) is not None:
            assert measure_length(one * 3, runs=1.0) is None
            return
    pytest.fail("no misfit that three copies would have determined")
