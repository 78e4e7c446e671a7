"""The coverage bench presses what it says, with errors of the sizes it declares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from long_ones import long

from stepload.errors import BadInputError
from stepload.record.rows import Phase
from stepload.report.press_data import LOADING
from stepload_verify.trials.honest.answer import Answer, Outcome, Scored, answer, judged
from stepload_verify.trials.honest.contact import Creep, nothing, press, settled
from stepload_verify.trials.honest.course import HOLDS, course
from stepload_verify.trials.honest.measure import record
from stepload_verify.trials.honest.score import row, verdict, worst
from stepload_verify.trials.honest.worlds import IDEAL, KNOWN, make


def clean(case, **contact):
    """The case without any error of measurement, loop or drift; more to change in its contact."""
    rig = replace(
        case.rig,
        position_resolution_m=1e-6 * case.rig.depth_m,
        position_noise_m=0.0,
        force_resolution_n=1e-7 * case.rig.top_n,
    )
    faults = replace(
        case.faults, gain=0.0, lag_s=0.0, error_m=0.0, noise_n=0.0, zero=nothing, bend=nothing
    )
    system = {"system": lambda force: force / rig.stiffness_n_per_m}
    quiet = {"loss": 0.0, "drift": nothing, "held_force": False, **system, **contact}
    return replace(case, rig=rig, faults=faults, contact=replace(case.contact, **quiet))


def held(data, cycle, phase=Phase.HOLD):
    """(force, travel) at the end of every hold of a cycle."""
    chosen = (data.phase == phase) & (data.cycle == cycle)
    ends = np.flatnonzero(np.diff(np.append(chosen, False).astype(int)) == -1)
    return data.force_n[ends], data.travel_m[ends]


@pytest.mark.parametrize("name", ["sphere", "flat", "rough-declared", "bilinear", "adhesion"])
def test_a_run_without_errors_reads_the_law(name):
    case = clean(make(KNOWN, name, 3))
    data, conditions = record(case)
    force, travel = held(data, 1)
    deformation = travel - force / conditions.sources.system_stiffness_n_per_m
    path = deformation[-1] - deformation[0]
    expected = case.law.deformation(force[-1]) - case.law.deformation(force[0])
    assert path == pytest.approx(float(expected), rel=2e-3)
    again, _ = held(data, 2)
    assert again == pytest.approx(force, rel=1e-4)


@pytest.mark.parametrize("name", KNOWN)
def test_every_world_makes_the_same_finite_record_again(name):
    first, conditions = record(make(KNOWN, name, 11))
    second, _ = record(make(KNOWN, name, 11))
    assert np.isfinite(first.force_n).all()
    assert np.isfinite(first.travel_m).all()
    assert (first.force_n == second.force_n).all()
    assert (first.travel_m == second.travel_m).all()
    loading = first.branch(LOADING, cycle=1)
    assert first.force_n[loading].max() == pytest.approx(conditions.secant_force_n, rel=0.25)
    assert first.travel_m[first.phase == Phase.TARE].max() < 0.0


def test_a_damped_body_is_behind_in_the_ramp_and_at_its_law_in_the_hold():
    still = clean(make(KNOWN, "sphere", 3), held_force=True)
    damped = clean(make(KNOWN, "sphere", 3), held_force=True, damping_s=0.05)
    (one, _), (other, _) = record(still), record(damped)
    # Travel counts from the touch, where the damped body is behind as well.
    apart = one.travel_m - other.travel_m
    ramp = (one.phase == Phase.LOAD) & (one.cycle == 1)
    settled_m = held(one, 1)[1] - held(other, 1)[1]
    behind = np.median(apart[ramp]) - settled_m.mean()
    assert np.ptp(settled_m) < 0.01 * behind
    speed = np.median(np.diff(one.travel_m[ramp])) / (one.time_s[1] - one.time_s[0])
    assert 0.2 < behind / (0.05 * speed) < 1.1


def test_a_hold_keeps_the_position_while_the_force_relaxes():
    case = clean(make(KNOWN, "sphere", 5), creep=Creep((0.1,), (3.0,)))
    run = course(case.procedure, np.random.default_rng(0))
    pressed = press(case.contact, run, 1e-3)
    for each in run.segments:
        if each.phase not in HOLDS:
            continue
        during = slice(each.start, each.stop)
        assert np.ptp(pressed.travel_m[during]) < 2e-3 * case.rig.depth_m
        fell = pressed.force_n[each.start] - pressed.force_n[each.stop - 1]
        if each.phase == Phase.HOLD and each.cycle == 1:
            assert fell > 0.005 * each.to_n


def test_the_loop_loses_what_is_said():
    case = clean(make(KNOWN, "sphere", 5), loss=0.08, held_force=True)
    run = course(case.procedure, np.random.default_rng(0))
    pressed = press(case.contact, run, 1e-3)
    cycle = (run.cycle == 2) & (run.gap == 0.0)
    up = cycle & np.isin(run.phase, LOADING)
    down = cycle & np.isin(run.phase, (Phase.UNLOAD, Phase.UNLOAD_HOLD, Phase.RETRACT))
    grid = np.linspace(0.02, 0.99, 2000) * case.rig.top_n
    body = pressed.travel_m - case.contact.system(pressed.force_n)

    def along(chosen):
        order = np.argsort(pressed.force_n[chosen], kind="stable")
        return np.interp(grid, pressed.force_n[chosen][order], body[chosen][order])

    lost = np.trapezoid(along(down) - along(up), grid)
    stored = np.trapezoid(grid, along(up))
    assert lost / stored == pytest.approx(0.08, rel=0.02)


def test_what_has_yielded_stays_and_is_loaded_again_along_its_unloading():
    case = clean(make(KNOWN, "plastic", 5), held_force=True)
    data, conditions = record(case)
    stiffness = conditions.sources.system_stiffness_n_per_m
    (first_n, first_m), (again_n, again_m) = held(data, 1), held(data, 2)
    first, again = first_m - first_n / stiffness, again_m - again_n / stiffness
    assert again[-1] == pytest.approx(first[-1], abs=1e-3 * case.rig.depth_m)
    assert again[0] > first[0] + 0.002 * case.rig.depth_m


@pytest.mark.parametrize("name", ["sphere", *long(name for name in IDEAL if name != "sphere")])
def test_errors_of_ideal_worlds_have_the_declared_sizes(name):
    cases = [make(KNOWN, name, seed) for seed in range(400)]
    gains = np.array([case.faults.gain / case.rig.gain_sigma for case in cases])
    lags = np.array([case.faults.lag_s / case.rig.lag_sigma_s for case in cases])
    bends = []
    for case in cases:
        force = np.array([case.rig.top_n])
        reading = force * (1.0 + case.faults.gain)
        found = reading / case.contact.system(force)
        bends.append((float(found[0]) / case.rig.stiffness_n_per_m - 1) / case.rig.stiffness_sigma)
        assert case.ideal
        assert case.faults.error_m == case.rig.smooth_m
        assert case.faults.noise_n == case.rig.force_noise_n
        assert case.declared.length_n == case.rig.smooth_length_n
        table_n, table_m = case.declared.table
        line = table_n / case.rig.stiffness_n_per_m
        assert table_m == pytest.approx(line, rel=1e-9, abs=1e-15)
    for drawn in (gains, lags, np.array(bends)):
        assert np.mean(drawn**2) == pytest.approx(1.0, abs=0.22)


def outcome(ideal, *answers):
    scored = tuple(
        Scored("chord", Answer(1.0, low, high, 0.1, 1.0, said), true)
        for low, high, said, true in answers
    )
    return Outcome("a", 1, ideal, False, "", "ur", 1.0, scored)


def test_only_what_is_called_identified_counts():
    outcomes = [
        outcome(True, (0.9, 1.1, "identified", 1.05)),
        outcome(False, (0.9, 1.1, "identified", 1.2)),
        outcome(False, (0.9, 1.1, "marginal", 2.0)),
        outcome(False, (0.9, 1.1, "identified", None)),
        outcome(False),
    ]
    counted = row("a", outcomes, "chord")
    assert (counted.runs, counted.refused, counted.stated) == (5, 1, 4)
    assert (counted.identified, counted.true) == (3, 1)
    assert counted.half_width == pytest.approx(0.1)
    assert [each.truth_n_per_m for _, each in worst(outcomes, "chord")] == [None, 1.2]
    assert not verdict(outcomes, "chord").met
    assert verdict(outcomes[:1], "chord").met


def test_an_answer_is_asked_and_a_refusal_or_a_break_is_told():
    case = make(KNOWN, "sphere", 3)

    def refuse(_press, _conditions):
        raise BadInputError("no")

    def fail(_press, _conditions):
        return {}[1]

    assert {each.quantity for each in judged(case, answer).scored} >= {"chord", "tangent"}
    assert (judged(case, refuse).problem, judged(case, refuse).broken) == ("no", False)
    assert judged(case, fail).broken


@pytest.mark.parametrize("of_force", [False, True])
def test_a_contact_that_has_settled_follows_its_settled_law(of_force):
    creep = Creep((0.1, 0.05), (0.1, 0.2), of_force)
    case = clean(make(KNOWN, "sphere", 5), creep=creep, held_force=True)
    data, conditions = record(case)
    force, travel = held(data, 1)
    deformation = travel - force / conditions.sources.system_stiffness_n_per_m
    law = settled(case.law, creep)
    path = float(law.deformation(force[-1]) - law.deformation(force[0]))
    assert deformation[-1] - deformation[0] == pytest.approx(path, rel=3e-3)
    prompt = float(case.law.deformation(force[-1]) - case.law.deformation(force[0]))
    assert path > 1.05 * prompt


def test_what_leaves_no_trace_counts_in_the_total_alone():
    good = [outcome(True, (0.9, 1.1, "identified", 1.0)) for _ in range(200)]
    bad = [
        replace(outcome(False, (0.9, 1.1, "identified", 2.0)), world="b", undetected=True)
        for _ in range(8)
    ]
    assert verdict([*good, *bad], "chord").met
    assert not verdict([*good, *[replace(each, undetected=False) for each in bad]], "chord").met
    assert not verdict([*good, *bad, *bad], "chord").met
