"""Every error that a map says it draws is in its runs, alone and of its size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from stepload.design import world
from stepload.design.course import Course, course
from stepload.design.law import Payload
from stepload.design.world import Cell, Runs, press
from stepload.envelope.benches import bench
from stepload.estimators.sources import Sources

FloatArray = NDArray[np.float64]
STVF = bench("stvf", None)
TOP_N, SECANT, COUNT = 300.0, 5e6, 400
DEPTH_M = TOP_N / SECANT
STIFFNESS = 3.49e6


@pytest.fixture(autouse=True)
def _nothing_of_the_payload(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("CREEP", "LOOP", "DRIFT_SHARE", "NOT_REPEATED"):
        monkeypatch.setattr(world, name, 0.0)


def drawn(count: int = COUNT, drift_n_per_s: float = 0.0, **one: Any) -> tuple[Course, Runs]:
    """Runs with these sources of error, and no others."""
    sources = Sources(system_stiffness_n_per_m=STIFFNESS, **one)
    told = replace(STVF.conditions, sources=sources, rough_length_m=0.0)
    cell = Cell(Payload(SECANT, 1.5, TOP_N), told, 4.0, drift_n_per_s)
    plan = course(TOP_N, 4.0)
    return plan, press(cell, plan, count, np.random.default_rng(1))


@pytest.fixture(autouse=True)
def _no_seat(monkeypatch: pytest.MonkeyPatch) -> None:
    """No seat at small force, which a rig without a table of its pose has."""
    monkeypatch.setattr(
        type(STVF.conditions), "bend_sigma", lambda _, force: np.zeros((1, force.size))
    )


def at_top(plan: Course) -> NDArray[np.intp]:
    """Samples of the hold at the top of the first cycle."""
    top = next(s for s in plan.stretches if s.held and plan.force_n[s.start] == TOP_N)
    return np.arange(top.start, top.stop)


def clean() -> tuple[Course, FloatArray]:
    """The travel of a run without any error."""
    plan, runs = drawn(1)
    return plan, runs.travel_m[0]


def test_without_errors_the_travel_is_that_of_payload_and_rig() -> None:
    plan, travel = clean()
    assert travel[at_top(plan)] == pytest.approx(DEPTH_M + TOP_N / STIFFNESS)
    assert drawn(2)[1].force_n == pytest.approx(np.stack([plan.force_n] * 2))


def spread_of_travel(plan: Course, runs: Runs) -> float:
    return float(np.std(runs.travel_m[:, at_top(plan)[0]] - clean()[1][at_top(plan)[0]]))


@pytest.mark.parametrize(
    ("one", "size_m"),
    [
        ({"position_noise_m": 1e-6}, 1e-6),
        ({"position_resolution_m": 4e-6}, 4e-6 / np.sqrt(12.0)),
        ({"smooth_error_m": 2e-6, "smooth_length_n": 50.0}, 2e-6),
        (
            {"deflection_force_n": (100.0, 200.0, 300.0),
             "deflection_m": (1e2 / STIFFNESS, 2e2 / STIFFNESS, 3e2 / STIFFNESS),
             "deflection_sigma_m": (2e-6,) * 3},
            2e-6,
        ),
        ({"temperature_sigma_k": 1.0, "modulus_per_k": 0.01}, 0.01 * DEPTH_M / 1.5),
    ],
)  # fmt: skip
def test_an_error_of_the_travel_has_its_stated_size(one: dict[str, Any], size_m: float) -> None:
    assert spread_of_travel(*drawn(**one)) == pytest.approx(size_m, rel=0.15)


@pytest.mark.parametrize(
    ("one", "size_n"),
    [
        ({"force_noise_n": 2.0}, 2.0),
        ({"force_resolution_n": 8.0}, 4.0),
        ({"gain_sigma": 0.02}, 0.02 * TOP_N),
    ],
)
def test_an_error_of_the_force_has_its_stated_size(one: dict[str, Any], size_n: float) -> None:
    plan, runs = drawn(**one)
    found = np.std(runs.force_n[:, at_top(plan)[0]] - TOP_N)
    assert found == pytest.approx(size_n, rel=0.15)


def test_a_gain_that_is_off_was_off_in_the_calibration_too() -> None:
    plan, runs = drawn(gain_sigma=0.02)
    assert spread_of_travel(plan, runs) == pytest.approx(0.02 * TOP_N / STIFFNESS, rel=0.15)


def test_the_zero_of_the_force_drifts_within_what_is_stated() -> None:
    plan, runs = drawn(drift_n_per_s=0.1)
    most_n = 0.1 * float(plan.time_s[-1]) / 2.0
    assert np.abs(runs.zero_step_n).max() == pytest.approx(most_n, rel=0.05)
    assert runs.zero_step_n.min() < -0.9 * most_n


def ramps(plan: Course, *, loading: bool) -> NDArray[np.intp]:
    """Samples within ramps, but for the first of each."""
    return np.concatenate(
        [np.arange(s.start + 1, s.stop) for s in plan.stretches
         if not s.held and s.loading == loading]
    )  # fmt: skip


def test_travel_that_is_recorded_late_lies_off_in_the_ramps_alone() -> None:
    plan, travel = clean()
    off = drawn(lag_sigma_s=0.01)[1].travel_m - travel
    assert np.abs(off[:, at_top(plan)]).max() < 1e-12
    rate = np.diff(travel, prepend=travel[0]) * world.RATE_HZ
    inside = ramps(plan, loading=True)
    assert np.std(off[:, inside] / rate[inside]) == pytest.approx(0.01, rel=0.15)


def share(name: str, value: float, measure: Callable[[Course, FloatArray], FloatArray],
          monkeypatch: pytest.MonkeyPatch) -> FloatArray:  # fmt: skip
    """What a share of the payload's own does to the travel of each run."""
    plan, travel = clean()
    monkeypatch.setattr(world, name, value)
    return measure(plan, drawn()[1].travel_m - travel)


def test_half_of_the_runs_creep_by_up_to_the_share_that_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    last = share("CREEP", 0.1, lambda plan, off: off[:, at_top(plan)[-1]], monkeypatch)
    assert 0.4 < np.mean(last > 0.0) < 0.6
    assert 0.05 * DEPTH_M < last.max() < 0.1 * DEPTH_M


def test_a_loop_lies_beyond_the_loading(monkeypatch: pytest.MonkeyPatch) -> None:
    down = share(
        "LOOP", 0.1, lambda plan, off: off[:, ramps(plan, loading=False)].max(axis=1), monkeypatch
    )
    assert down.min() >= 0.0
    assert down.max() > 0.05 * DEPTH_M


def test_the_travel_drifts_to_both_sides(monkeypatch: pytest.MonkeyPatch) -> None:
    end = share("DRIFT_SHARE", 0.01, lambda plan, off: off[:, -1], monkeypatch)
    assert end.min() < -0.015 * DEPTH_M
    assert 0.015 * DEPTH_M < end.max() < 0.021 * DEPTH_M


def test_the_smooth_error_repeats_in_part_only(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, _ = clean()
    tops = [s.start for s in plan.stretches if s.held and plan.force_n[s.start] == TOP_N]

    def between() -> float:
        travel = drawn(smooth_error_m=2e-6, smooth_length_n=50.0)[1].travel_m
        return float(np.std(travel[:, tops[1]] - travel[:, tops[0]]))

    assert between() < 1e-12
    monkeypatch.setattr(world, "NOT_REPEATED", 0.5)
    assert between() > 0.3e-6


def test_a_stated_length_is_not_the_true_one(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[float] = []
    kept = world.smooth_correlation

    def noted(grid: FloatArray, length_n: float) -> FloatArray:
        seen.append(length_n)
        return kept(grid, length_n)

    monkeypatch.setattr(world, "smooth_correlation", noted)
    drawn(8, smooth_error_m=2e-6, smooth_length_n=50.0)
    assert len(set(seen)) > 2
    assert 25.0 <= min(seen) < max(seen) <= 100.0


def test_a_stated_roughness_is_not_exactly_the_true_one() -> None:
    told = replace(STVF.conditions, rough_length_m=3e-6)
    found = world._roughness(told, COUNT, np.random.default_rng(1))
    assert np.std(np.log(found / 3e-6)) == pytest.approx(world.ROUGH_SIGMA, rel=0.15)
    told = replace(told, rough_length_sigma=0.4)
    found = world._roughness(told, COUNT, np.random.default_rng(1))
    assert np.std(np.log(found / 3e-6)) == pytest.approx(0.4, rel=0.15)
