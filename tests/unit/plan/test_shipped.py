"""Plans that come with stepload: listed, and copied with what they name."""

from __future__ import annotations

from pathlib import Path

import pytest

from stepload.errors import BadInputError
from stepload.plan.load import load_plan
from stepload.plan.shipped import copy_plan, shipped_plans

ROOT = Path(__file__).parents[3]


def test_every_plan_of_the_checkout_is_listed_with_a_word_about_it() -> None:
    found = shipped_plans()
    assert {plan.path for plan in found} == set((ROOT / "procedures").glob("*.yaml"))
    assert all(plan.about for plan in found)


@pytest.mark.parametrize("name", [plan.name for plan in shipped_plans()])
def test_a_copy_stands_alone(name: str, tmp_path: Path) -> None:
    written = copy_plan(name, tmp_path / "mine")
    assert written[0] == tmp_path / "mine" / f"{name}.yaml"
    plan = load_plan(written[0])
    original = load_plan(ROOT / "procedures" / f"{name}.yaml")
    assert [source.text for source in plan.sources] == [source.text for source in original.sources]
    assert copy_plan(name, tmp_path / "mine") == written  # the same again changes nothing


def test_another_file_is_not_overwritten(tmp_path: Path) -> None:
    mine = tmp_path / "plastic-sphere.yaml"
    mine.write_text("mine")
    with pytest.raises(BadInputError, match="is there already"):
        copy_plan("plastic-sphere", tmp_path)
    assert mine.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [mine]
