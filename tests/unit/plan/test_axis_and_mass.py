"""An axis is stated, not assumed."""

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
    assert "a push by hand on the tool shows it" in problem.hint
