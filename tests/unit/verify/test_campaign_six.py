"""The campaign on rigs with six axes: what is sound, what is wrong, and what is claimed."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from random import Random

import numpy as np
import pytest

from stepload.envelope.bounds import stuck_ratio
from stepload.envelope.dragged import believed_tilt_rad
from stepload.errors import BadInputError
from stepload.plan.load import load_plan
from stepload.plan.model import Structure
from stepload.rig.world import WorldFault
from stepload_verify.campaign.mishaps import SIX_FAULTS
from stepload_verify.campaign.mounts import (
    LARGEST_SHARE,
    STEEPEST_RAD,
    draw_stance,
    fits,
    mounted,
)
from stepload_verify.campaign.result import Result
from stepload_verify.campaign.scenario import (
    SIDEWAYS_UNSEEN,
    TILTED,
    Scenario,
    _tilted,
    draw,
    expected_times,
    hazard_of,
    kinds_from,
)
from stepload_verify.campaign.single import run_scenario
from stepload_verify.campaign.truth import SIX_ANOMALIES, Anomaly
from stepload_verify.trials.tilted import tilted
from stepload_verify.trials.unloading import cling

TEMPLATE = load_plan(Path(__file__).parents[3] / "procedures" / "campaign.yaml")
ALL = kinds_from("all", "six")


@cache
def sound(index: int = 0) -> Scenario:
    return draw(TEMPLATE, 5, "two", index, (), "six")


def test_a_rig_with_six_axes_is_drawn_from_the_same_numbers_again() -> None:
    assert draw(TEMPLATE, 3, "two", 8, ALL, "six") == draw(TEMPLATE, 3, "two", 8, ALL, "six")
    assert draw(TEMPLATE, 3, "two", 8, ALL).truth.mount is None


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


@pytest.mark.long
@pytest.mark.parametrize("kind", SIX_ANOMALIES)
def test_what_is_wrong_on_purpose_is_beyond_the_plan(kind: str) -> None:
    seen = 0
    for index in range(0, 400, 2):
        scenario = draw(TEMPLATE, 9, "two", index, ("plants",), "six")
        values = {anomaly.kind: anomaly.value for anomaly in scenario.anomalies}
        mount = scenario.truth.mount
        assert mount is not None
        if kind not in values or len(values) > 1:
            continue
        seen += 1
        matrix = np.array(mount.compliance_m_per_n)
        ratio = np.linalg.inv(matrix)[2, 2] * matrix[2, 2]
        held = np.linalg.solve(matrix[:2, :2], matrix[:2, 2])
        if kind == "stuck stiffer than stated":
            assert ratio > 1.05 * stuck_ratio(scenario.plan.rig)[0]
        elif kind == "dragged sideways":
            assert 0.3 < np.linalg.norm(held) <= 0.601
            assert mount.friction_static > 0.3
        elif kind == "plate tilted":
            assert math.hypot(*mount.plate_tilt_rad) > math.radians(3.9)
        else:
            assert math.hypot(*mount.sensor.lever_m[:2]) > 10e-3
        if seen == 3:
            break
    assert seen


def test_a_plan_whose_top_r12_would_not_let_pass_is_not_drawn() -> None:
    stance = replace(draw_stance(Random(2), True), friction=0.25, coupling=1.0, lateral=1.2)
    scenario = sound()
    tight = replace(scenario.limits, allowed_n=1.05 * scenario.plan.procedure.top_force_n)
    loose = replace(scenario.limits, allowed_n=9.0 * scenario.plan.procedure.top_force_n + 99.0)
    assert not fits(replace(scenario.envelope, limits=tight), stance)
    assert fits(replace(scenario.envelope, limits=loose), stance)


def test_the_claim_is_about_what_is_left_of_the_limit() -> None:
    """A sound rig completes; the peak that counts is above the largest force."""
    found, _ = run_scenario(sound())
    assert (found.status, found.false_trip) == ("completed", False)
    assert found.resultant_n is not None
    assert found.resultant_n < found.peak_n < found.elastic_limit_n
    assert Result.from_line(found.to_line()) == found
    assert '"resultant_n"' not in replace(found, resultant_n=None).to_line()


def test_a_rig_that_is_dragged_beyond_the_plan_is_stopped_by_r12() -> None:
    scenario = sound()
    stance = replace(draw_stance(Random(4), True), dry_ratio=1.0, tilt_rad=0.0)
    anomalies = (Anomaly("dragged sideways", 0.6),)
    truth = mounted(scenario.truth, scenario.envelope, stance, anomalies)
    found, _ = run_scenario(replace(scenario, truth=truth, healthy=False, anomalies=anomalies))
    assert found.rule == "R12"


def test_a_channel_dead_across_the_axis_is_a_hazard_only_where_the_payload_is_dragged() -> None:
    dead, late = (WorldFault("force_lateral_dead", at_s, math.inf, 0.0) for at_s in (0.0, 3.0))
    dragged = Anomaly(SIX_ANOMALIES[0], 0.5)
    assert hazard_of([dead], sound().plan) == ""
    assert hazard_of([], sound().plan, [dragged]) == ""
    assert hazard_of([late], sound().plan, [dragged]) == ""
    assert hazard_of([dead], sound().plan, [dragged]) == SIDEWAYS_UNSEEN


def test_a_sensor_that_dies_across_the_axis_while_it_presses_is_found() -> None:
    """Nothing else would be: dragged sideways more and more, and nobody sees it."""
    scenario = sound()
    times = expected_times(scenario.plan, scenario.limits, scenario.truth.surface_m)
    dead = WorldFault("force_lateral_dead", times.touch_s + 0.5, 600.0, 0.0)
    found, _ = run_scenario(replace(scenario, truth=replace(scenario.truth, faults=(dead,))))
    assert (found.rule, found.status) == ("R4", "stopped")
    assert "across the axis" in found.message
    assert found.stop_s - dead.start_s < 0.3


@pytest.mark.long
def test_nobody_sees_what_a_dead_channel_does_not_tell() -> None:
    kinds = ("force_lateral_dead", "plants")
    hazards, said = set(), set()
    for index in range(100):
        scenario = draw(TEMPLATE, 1, "two", index, kinds, "six")
        names = {anomaly.kind for anomaly in scenario.anomalies}
        always = any(fault.start_s == 0.0 for fault in scenario.faults)
        unseen = always and bool(names & {*SIX_ANOMALIES[:2]})
        tilts = [one.value for one in scenario.anomalies if one.kind == "plate tilted"]
        beyond = max(tilts, default=0.0) > believed_tilt_rad(scenario.plan)
        assert scenario.hazard == (SIDEWAYS_UNSEEN if unseen else TILTED if beyond else "")
        hazards.add(scenario.hazard)
        said.add((bool(tilts), scenario.plan.rig.plate_tilt_rad))
    assert hazards == {TILTED, SIDEWAYS_UNSEEN, ""}
    assert said == {(True, None), (True, STEEPEST_RAD), (False, None), (False, STEEPEST_RAD)}


def test_a_plate_as_steep_as_the_plan_says_is_no_hazard() -> None:
    stated_rad = believed_tilt_rad(TEMPLATE)
    for share, hazard in ((0.9, ""), (1.1, TILTED)):
        assert _tilted(TEMPLATE, (Anomaly("plate tilted", share * stated_rad),)) == hazard


def test_what_only_six_axes_have_is_refused_of_one() -> None:
    assert set(SIX_FAULTS) < set(ALL)
    assert not set(SIX_FAULTS) & set(kinds_from("all"))
    with pytest.raises(BadInputError, match="plate_slips"):
        kinds_from("plate_slips")


@pytest.mark.parametrize("index", [6, 12])
def test_friction_that_clings_goes_down_with_the_force_on_the_way_back(index: int) -> None:
    """It did not where a payload loses work in a cycle: the tip swung, up to 2.4 F_c."""
    clung = cling(TEMPLATE, index, 0.6, 0.0, stated=False)
    assert clung.whole < 1.01 * clung.pressed


@pytest.mark.long
def test_a_friction_that_the_plan_states_is_kept_on_a_steep_plate_too() -> None:
    """Where nobody states it, a sound run goes beyond F_c even while it presses."""
    unknown, stated = (cling(TEMPLATE, 12, 0.6, 28.0, stated=known) for known in (False, True))
    assert unknown.pressed > 1.5
    assert stated.top < 0.5 * unknown.top
    assert stated.whole < 0.9


@pytest.mark.long
def test_rigs_that_are_tilted_as_far_as_their_plan_says_stay_below_the_limit() -> None:
    found = [tilted(TEMPLATE, index) for index in range(24)]
    assert max(row.peak_ratio for row in found if not row.hazard) < 1.0
    wrong = {kind for row in found for kind in row.wrong}
    assert {"plate tilted", "stuck stiffer than stated", "dragged sideways"} <= wrong
    assert {row.rule for row in found} >= {"", "R12"}
