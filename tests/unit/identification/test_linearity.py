"""A force sensor that is not straight: its line in the budget, and where it is zero."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.identification.budget import errors_of
from stepload.identification.conditions import (
    ASSUMED_NONLINEARITY,
    Conditions,
    Sources,
    linearity_errors,
)
from stepload.identification.elastic import Elastic
from stepload.identification.loops import Branch, Path
from stepload.identification.run_data import RunData

FORCE = np.linspace(0.0, 300.0, 301)


def test_each_shape_departs_by_the_stated_share_at_most():
    # A rectangle of half width 3 N has an sd of 3 N/√3, and each of two shapes 1/√2 of it.
    largest = np.abs(linearity_errors(FORCE, 0.01)).max(axis=1)
    assert largest == pytest.approx(3.0 / np.sqrt(6.0), rel=1e-3)


def test_a_bow_is_even_and_an_s_is_odd_about_the_middle():
    bow, s = linearity_errors(FORCE, 0.02)
    assert bow == pytest.approx(bow[::-1])
    assert s == pytest.approx(-s[::-1])


def test_the_evidence_has_a_line_of_it_as_the_whole_chain_is_compliant():
    ones = np.ones(10)
    path = Path(
        time_s=ones, force_n=np.linspace(30.0, 300.0, 10), travel_m=ones, count=ones, span_m=ones,
        rate_n_per_s=ones, held=np.zeros(10, dtype=np.intp),
    )  # fmt: skip
    softness = 2e-7
    run = RunData([], Conditions(Sources(2.5e6, nonlinearity=0.01), 300.0, 3.0, 2e-6))
    elastic = Elastic(300.0 * softness, 1.0, 300.0, lambda force: force * softness)
    first = Branch(path, path.force_n * softness, ())
    found = {part.source: part for part in errors_of(run, first, elastic, None, 50.0)}
    expected = 4e-7 * linearity_errors(path.force_n, 0.01)
    line = found["force linearity"]
    assert line.covariance == pytest.approx(expected.T @ expected)
    assert line.size == "1 %"
    assert ASSUMED_NONLINEARITY == 0.005
