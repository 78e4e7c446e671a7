"""A plan that a record has kept is read as it was, also where no new plan may be written so."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest

from stepload.plan.load import load_kept, load_plan
from stepload.plan.problems import PlanError

FULL = """stepload: 1
payload:
  name: ball
  geometry: {shape: sphere, radius: 28.7 mm}
  material: {name: acetal, youngs_modulus: 2.75 GPa, poisson_ratio: 0.3, yield_strength: 70 MPa}
  plate: {name: steel, youngs_modulus: 200 GPa, poisson_ratio: 0.29}
rig: {profile: stvf}
procedure: {top_force: 300 N, step: 50 N, surface_distance: 5 mm}
"""
EMPTY = FULL.replace("rig:", "  force_limit:\nrig:").replace("5 mm}", "5 mm, until: ~}")
DAY = date(2026, 11, 26)


def test_an_empty_key_of_a_kept_plan_counts_as_left_out(tmp_path: Path) -> None:
    path = tmp_path / "old.yaml"
    path.write_text(FULL)
    plan = load_plan(path, today=DAY)
    others = [(source.name, source.text.encode()) for source in plan.sources[1:]]
    whole, empty = (
        load_kept([("old.yaml", text.encode()), *others], "old", DAY) for text in (FULL, EMPTY)
    )
    assert replace(empty, sources=()) == replace(whole, sources=())
    path.write_text(EMPTY)
    with pytest.raises(PlanError) as refused:
        load_plan(path)
    assert [problem.message for problem in refused.value.problems] == [
        "nothing stands behind `force_limit`", "nothing stands behind `until`"
    ]  # fmt: skip
