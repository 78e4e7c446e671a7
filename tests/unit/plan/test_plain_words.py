"""Mistakes of indentation, quotes and braces, and files that are no plan, told in plain words."""

from __future__ import annotations

from pathlib import Path

import pytest

from stepload.plan.load import load_payload, load_plan
from stepload.plan.problems import PlanError

PROCEDURES = Path(__file__).parents[3] / "procedures"
JARGON = ("block", "flow", "scalar", "token", "mapping values", "simple key", "stream")
HEAD = "stepload: 1\npayload: p.yaml\nrig: stvf\n"
MISTAKES = [
    (HEAD + "procedure:\n  step: 50 N\n   top_force: 300 N\n", 6, "stands where none may stand"),
    (HEAD + "procedure:\n   step: 50 N\n  top_force: 300 N\n", 6, "indented otherwise"),
    ("stepload: 1\npayload p.yaml\nrig: stvf\n", 2, "a key without its colon"),
    ("stepload:1\npayload: p.yaml\n", 2, "stands where none may stand"),
    ("stepload: 1\npayload: {radius: 3 mm\nrig: stvf\n", 3, "the { of its mapping"),
    ("stepload: 1\nprocedure: {levels: [1 N, 2 N}\n", 2, "the [ of its list"),
    ('stepload: 1\npayload: "p.yaml\nrig: stvf\n', 2, "a quote that is never closed"),
    ("stepload: 1\npayload: @p\n", 2, "no value begins with this letter"),
    ('{"stepload": 1 "payload": "x"}', 1, "a comma is missing"),
    ("stepload: 1\nprocedure:\n\tstep: 50 N\n", 3, "a tab"),
]


@pytest.mark.parametrize(("text", "line", "told"), MISTAKES)
def test_a_mistake_is_told_in_plain_words(tmp_path: Path, text: str, line: int, told: str) -> None:
    path = tmp_path / "plan.yaml"
    path.write_text(text)
    with pytest.raises(PlanError) as caught:
        load_plan(path)
    problem = caught.value.problems[0]
    assert problem.line == line
    assert told in problem.message
    assert problem.hint
    for word in JARGON:
        assert word not in problem.message + problem.hint


@pytest.mark.parametrize("rig", ["ur5e", "{profile: ur5e, arm: {options: {}}}"])
def test_an_address_is_asked_for_where_devices_are_opened_and_in_the_users_file(
    tmp_path: Path, rig: str
) -> None:
    path = tmp_path / "plan.yaml"
    text = (PROCEDURES / "ur5e-silicone-sphere.yaml").read_text()
    (tmp_path / "payloads").symlink_to(PROCEDURES / "payloads")
    path.write_text(f"{text[: text.index('rig:')]}rig: {rig}\n{text[text.index('procedure:') :]}")
    plan = load_plan(path)
    line = path.read_text().splitlines().index(f"rig: {rig}") + 1
    with pytest.raises(PlanError) as caught:
        plan.refuse_missing()
    assert [(each.file, each.line) for each in caught.value.problems] == [(str(path), line)] * 2
    named = [each.hint.partition(": ")[0] for each in caught.value.problems]
    assert named == ["rig.arm.options.host", "rig.force.options.port"]


@pytest.mark.parametrize("beside_a_plan", [False, True])
def test_a_plan_in_the_place_of_a_payload_file_is_one_problem(beside_a_plan: bool) -> None:
    plan = PROCEDURES / "plastic-sphere.yaml"
    with pytest.raises(PlanError) as caught:
        load_plan(plan, payload=plan) if beside_a_plan else load_payload(plan)
    [problem] = caught.value.problems
    assert (problem.line, problem.column) == (1, 1)
