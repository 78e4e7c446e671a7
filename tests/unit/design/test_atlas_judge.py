"""All runs of a cell at once, against the whole pipeline and against what spoils them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from long_ones import long

from stepload.contact.rough import RoughSphere
from stepload.design import world
from stepload.design.changes import gauged, known
from stepload.design.course import RATE_HZ, Course, course
from stepload.design.judge import TABLE, Judged, judge
from stepload.design.law import Payload
from stepload.design.reference import reference
from stepload.design.whole import headline
from stepload.design.world import Cell, Runs, press
from stepload.envelope.benches import Bench, bench
from stepload.estimators.conditions import Conditions
from stepload.estimators.judge import ResultVerdict

STVF = bench("stvf", None)
UR = bench("ur10e", None)


def cell_of(rig: Bench, secant: float, told: Conditions | None = None, n: float = 1.5) -> Cell:
    payload = Payload(secant, n, rig.top_n)
    return Cell(
        payload, told or rig.conditions, rig.touch_n,
        rig.zero_drift_n_per_s, rig.damping_n_s_per_m,
    )  # fmt: skip


def pressed(cell: Cell, count: int, seed: int = 3) -> tuple[Course, Runs]:
    plan = course(cell.payload.at_n, cell.touch_n)
    return plan, press(cell, plan, count, np.random.default_rng(seed))


def judged(cell: Cell, plan: Course, runs: Runs) -> Judged:
    return judge(cell.payload, plan, runs, reference(cell, plan))


NEAR_THE_EDGE = {
    "stvf": cell_of(STVF, 1.2e7),
    "rough as stated": cell_of(STVF, 5e6, replace(STVF.conditions, rough_length_m=3.4e-6)),
    "ur10e": cell_of(UR, 2.8e4),
    "gauge": cell_of(UR, 1.4e7, gauged(UR.conditions, 1e-6)),
}


@pytest.mark.parametrize("name", NEAR_THE_EDGE)
@pytest.mark.parametrize("count", [5, *long([8])])
def test_a_cell_at_once_says_what_the_whole_pipeline_says_of_every_run(
    count: int, name: str
) -> None:
    cell = NEAR_THE_EDGE[name]
    plan, runs = pressed(cell, count)
    found = judged(cell, plan, runs)
    same, widths = 0, []
    for number in range(count):
        whole = headline(cell.conditions, plan, runs, number)
        assert whole is not None
        assert found.value_n_per_m[number] == pytest.approx(whole.value_n_per_m, rel=0.02)
        widths.append(float(found.half_width[number]) / whole.half_width)
        same += (whole.verdict is ResultVerdict.IDENTIFIED) == bool(found.identified[number])
    assert widths == pytest.approx([1.0] * count, rel=0.2)
    assert np.median(widths) == pytest.approx(1.0, rel=0.1 if name == "gauge" else 0.03)
    assert same >= count - 1  # a half width of 19.9 % here may be one of 20.1 % there


def test_a_damped_load_path_stays_behind_in_every_ramp() -> None:
    cell = cell_of(STVF, 5e6)
    stiffness = STVF.conditions.sources.system_stiffness_n_per_m
    assert stiffness is not None
    plan, damped = pressed(cell, 2)
    undamped = pressed(replace(cell, damping_n_s_per_m=0.0), 2)[1]
    steady_m = 3.87e4 / stiffness**2 * STVF.top_n / cell.order.steps / cell.order.ramp_s
    quantum_m = STVF.conditions.position_resolution_m
    for stretch in plan.stretches:
        inside = slice(stretch.start + 1, stretch.stop)
        late = np.mean(undamped.travel_m[:, inside] - damped.travel_m[:, inside])
        expected = 0.0 if stretch.held else steady_m * (1.0 if stretch.loading else -1.0)
        assert late == pytest.approx(expected, abs=0.1 * quantum_m)


@pytest.mark.parametrize("last_n", [250.0, 150.0])
def test_beyond_the_table_of_the_deflection_nothing_is_identified(last_n: float) -> None:
    sources = STVF.conditions.sources
    rows = sum(force <= last_n for force in sources.deflection_force_n)
    short = replace(
        sources,
        deflection_force_n=sources.deflection_force_n[:rows],
        deflection_m=sources.deflection_m[:rows],
        deflection_sigma_m=sources.deflection_sigma_m[:rows],
    )
    cell = cell_of(STVF, 3e6, replace(STVF.conditions, sources=short))
    plan, runs = pressed(cell, 4)
    found = judged(cell, plan, runs)
    for number in range(4):
        whole = headline(cell.conditions, plan, runs, number)
        assert whole is not None
        assert whole.verdict is not ResultVerdict.IDENTIFIED
        assert any(f"ends at {last_n:.4g} N" in each for each in whole.why)
    assert not found.identified.any()
    assert found.vetoed[TABLE] == 4
    assert judged(cell_of(STVF, 3e6), plan, runs).vetoed.get(TABLE, 0) == 0


def test_a_soft_payload_is_identified_and_rightly() -> None:
    cell = cell_of(STVF, 3e6)
    plan, runs = pressed(cell, 60)
    found = judged(cell, plan, runs)
    assert found.identified.mean() > 0.9
    assert np.all(np.abs(found.value_n_per_m / found.truth_n_per_m - 1.0) < 0.2)


def test_no_rig_identifies_what_it_cannot_resolve() -> None:
    cell = cell_of(STVF, 1e9)
    plan, runs = pressed(cell, 60)
    assert not judged(cell, plan, runs).identified.any()


def _touch(plan: Course, runs: Runs) -> Runs:
    travel = runs.travel_m.copy()
    travel[:, plan.touches[1]] += 30e-6
    return replace(runs, travel_m=travel)


def _zero(plan: Course, runs: Runs) -> Runs:
    return replace(runs, zero_step_n=runs.zero_step_n + 20.0)


def _drift(plan: Course, runs: Runs) -> Runs:
    return replace(runs, travel_m=runs.travel_m + 0.4e-6 * plan.time_s)


def _second_cycle(plan: Course, runs: Runs) -> Runs:
    """A set that grows with unloading: the second cycle begins where the first one did not."""
    travel = runs.travel_m.copy()
    for each in plan.branch(2, loading=True):
        inside = slice(each.start, each.stop)
        travel[:, inside] += 8e-6 * (1.0 - plan.force_n[inside] / plan.top_n)
    return replace(runs, travel_m=travel)


def _held_longer(plan: Course, runs: Runs) -> Runs:
    """Deformation that goes on in every hold while loading, and has gone at its end."""
    travel = runs.travel_m.copy()
    for each in plan.stretches:
        if each.held and each.loading:
            travel[:, each.start : each.stop] += np.linspace(0.0, 3e-6, each.stop - each.start)
    return replace(runs, travel_m=travel)


def _behind(plan: Course, runs: Runs) -> Runs:
    """Ramps that lie behind the holds, as those of a viscous body do."""
    travel = runs.travel_m.copy()
    for each in plan.stretches:
        if not each.held and each.loading:
            travel[:, each.start : each.stop] -= 4e-6
    return replace(runs, travel_m=travel)


SPOILED: dict[str, Callable[[Course, Runs], Runs]] = {
    "touch_shift": _touch,
    "force_zero": _zero,
    "drift": _drift,
    "set": _second_cycle,
    "gap_change": _second_cycle,
    "reload": _second_cycle,
    "hold_creep": _held_longer,
    "hold_split": _held_longer,
    "rate": _behind,
}


@pytest.mark.parametrize("gate", SPOILED)
def test_every_gate_stops_what_it_is_there_for(gate: str) -> None:
    cell = cell_of(STVF, 5e6)
    plan, runs = pressed(cell, 20)
    spoiled = judged(cell, plan, SPOILED[gate](plan, runs))
    assert spoiled.vetoed.get(gate, 0) == 20
    assert not spoiled.identified.any()


def test_a_steady_drift_is_taken_out_of_every_branch() -> None:
    cell = cell_of(STVF, 5e6)
    plan, runs = pressed(cell, 20)
    clean = judged(cell, plan, runs)
    drift_m = 4e-6 * plan.time_s / plan.time_s[-1]
    drifting = judged(cell, plan, replace(runs, travel_m=runs.travel_m + drift_m))
    assert drifting.value_n_per_m == pytest.approx(clean.value_n_per_m, rel=1e-3)
    assert drifting.half_width == pytest.approx(clean.half_width, rel=0.02)


def test_a_smooth_error_far_beyond_the_stated_one_fits_no_law() -> None:
    cell = cell_of(STVF, 3e6)
    plan, runs = pressed(cell, 10)
    wave = 12e-6 * np.sin(2.0 * np.pi * 5.0 * plan.force_n / plan.top_n)
    found = judged(cell, plan, replace(runs, travel_m=runs.travel_m + wave))
    assert found.vetoed.get("lack_of_fit") == 10


def spread(cell: Cell) -> float:
    plan, runs = pressed(cell, 80)
    found = judged(cell, plan, runs)
    return float(np.std(found.value_n_per_m / found.truth_n_per_m))


def test_a_worse_known_system_makes_worse_headlines_and_wider_intervals() -> None:
    good, bad = (cell_of(STVF, 5e6, known(STVF.conditions, share)) for share in (0.01, 0.1))
    assert spread(bad) > 2.0 * spread(good)
    plan, runs = pressed(bad, 20)
    wide = judged(bad, plan, runs)
    assert np.median(wide.half_width) > 2.0 * np.median(judged(good, *pressed(good, 20)).half_width)
    assert not wide.identified.any()


def test_roughness_and_creep_that_nobody_has_stated_are_in_the_draw(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cell = cell_of(STVF, 5e6)
    _, runs = pressed(cell, 200)
    assert 0.3 < np.mean(runs.rough_m > 0.0) < 0.7
    assert runs.rough_m.max() <= world.ROUGHEST_M
    monkeypatch.setattr(world, "CREEP", 0.4)
    plan, crept = pressed(cell, 40)
    assert judged(cell, plan, crept).vetoed["hold_creep"] > 5


def test_the_truth_of_a_run_counts_its_roughness() -> None:
    cell = cell_of(STVF, 5e6)
    plan, runs = pressed(cell, 2)
    rough_m = np.array([0.0, 3e-6])
    truth = judged(cell, plan, replace(runs, rough_m=rough_m)).truth_n_per_m
    forces = np.linspace(0.1 * STVF.top_n, STVF.top_n, 10)
    deformation_m = cell.payload.deformation_m(forces, rough_m)
    chord = (forces[-1] - forces[0]) / (deformation_m[:, -1] - deformation_m[:, 0])
    assert truth[1] / truth[0] == pytest.approx(chord[1] / chord[0], rel=0.01)
    assert chord[1] / chord[0] > 1.03


def test_the_rough_law_is_that_of_the_paper_above_its_jump_and_has_none() -> None:
    sphere = RoughSphere(6.57e8, 7.5e-6, 300.0)
    secant = 300.0 / (300.0 / 6.57e8) ** (2.0 / 3.0)
    force = np.geomspace(1.0, 300.0, 400)
    ours = Payload(secant, 1.5, 300.0).deformation_m(force, np.array([sphere.scale_m]))[0]
    paper = np.array([sphere.deformation(each).value for each in force])
    ratios = np.array([sphere.pressure_ratio(each) for each in force])
    assert ratios.min() < 0.47 < ratios.max()
    assert ours[ratios > 0.48] == pytest.approx(paper[ratios > 0.48], rel=1e-9)
    assert ours == pytest.approx(paper, rel=0.01)
    assert np.all(np.diff(ours) > 0.0)
    smooth = Payload(secant, 1.5, 300.0)
    assert smooth.deformation_m(force, np.zeros(1))[0] == pytest.approx(smooth.smooth_m(force))


def test_a_course_goes_up_and_down_twice_and_ends_in_a_touch() -> None:
    plan = course(300.0, 4.0)
    assert plan.top_n == 300.0
    assert plan.force_n[list(plan.touches)].tolist() == pytest.approx([4.0 + 46.0 / RATE_HZ, 4.0])
    tops = [s.start for s in plan.stretches if s.held and plan.force_n[s.start] == 300.0]
    assert len(tops) == 2
