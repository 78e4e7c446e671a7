"""Forces of the first plans: less than preflight allows, and for the touch the least."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from bench_fakes import Hands, Rig

from stepload.errors import BadInputError
from stepload.setup.answers import Answers
from stepload.setup.first_plan import first_plan, touch_plan
from stepload.setup.questions import preset
from stepload.units import parse_quantity


def answers(**given: str) -> Answers:
    return Answers(given, Hands(Rig()), preset=preset("sphere"))


def procedure_of(text: str) -> dict[str, object]:
    found: dict[str, object] = yaml.safe_load(text)["procedure"]
    return found


def test_the_forces_that_a_person_states_stand(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    both = answers(procedure="top_force=300 N\nstep=30.25 N")
    text, preflight = first_plan(both, "stvf", path)
    assert "top_force: 300 N # stated" in text
    assert "step: 30.25 N # stated" in text
    assert preflight.plan.procedure.levels_n[:2] == (30.25, 60.5)
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
