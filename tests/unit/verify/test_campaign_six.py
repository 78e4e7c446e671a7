"""The campaign on rigs with six axes: what is sound, what is wrong, and what is claimed."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from random import Random

import numpy as np
import pytest

from stepload.feasibility.bounds import stuck_ratio
from stepload.plan.load import load_plan
from stepload.plan.model import Structure
from stepload.rig.world import WorldFault
from stepload_verify.campaign.mounts import LARGEST_SHARE, draw_stance, mounted
from stepload_verify.campaign.result import Result
from stepload_verify.campaign.scenario import (
    SIDEWAYS_UNSEEN,
    Scenario,
    draw,
    expected_times,
    hazard_of,
    scenario_of,
    stance_of,
)
from stepload_verify.campaign.single import run_scenario
from stepload_verify.campaign.truth import SIX_MISTAKES, Anomaly

TEMPLATE = load_plan(Path(__file__).parents[3] / "procedures" / "campaign.yaml")


@cache
def sound(index: int = 0) -> Scenario:
    return draw(TEMPLATE, 5, "six", index, ())


def test_sound_stances_are_those_of_the_study_and_within_the_plan() -> None:
    chance = Random(1)
    arms = [draw_stance(chance, True) for _ in range(300)]
    axes = [draw_stance(chance, False) for _ in range(300)]
    for stance in (*arms, *axes):
        assert stance.share < LARGEST_SHARE
        assert 0.05 <= stance.friction <= 0.6
        assert stance.tilt_rad <= math.radians(3.0)
        assert stance.turn_rad <= math.radians(2.0)
        assert stance.off_m <= 3e-3
    assert max(stance.stuck_ratio for stance in arms) > 2.5
    assert max(stance.stuck_ratio for stance in axes) < 1.03
    assert max(stance.friction for stance in arms) > 0.5
    assert max(stance.share for stance in arms) > 0.25
    assert all(stance.dry_ratio <= stance.stuck_ratio for stance in arms)
    assert 0.4 < sum(stance.stated_ratio is not None for stance in arms) / len(arms) < 0.8


@pytest.mark.parametrize("index", range(6))
def test_the_plan_bounds_what_a_sound_rig_is(index: int) -> None:
    scenario = sound(index)
    plan, truth = scenario.plan, scenario.truth
    assert truth.mount is not None
    matrix = np.array(truth.mount.compliance_m_per_n)
    assert np.linalg.eigvalsh(matrix)[0] > 0.0
    free, stuck = 1.0 / matrix[2, 2], np.linalg.inv(matrix)[2, 2]
    assert free == pytest.approx(truth.system_stiffness_n_per_m)
    ratio, _ = stuck_ratio(plan.rig)
    is_arm = plan.rig.name == "UR"
    assert plan.rig.arm.structure is (Structure.ARM if is_arm else Structure.MACHINE)
    assert stuck / free <= ratio * (1.0 if is_arm else 1.03)
    assert truth.payload.poisson_ratio == plan.payload.material.poisson_ratio
    assert plan.rig.force.lever_m == truth.mount.sensor.lever_m[2]


@pytest.mark.parametrize("kind", SIX_MISTAKES)
def test_what_is_wrong_on_purpose_is_beyond_the_plan(kind: str) -> None:
    base = sound(2)
    scenario = scenario_of(
        "six", 2, base.preflight, stance_of(5, 2), (kind,), (Random(3),), Random(4)
    )
    mount = scenario.truth.mount
    assert mount is not None
    matrix = np.array(mount.compliance_m_per_n)
    ratio = np.linalg.inv(matrix)[2, 2] * matrix[2, 2]
    held = np.linalg.solve(matrix[:2, :2], matrix[:2, 2])
    if kind == "stuck_stiffer":
        assert ratio > 1.05 * stuck_ratio(scenario.plan.rig)[0]
    elif kind == "dragged_aside":
        assert 0.3 < np.linalg.norm(held) <= 0.601
        assert mount.friction_static > 0.3
    elif kind == "plate_tilted":
        assert math.hypot(*mount.plate_tilt_rad) > math.radians(3.9)
    elif kind == "off_centre":
        assert math.hypot(*mount.sensor.lever_m[:2]) > 10e-3
    else:
        assert abs(mount.sensor.lever_m[2] - scenario.plan.rig.force.lever_m) > 1e-3


def test_the_claim_is_about_what_is_left_of_the_limit() -> None:
    """A sound rig completes; the peak that counts is above the largest force."""
    found, _ = run_scenario(sound())
    assert (found.status, found.false_trip) == ("completed", False)
    assert found.resultant_n is not None
    assert found.resultant_n < found.peak_n < found.elastic_limit_n
    assert Result.from_line(found.to_line()) == found
    assert '"resultant_n"' not in replace(found, resultant_n=None).to_line()


def test_a_rig_that_is_dragged_beyond_the_plan_is_stopped_by_r12() -> None:
    scenario = sound(2)
    stance = replace(draw_stance(Random(4), True), dry_ratio=1.0, tilt_rad=0.0)
    anomalies = (Anomaly("dragged_aside", 0.6),)
    truth = mounted(scenario.truth, scenario.preflight, stance, anomalies)
    found, _ = run_scenario(
        replace(scenario, truth=truth, wrong=("dragged_aside",), anomalies=anomalies)
    )
    assert found.rule == "R12"


def test_a_channel_dead_across_the_axis_is_a_hazard_only_where_the_payload_is_dragged() -> None:
    dead, late = (WorldFault("force_lateral_dead", at_s, math.inf, 0.0) for at_s in (0.0, 3.0))
    dragged, plan = Anomaly("stuck_stiffer", 1.5), sound().plan
    assert hazard_of((), [dead], plan, ()) == ""
    assert hazard_of((), [], plan, [dragged]) == ""
    assert hazard_of((), [late], plan, [dragged]) == ""
    assert hazard_of((), [dead], plan, [dragged]) == SIDEWAYS_UNSEEN


def test_a_sensor_that_dies_across_the_axis_while_it_presses_is_found() -> None:
    """Nothing else would be: dragged sideways more and more, and nobody sees it."""
    scenario = sound()
    times = expected_times(scenario.plan, scenario.limits, scenario.truth.surface_m)
    dead = WorldFault("force_lateral_dead", times.touch_s + 0.5, 600.0, 0.0)
    found, _ = run_scenario(replace(scenario, truth=replace(scenario.truth, faults=(dead,))))
    assert (found.rule, found.status) == ("R4", "stopped")
    assert "across the axis" in found.message
    assert found.stop_s - dead.start_s < 0.3
