"""The cells of a map and the answers from them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from stepload.design.map import BUY, PAYLOADS, Map, Point, points, row_of
from stepload.design.map_report import payload_answers, reaches
from stepload.feasibility.map_grid import bench, specimen
from stepload.identification.changes import gauged, known
from stepload.identification.identifiability import k_max
from stepload.identification.quantity import combined
from stepload.plan.shipped import payload_folder

RIG = bench("stvf", None)
SOFT, STIFF = 1e6, 5e7


def cell(secant_n_per_m: float, exponent: float = 1.5) -> Point:
    return Point(
        BUY, 0, math.nan, "", "", secant_n_per_m, exponent, RIG.top_n, RIG.conditions, RIG.touch_n
    )


def test_the_run_of_a_cell_has_the_chord_of_its_law() -> None:
    for n in (1.0, 1.5, 2.0):
        found = cell(SOFT, n).expected().chord
        span_m = RIG.top_n / SOFT * (1.0 - 0.1 ** (1.0 / n))
        assert found.value_n_per_m == pytest.approx(0.9 * RIG.top_n / span_m, rel=2e-3)
        assert (found.from_n, found.to_n) == pytest.approx((30.0, 300.0), rel=5e-3)


def test_the_interval_is_that_of_the_lines_and_grows_with_the_stiffness() -> None:
    soft, stiff = (cell(k).expected().chord for k in (SOFT, 4.0 * SOFT))
    assert soft.half_width == pytest.approx(math.sinh(1.96 * combined(soft.lines)), rel=1e-3)
    assert stiff.half_width > 2.0 * soft.half_width
    system = next(line for line in stiff.lines if line.source == "system stiffness K_s")
    told = RIG.conditions.sources
    assert told.system_stiffness_n_per_m is not None
    share = told.system_stiffness_sigma_n_per_m / told.system_stiffness_n_per_m
    bent_m = float(np.diff(RIG.conditions.bend(np.array([30.0, 300.0])))[0])
    assert system.relative >= share * bent_m * stiff.value_n_per_m / 270.0 * 0.99


def test_a_cell_is_measured_within_1_over_t_and_below_k_max_only() -> None:
    limit = k_max(RIG.conditions, RIG.top_n)
    soft, above, stiff = (row_of(cell(k)) for k in (SOFT, 1.2 * limit, STIFF))
    assert soft.measured
    assert soft.half_width < 0.2
    assert above.narrow
    assert not above.measured
    assert not stiff.narrow


def test_what_narrows_is_computed_with_the_change_made() -> None:
    told = known(RIG.conditions, 0.1)
    now = replace(cell(4.0 * SOFT), conditions=told).expected()
    first = now.narrowing[0]
    assert first.line == "system stiffness K_s"
    better = replace(cell(4.0 * SOFT), conditions=known(told, 0.01)).expected()
    assert first.half_width == pytest.approx(better.chord.half_width, rel=1e-3)
    assert first.half_width < 0.5 * now.chord.half_width
    with_gauge = replace(cell(4.0 * SOFT), conditions=gauged(told, 1e-6)).expected()
    assert with_gauge.chord.half_width < first.half_width


def test_a_payload_that_is_not_pressed_has_no_row_and_the_others_say_what_narrows() -> None:
    files = [payload_folder() / f"plastic-{n}.yaml" for n in ("sphere", "cone")]
    bodies = [specimen("stvf", path, RIG.top_n) for path in files]
    cells = [each for each in points(RIG, bodies, [SOFT, STIFF]) if each.series in (BUY, PAYLOADS)]
    found = Map(RIG, bodies, [row_of(each) for each in cells])
    sphere, cone = payload_answers(found)
    assert (sphere.can, cone.can, cone.row) == ("yes", "no", None)
    assert sphere.row is not None
    assert sphere.best is not None
    assert 0.05 < sphere.row.half_width < 0.08
    assert sphere.best.half_width < 0.5 * sphere.row.half_width
    first = reaches(found)[0]
    assert (first.from_n_per_m, first.beyond_n_per_m) == (SOFT, STIFF)
    assert SOFT <= first.to_n_per_m <= first.k_max_n_per_m
