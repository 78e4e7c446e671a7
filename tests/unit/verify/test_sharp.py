"""Contacts of boundary elements, errors as stated: the intervals hold, and are no wider than that.

`bench/sharpness.py` is the long form.
"""

from __future__ import annotations

from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

from stepload_verify.trials.boundary.curves import contacts
from stepload_verify.trials.sharp import Row, of_contacts, score, stated, table, unstated

PLAN = Path(__file__).parents[3] / "procedures" / "plastic-sphere.yaml"
LEAST, BY_CHANCE = 0.93, 1e-3
"""Least coverage, and the probability that draws of it fail the test."""
BODIES = list(contacts())
RUNS = 3
"""Of each body."""


def pooled(runs: int, ask) -> tuple[dict[str, list[Row]], int]:
    """The rows of all bodies by figure, and how many runs were refused."""
    tables = [table(world, runs, 1, ask) for world in of_contacts(PLAN, BODIES)]
    kinds = chain.from_iterable(found for found, _ in tables)
    return (
        {kind: [row for found, _ in tables for row in found.get(kind, [])] for kind in kinds},
        sum(refused for _, refused in tables),
    )


def least_held(runs: int) -> float:
    """A share held that intervals of the least coverage fall below by chance only."""
    return float(binom.ppf(BY_CHANCE, runs, LEAST)) / runs


@pytest.fixture(scope="module")
def rows() -> dict[str, list[Row]]:
    found, refused = pooled(RUNS, stated)
    assert refused == 0
    return found


@pytest.mark.parametrize(
    ("kind", "widest"), [("chord", 1.3), ("secant_from_touch", 1.5), ("tangent", 1.5)]
)
def test_intervals_hold_the_truth_and_are_narrow(
    rows: dict[str, list[Row]], kind: str, widest: float
) -> None:
    found = score(rows[kind])
    assert found.runs == RUNS * len(BODIES)
    assert found.held >= least_held(found.runs)
    assert found.ratio <= widest
    assert found.identified >= 0.8


def test_a_file_of_which_only_the_stiffness_is_stated_is_identified() -> None:
    found, refused = pooled(1, unstated)
    chord = score(found["chord"])
    assert refused == 0
    assert chord.held >= least_held(chord.runs)
    assert chord.identified >= 0.6


def test_a_ball_of_boundary_elements_is_hertzian() -> None:
    ball = next(each for each in BODIES if each.name == "sphere")
    force_n = np.array([10.0, 100.0, 300.0])
    hertz_m = (force_n / (4.0 / 3.0 * 2.75e9 / 0.91 * 28.7e-3**0.5)) ** (2.0 / 3.0)
    assert ball.loading.at(force_n) == pytest.approx(hertz_m, rel=2e-3)
    assert ball.exponent(4.0, 300.0) == pytest.approx(1.5, abs=2e-3)


def test_hard_bodies_keep_what_was_pressed_in() -> None:
    hard = [each for each in BODIES if each.again is not None]
    assert len(BODIES) >= 8
    assert len(hard) == 2
    for each in hard:
        assert each.again is not None
        gap_m = each.again.at(30.0) - each.loading.at(30.0)
        assert 0.5e-6 < float(gap_m) < 10e-6
