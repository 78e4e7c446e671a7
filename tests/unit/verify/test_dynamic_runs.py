"""The bench that presses with the whole engine: its plans go, its truths are true."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stepload.contact.rough import RoughSphere
from stepload.engine.rehearse import world_for
from stepload.envelope.envelope import derive
from stepload.plan.load import load_plan
from stepload.rig.world import PayloadTruth
from stepload.session.experiment import run_plan
from stepload_drivers.sim.contact import path_give
from stepload_verify.trials.dynamic.press import drawn, judged, settled, truth
from stepload_verify.trials.dynamic.worlds import ALL
from stepload_verify.trials.honest.answer import Answer

K = 6.57e8
SMOOTH = PayloadTruth("smooth", K, 1.5, math.inf, 0.0, 0.0, 0.0, math.inf)
ANSWER = Answer(6e6, 5e6, 7e6, 30.0, 300.0, "identified")


def hertz(force_n: float) -> float:
    return (force_n / K) ** (2.0 / 3.0)


@pytest.mark.parametrize("world", ALL)
def test_every_world_has_plans_that_may_go_and_is_its_plan_with_something_wrong(
    world: str, tmp_path: Path
) -> None:
    draft, story, envelope = drawn(world, 3, tmp_path)
    assert ALL[world].fits(draft)
    assert envelope.plan.procedure.top_force_n < envelope.theory.elastic_limit_n
    assert bool(story) == (world != "as-declared")
    again, _, _ = drawn(world, 3, tmp_path)
    assert again.text == draft.text


def test_the_table_of_a_soft_load_path_is_the_path_that_is_pressed(tmp_path: Path) -> None:
    draft, _, envelope = drawn("soft-path-table", 3, tmp_path)
    spec = world_for(envelope)
    stated = envelope.plan.rig.system_stiffness
    give = path_give(spec)
    assert give is not None
    true_m = np.array(
        [
            force / spec.system_stiffness_n_per_m + give(force)[0]
            for force in stated.deflection_force_n
        ]
    )
    assert stated.deflection_m == pytest.approx(true_m, rel=5.0 * draft.stiffness_sigma)
    alone_m = np.array(stated.deflection_force_n) / spec.system_stiffness_n_per_m
    assert stated.deflection_m[0] > 1.03 * alone_m[0]


def test_the_truth_is_the_first_loading_at_the_forces_of_the_answer() -> None:
    path_m = hertz(300.0) - hertz(30.0)
    assert truth(SMOOTH, "chord", ANSWER) == pytest.approx(270.0 / path_m)
    assert truth(SMOOTH, "secant_from_touch", ANSWER) == pytest.approx(300.0 / hertz(300.0))
    assert truth(SMOOTH, "tangent", ANSWER) == pytest.approx(450.0 / hertz(300.0), rel=1e-3)
    assert truth(SMOOTH, "secant_from_mean_plane", ANSWER) is None


def test_a_pad_belongs_to_the_truth_and_a_seat_does_not() -> None:
    padded = replace(SMOOTH, pad_stiffness_n_per_m=1e7, pad_depth_m=1e-5)
    path_m = hertz(300.0) - hertz(30.0) + 1e-5 - 30.0 / 1e7
    assert truth(padded, "chord", ANSWER) == pytest.approx(270.0 / path_m)
    seated = replace(SMOOTH, seating_m=5e-6, seating_depth_m=2e-5)
    assert truth(seated, "chord", ANSWER) == truth(SMOOTH, "chord", ANSWER)


def test_a_rough_contact_has_a_secant_from_its_touch_and_one_from_its_mean_plane() -> None:
    rough = replace(SMOOTH, law="rough", roughness_m=5e-6, kappa=3.0)
    law = RoughSphere(K, 5e-6, 3.0)
    deep_m, touch_m = law.deformation(300.0), law.deformation(0.0)
    assert touch_m > 1e-6
    from_touch = truth(rough, "secant_from_touch", ANSWER)
    assert from_touch == pytest.approx(300.0 / (deep_m - touch_m), rel=1e-6)
    assert truth(rough, "secant_from_mean_plane", ANSWER) == pytest.approx(300.0 / deep_m)


def test_creep_within_a_ramp_is_as_true_as_none_and_slower_creep_is_not() -> None:
    quick = replace(SMOOTH, creep=0.1, creep_time_s=0.5)
    assert settled(quick, 1.1e6) == pytest.approx(1e6)
    assert settled(replace(quick, creep_decades=1), 1.1e6) is None
    assert settled(SMOOTH, 1.1e6) is None


@pytest.mark.long
def test_a_case_is_what_the_dry_run_of_its_plan_says_and_scored(tmp_path: Path) -> None:
    outcome = judged("as-declared", 6, quick=True, keep=tmp_path)
    dry = run_plan(derive(load_plan(tmp_path / "plan.yaml")), dry_run=True, out=tmp_path / "dry")
    assert outcome.problem == outcome.stop == ""
    assert 0.0 < outcome.peak < 1.0
    chord = next(each for each in outcome.scored if each.quantity == "chord")
    assert chord.believed
    assert chord.answer.value_n_per_m == dry.data["headline"]["value_n_per_m"]
    assert abs(chord.off) < chord.answer.half_width
