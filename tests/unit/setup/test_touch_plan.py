"""Forces of the first plans: less than preflight allows, and for the touch the least."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml
from bench_fakes import Hands, Rig

from stepload.errors import RefusedError
from stepload.setup.answers import Answers
from stepload.setup.first_plan import first_plan, touch_plan
from stepload.setup.presets import preset
from stepload.units import parse_quantity


def answers(**given: str) -> Answers:
    return Answers(given, Hands(Rig()), preset=preset("sphere"))


def test_most_is_nine_tenths_of_what_preflight_allows(tmp_path: Path) -> None:
    text, _ = first_plan(answers(), "stvf", tmp_path / "plan.yaml")
    found = re.search(r"top_force: (.*) # nine tenths of the largest safe force, (.*)", text)
    assert found is not None
    top_n, largest_n = (parse_quantity(shown, "N") for shown in found.groups())
    assert top_n == pytest.approx(0.9 * largest_n, rel=0.05)


def test_a_touch_is_one_light_cycle_whatever_the_plan_says(tmp_path: Path) -> None:
    text, top_n = touch_plan(answers(procedure="cycles=5"), "stvf", tmp_path / "plan.yaml")
    procedure = yaml.safe_load(text)["procedure"]
    assert procedure["cycles"] == 1
    assert parse_quantity(procedure["top_force"], "N") == top_n
    assert top_n <= 20.0


def test_a_touch_that_preflight_refuses_is_no_plan(tmp_path: Path) -> None:
    with pytest.raises(RefusedError, match="preflight refuses the plan"):
        touch_plan(answers(force_limit="1.5 N"), "stvf", tmp_path / "plan.yaml")
