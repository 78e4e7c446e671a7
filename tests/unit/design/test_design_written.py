"""The file of a design is the plan that was chosen, and nothing stays that preflight refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from stepload.design import plan_design as room
from stepload.design.plan_design import Design, grid
from stepload.design.plan_report import text_of, write
from stepload.design.top_force import ceiling
from stepload.errors import BadInputError, RefusedError
from stepload.plan.load import load_plan
from stepload.plan.room_to_write import check_new
from stepload.plan.shipped import payload_folder

SPHERE = payload_folder() / "plastic-sphere.yaml"


@pytest.fixture(scope="module")
def found() -> Design:
    """A design whose plan has ramps of 2 s and holds of 8 s."""
    limit = ceiling("stvf", SPHERE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(room, "STEPS", (12,))
        patch.setattr(room, "HOLDS_S", (8.0,))
        plans = grid("stvf", SPHERE, limit, "5 mm")
    plan = plans.candidates[-1]
    return Design(limit, 500.0, plans, [plan], plan)


def text(found: Design, path: Path) -> str:
    return text_of(found, path, SPHERE, "stvf", "5 mm", "stepload design")


def test_the_written_plan_is_the_chosen_one(found: Design, tmp_path: Path) -> None:
    path = tmp_path / "new.yaml"
    write(path, text(found, path))
    plan, chosen = load_plan(path).procedure, found.chosen
    assert (chosen.order.ramp_s, chosen.order.hold_s) == (2.0, 8.0)
    assert plan.top_force_n == pytest.approx(chosen.top_n)
    assert len(plan.levels_n) == chosen.order.steps
    assert plan.step_n / plan.load_rate_n_per_s == pytest.approx(2.0)
    assert plan.hold_s == 8.0


def test_what_is_there_is_kept_and_what_preflight_refuses_is_not(
    found: Design, tmp_path: Path
) -> None:
    path, mine = tmp_path / "new.yaml", tmp_path / "mine.yaml"
    mine.write_text("mine")
    with pytest.raises(BadInputError, match="is there already"):
        check_new("--out", mine)
    (tmp_path / "link.yaml").symlink_to(tmp_path / "nowhere")
    with pytest.raises(BadInputError, match="is there already"):
        check_new("--out", tmp_path / "link.yaml")
    bold = text(found, path).replace("top_force: 300 N", "top_force: 900 N")
    with pytest.raises(RefusedError, match="preflight refused"):
        write(path, bold)
    assert not path.exists()
