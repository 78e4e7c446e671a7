"""Forces of the first plans: less than preflight allows, and for the touch the least."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from bench_fakes import Hands, Rig

from stepload.envelope.reason import PlanVerdict
from stepload.errors import BadInputError, RefusedError
from stepload.plan.problems import PlanError
from stepload.setup.answers import Answers
from stepload.setup.first_plan import first_plan, touch_plan
from stepload.setup.questions import preset
from stepload.units import parse_quantity


def answers(**given: str) -> Answers:
    return Answers(given, Hands(Rig()), preset=preset("sphere"))


def test_most_is_what_needs_no_warning(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    text, envelope = first_plan(answers(), "one-axis", path)
    assert "top_force: 400 N # 0.9 of the largest safe force, 449 N" in text
    assert envelope.verdict is PlanVerdict.GO
    text, envelope = first_plan(answers(), "stvf", path)
    table_n = envelope.plan.rig.system_stiffness.deflection_force_n
    assert envelope.plan.procedure.top_force_n == max(table_n)
    assert envelope.verdict is PlanVerdict.GO


def procedure_of(text: str) -> dict[str, object]:
    found: dict[str, object] = yaml.safe_load(text)["procedure"]
    return found


def test_the_forces_that_a_person_states_stand(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    both = answers(procedure="top_force=300 N\nstep=30.25 N")
    text, envelope = first_plan(both, "stvf", path)
    assert "top_force: 300 N # stated" in text
    assert "step: 30.25 N # stated" in text
    assert envelope.plan.procedure.levels_n[:2] == (30.25, 60.5)
    top, _ = first_plan(answers(procedure="top_force=300 N"), "stvf", path)
    assert procedure_of(top)["step"] == "50 N"
    step, _ = first_plan(answers(procedure="step=40 N"), "stvf", path)
    assert procedure_of(step)["top_force"] == "300 N"
    assert procedure_of(step)["step"] == "40 N"
    levels = answers(top_force="300 N", procedure="levels=[100 N, 200 N, 300 N]")
    assert "step" not in procedure_of(first_plan(levels, "stvf", path)[0])
    alone, _ = first_plan(answers(procedure="levels=[100 N, 200 N, 250 N ]"), "stvf", path)
    assert procedure_of(alone)["top_force"] == "250 N"
    assert "top_force: 250 N # the last of the levels" in alone


def test_preflight_judges_the_forces_that_a_person_states(tmp_path: Path) -> None:
    for stated, error, why in (
        ("top_force=900 N", RefusedError, "900 N is 1.24 times"),
        ("step=500 N", PlanError, "top force 300 N is below one step of 500 N"),
        ("top_force=most", BadInputError, "top_force 'most'"),
    ):
        with pytest.raises(error, match=why):
            first_plan(answers(procedure=stated), "stvf", tmp_path / "plan.yaml")


@pytest.mark.parametrize("key", ["top_force", "surface_distance"])
def test_a_thing_is_stated_in_one_answer(tmp_path: Path, key: str) -> None:
    unit = "N" if key == "top_force" else "mm"
    given = {key: f"200 {unit}", "procedure": f"{key}=300 {unit}"}
    with pytest.raises(BadInputError, match=f"{key} is given twice"):
        first_plan(answers(**given), "stvf", tmp_path / "plan.yaml")
    kept = answers(procedure=given["procedure"])
    kept.kept[key] = given[key]
    with pytest.raises(BadInputError, match=f"{key} is given twice"):
        first_plan(kept, "stvf", tmp_path / "plan.yaml")


def test_a_touch_is_the_lightest_whatever_forces_are_stated(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    light, _ = touch_plan(answers(), "stvf", path)
    stated = answers(procedure="top_force=300 N\nlevels=[100 N, 300 N]")
    assert touch_plan(stated, "stvf", path)[0] == light


def test_a_touch_is_one_light_cycle_whatever_the_plan_says(tmp_path: Path) -> None:
    text, top_n = touch_plan(answers(procedure="cycles=5"), "stvf", tmp_path / "plan.yaml")
    procedure = yaml.safe_load(text)["procedure"]
    assert procedure["cycles"] == 1
    assert parse_quantity(procedure["top_force"], "N") == top_n
    assert top_n <= 20.0


def test_a_touch_that_preflight_refuses_is_no_plan(tmp_path: Path) -> None:
    with pytest.raises(RefusedError, match="preflight refuses the plan"):
        touch_plan(answers(force_limit="1.5 N"), "stvf", tmp_path / "plan.yaml")
