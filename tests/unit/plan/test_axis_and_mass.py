"""An axis is stated, not assumed; the mass of the tool stands where it belongs."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import pytest

from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.plan.problems import PlanError

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


def test_the_axis_has_no_default(tmp_path: Path) -> None:
    own = tmp_path / "rig.yaml"
    own.write_text(STVF.read_text().replace('  axis: "+fz"\n', ""))
    with pytest.raises(PlanError) as caught:
        plan_with(tmp_path, "rig.yaml")
    (problem,) = caught.value.problems
    assert problem.message == "missing key 'axis'"
    assert "A push by hand on the tool" in problem.hint


def test_the_mass_on_the_second_channel_stands_beside_its_sensor(tmp_path: Path) -> None:
    sensor = "driver: sim, axis: +fz, rate: 1 kHz, range: 1 kN, resolution: 1 N, noise: 1 N"
    sensor = f"{{{sensor}, delay: 1 ms, tool_mass: 1 kg}}"
    with pytest.raises(PlanError) as caught:
        plan_with(
            tmp_path, f"{{profile: stvf, second_force: {{source: sensor, sensor: {sensor}}}}}"
        )
    (problem,) = caught.value.problems
    assert "rig.second_force.tool_mass" in problem.hint


def test_a_touch_is_more_than_it_takes_to_accelerate_the_tool(tmp_path: Path) -> None:
    light = plan_with(tmp_path, "{profile: stvf, force: {tool_mass: 1 g}}")
    heavy = plan_with(tmp_path, "{profile: stvf, force: {tool_mass: 8 kg}}")
    assert light.procedure.touch_force_n == plan_with(tmp_path, "stvf").procedure.touch_force_n
    assert heavy.procedure.touch_force_n == 1.5 * 8.0 * heavy.rig.arm.max_acceleration_m_s2
