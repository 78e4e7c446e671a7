"""A push by hand that proved a force channel counts for a while; an axis is stated, not assumed."""

from __future__ import annotations

from datetime import date, timedelta
from pathlib import Path

import pytest

from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.plan.problems import PlanError
from stepload.plan.pushes import PUSH_DAYS, push_problem

TODAY = date(2026, 11, 22)
PROCEDURES = Path(__file__).parents[3] / "procedures"
STVF = Path(__file__).parents[3] / "src" / "stepload" / "plan" / "profiles" / "stvf.yaml"


def plan_with(tmp_path: Path, rig: str) -> Plan:
    text = (PROCEDURES / "plastic-sphere.yaml").read_text()
    assert "rig: stvf" in text
    text = text.replace("payload: payloads/", f"payload: {PROCEDURES}/payloads/")
    path = tmp_path / "plan.yaml"
    path.write_text(text.replace("rig: stvf", f"rig: {rig}"))
    return load_plan(path, today=TODAY)


@pytest.mark.parametrize(
    ("days", "said"),
    [(0, ""), (PUSH_DAYS, ""), (PUSH_DAYS + 1, "31 days old"), (-1, "in the future")],
)
def test_a_push_counts_for_thirty_days(days: int, said: str, tmp_path: Path) -> None:
    pushed_on = TODAY - timedelta(days=days)
    problem = push_problem(pushed_on, TODAY)
    assert (said in problem) if said else problem == ""
    each = f"{{pushed_on: {pushed_on}}}"
    rig = plan_with(tmp_path, f"{{profile: stvf, force: {each}, second_force: {each}}}").rig
    assert rig.force.pushed_on == rig.second_force.pushed_on == pushed_on
    assert rig.force.push_problem == rig.second_force.push_problem == problem


def test_without_a_push_there_is_none_to_be_too_old(tmp_path: Path) -> None:
    rig = plan_with(tmp_path, "stvf").rig
    assert rig.force.pushed_on is rig.second_force.pushed_on is None
    assert rig.force.push_problem == rig.second_force.push_problem == ""


def test_the_axis_has_no_default(tmp_path: Path) -> None:
    own = tmp_path / "rig.yaml"
    own.write_text(STVF.read_text().replace('  axis: "+fz"\n', ""))
    with pytest.raises(PlanError) as caught:
        plan_with(tmp_path, "rig.yaml")
    (problem,) = caught.value.problems
    assert problem.message == "missing key 'axis'"
    assert "A push by hand on the tool" in problem.hint


@pytest.mark.parametrize("key", ["tool_mass: 1 kg", "pushed_on: 2026-11-20"])
def test_what_proves_the_second_channel_stands_beside_its_sensor(key: str, tmp_path: Path) -> None:
    sensor = "driver: sim, axis: +fz, rate: 1 kHz, range: 1 kN, resolution: 1 N, noise: 1 N"
    sensor = f"{{{sensor}, delay: 1 ms, {key}}}"
    with pytest.raises(PlanError) as caught:
        plan_with(
            tmp_path, f"{{profile: stvf, second_force: {{source: sensor, sensor: {sensor}}}}}"
        )
    (problem,) = caught.value.problems
    assert f"rig.second_force.{key.partition(':')[0]}" in problem.hint


def test_a_touch_is_more_than_it_takes_to_accelerate_the_tool(tmp_path: Path) -> None:
    light = plan_with(tmp_path, "{profile: stvf, force: {tool_mass: 1 g}}")
    heavy = plan_with(tmp_path, "{profile: stvf, force: {tool_mass: 8 kg}}")
    assert light.procedure.touch_force_n == plan_with(tmp_path, "stvf").procedure.touch_force_n
    assert heavy.procedure.touch_force_n == 1.5 * 8.0 * heavy.rig.arm.max_acceleration_m_s2
