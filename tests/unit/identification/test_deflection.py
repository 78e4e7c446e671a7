"""The table δ_s(F) in place of F/K_s: interpolation, its uncertainty in the budget, its limits."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.errors import DomainError
from stepload.identification.deflection import DeflectionTable
from stepload.identification.fit import Fit
from stepload.identification.inverse_law import joint
from stepload.identification.samples import select
from stepload.identification.smooth import smooth_lengths

KS, K, N = 3.49e6, 6.57e8, 1.5
FORCE = np.linspace(3.0, 300.0, 400)
ROWS_N = (25.0, 50.0, 75.0, 100.0, 150.0, 200.0, 250.0, 300.0)


def soft_m(force_n: np.ndarray) -> np.ndarray:
    """A load path twice as soft near 0 N as at 300 N."""
    return force_n / KS + 8e-6 * (1.0 - np.exp(-force_n / 60.0))


TABLE = DeflectionTable(
    ROWS_N, tuple(soft_m(np.array(ROWS_N)).tolist()), tuple([2e-7] * len(ROWS_N))
)
FIT = Fit("joint", K, N, 0.0, 5.06e6, 300.0, None, 0.0, 400)


def test_between_the_rows_it_is_monotone_and_close_to_the_curve() -> None:
    assert TABLE.at(np.array(ROWS_N)) == pytest.approx(TABLE.deflection_m)
    assert TABLE.at(FORCE) == pytest.approx(soft_m(FORCE), abs=3e-7)
    assert (np.diff(TABLE.at(np.linspace(-50.0, 500.0, 2000))) > 0.0).all()
    assert TABLE.at(np.zeros(1))[0] == 0.0
    assert TABLE.at(-FORCE) == pytest.approx(-TABLE.at(FORCE))


def test_beyond_its_rows_it_goes_straight_on_and_that_is_a_doubt() -> None:
    last = (TABLE.deflection_m[-1] - TABLE.deflection_m[-2]) / 50.0
    assert TABLE.at(np.array([400.0]))[0] == pytest.approx(TABLE.deflection_m[-1] + 100.0 * last)
    assert TABLE.beyond(310.0) == ""
    assert "ends at 300 N, the data reach 320 N" in TABLE.beyond(320.0)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (((100.0, 100.0), (1e-5, 2e-5), (1e-7, 1e-7)), "a force of 100 after 100"),
        (((100.0, 200.0), (2e-5, 1e-5), (1e-7, 1e-7)), "a deflection of 1e-05 after 2e-05"),
        (((100.0, np.nan), (1e-5, 2e-5), (1e-7, 1e-7)), "a force of nan"),
        (((0.0, 100.0), (1e-5, 2e-5), (1e-7, 1e-7)), "a force of 0 after 0"),
        (((100.0, 200.0), (1e-5, 2e-5), (1e-7, -1e-7)), "an uncertainty of -1e-07"),
        (((100.0, 200.0), (1e-5, 2e-5), (1e-7,)), "every row needs all three"),
        (((), (), ()), "0 rows"),
    ],
)
def test_what_is_no_table_is_refused(rows: tuple[tuple[float, ...], ...], said: str) -> None:
    with pytest.raises(DomainError, match=said):
        DeflectionTable(*rows)


def test_a_load_path_that_is_no_line_biases_k_s_and_not_the_table() -> None:
    deep = (FORCE / K) ** (1.0 / N)
    travel = deep + soft_m(FORCE)
    taken = select(travel - TABLE.at(FORCE), FORCE)
    assert taken.deformation_m == pytest.approx(deep, abs=3e-7)
    by_table = joint(taken.deformation_m, FORCE, secant_force_n=300.0)
    assert by_table.secant_n_per_m == pytest.approx(FIT.secant_n_per_m, rel=0.02)
    line = joint(travel - FORCE / KS, FORCE, secant_force_n=300.0)
    assert abs(line.secant_n_per_m / FIT.secant_n_per_m - 1.0) > 0.05


def test_a_length_that_is_not_known_is_carried_as_a_range() -> None:
    assert smooth_lengths(40.0, 300.0) == (40.0,)
    lengths = smooth_lengths(None, 300.0)
    assert (lengths[0], lengths[-1]) == pytest.approx((25.0, 200.0))
    for bad in (np.nan, 0.0, -1.0):
        with pytest.raises(DomainError, match="must be positive"):
            smooth_lengths(bad, 300.0)
        with pytest.raises(DomainError, match="peak force"):
            smooth_lengths(None, bad)
