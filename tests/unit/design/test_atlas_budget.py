"""Every line of the budget of many runs at once widens their intervals, by itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from stepload.design import judge as room
from stepload.design.course import Course, course
from stepload.design.judge import Judged, judge
from stepload.design.law import Payload
from stepload.design.reference import Reference, reference
from stepload.design.world import Cell, Runs, press
from stepload.envelope.benches import bench
from stepload.estimators.smooth import NORMAL_95

STVF = bench("stvf", None)
CELL = Cell(
    Payload(5e6, 1.5, STVF.top_n), STVF.conditions, STVF.touch_n,
    STVF.zero_drift_n_per_s, STVF.damping_n_s_per_m,
)  # fmt: skip
PLAN = course(STVF.top_n, CELL.touch_n)
OWN = reference(CELL, PLAN)


@pytest.fixture(scope="module")
def runs() -> Runs:
    return press(CELL, PLAN, 6, np.random.default_rng(3))


def relative(found: Judged) -> float:
    """Median relative standard uncertainty."""
    return float(np.median(np.arcsinh(found.half_width))) / NORMAL_95


def judged(runs: Runs, own: Reference = OWN) -> Judged:
    return judge(CELL.payload, PLAN, runs, own)


def other_sources(**changed: float) -> Reference:
    return replace(OWN, told=replace(OWN.told, sources=replace(OWN.told.sources, **changed)))


def gain(runs: Runs) -> Judged:
    return judged(runs, other_sources(gain_sigma=0.2))


def warming(runs: Runs) -> Judged:
    return judged(runs, other_sources(temperature_sigma_k=2.0, modulus_per_k=0.1))


def zero(runs: Runs) -> Judged:
    return judged(replace(runs, zero_step_n=runs.zero_step_n + 60.0))


def time(runs: Runs) -> Judged:
    """Ramps that lie behind the holds: what time did to this run."""
    travel = runs.travel_m.copy()
    for each in PLAN.stretches:
        if not each.held and each.loading:
            travel[:, each.start : each.stop] -= 15e-6
    return judged(replace(runs, travel_m=travel))


def creep(runs: Runs) -> Judged:
    travel = runs.travel_m.copy()
    for each in PLAN.stretches:
        if each.held:
            travel[:, each.start : each.stop] += np.linspace(0.0, 6e-6, each.stop - each.start)
    return judged(replace(runs, travel_m=travel))


@pytest.mark.parametrize(
    ("worse", "least"), [(gain, 0.1), (warming, 0.1), (zero, 0.02), (time, 0.1), (creep, 0.1)]
)
def test_a_larger_error_is_a_wider_interval(
    runs: Runs, worse: Callable[[Runs], Judged], least: float
) -> None:
    before, after = relative(judged(runs)), relative(worse(runs))
    assert math.sqrt(max(after**2 - before**2, 0.0)) > least


def test_the_interval_is_no_narrower_than_its_sources_make_it(runs: Runs) -> None:
    span = float(OWN.branches[0].deformation_m @ OWN.main.weights)
    assert relative(judged(runs)) > 0.9 * OWN.fixed_m / span


def test_a_law_that_reads_another_chord_widens_the_interval(
    runs: Runs, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(room, "_shape", lambda *_: np.full(6, 0.4))
    assert relative(judged(runs)) > 0.2


def test_a_steady_drift_changes_no_headline(runs: Runs) -> None:
    def drifting(plan: Course) -> Runs:
        return replace(runs, travel_m=runs.travel_m + 1e-6 * plan.time_s)

    assert judged(drifting(PLAN)).value_n_per_m == pytest.approx(
        judged(runs).value_n_per_m, rel=1e-2
    )


def test_the_truth_of_a_rough_payload_is_its_own(runs: Runs) -> None:
    """Its chord is stiffer: counted from the mean plane, most of what the tips give is at the
    lower end already."""
    rough, smooth = (replace(runs, rough_m=np.full(6, length)) for length in (3e-6, 0.0))
    stiffer = judged(rough).truth_n_per_m / judged(smooth).truth_n_per_m
    assert np.all(stiffer > 1.03)
