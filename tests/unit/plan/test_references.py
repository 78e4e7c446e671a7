"""What a plan names by path or profile, and what is laid over what."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from stepload.plan.compose import overlay
from stepload.plan.load import load_plan
from stepload.plan.problems import PlanError
from stepload.plan.source import Source
from stepload.plan.tree import Mapping, Node, Scalar, parse_tree

WritePlan = Callable[..., Path]


@pytest.mark.parametrize(
    ("rig", "line", "column", "message", "hint"),
    [
        ("stfv", 3, 6, "'stfv' is no rig profile", "did you mean 'stvf'? profiles: one-axis,"),
        ("{profile: ~}", 3, 16, "'this' is no rig profile", "profiles: one-axis"),
        ("{profile: 3}", 3, 16, "'3' is no rig profile", "`rig: FILE.yaml`"),
        ("{profile: [stvf]}", 3, 16, "'this' is no rig profile", "`rig: FILE.yaml`"),
        ("rigs/x.yaml", 3, 6, "rigs/x.yaml: no such file", "directory of the file they stand in"),
        ("x.YML", 3, 6, "x.YML: no such file", "directory of the file they stand in"),
        ("x.json", 3, 6, "x.json: no such file", "directory of the file they stand in"),
        ('"a/\\0"', 3, 6, "control character U+0000", "a text of one line"),
        ("3", 3, 6, "'3' where a mapping belongs", "keys: profile, name"),
    ],
)
def test_a_rig_that_is_not_there(
    write_plan: WritePlan, rig: str, line: int, column: int, message: str, hint: str
) -> None:
    with pytest.raises(PlanError) as caught:
        load_plan(write_plan(("rig: stvf", f"rig: {rig}")))
    problem = next(p for p in caught.value.problems if message in p.message)
    assert (problem.line, problem.column) == (line, column)
    assert hint in problem.hint


def test_paths_start_at_the_file_they_stand_in(write_plan: WritePlan, tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "steps.yaml").write_text("step: 9 N\n")
    inline = "{step: 50 N, top_force: 300 N, surface_distance: 5 mm}"
    with pytest.raises(PlanError) as caught:
        load_plan(write_plan((inline, "deep/steps.yaml")))
    problems = caught.value.problems
    assert [p.message for p in problems] == [
        "missing key 'top_force'", "missing key 'surface_distance'",
    ]  # fmt: skip
    # A missing key of the file is reported at the key that named the file.
    assert {(Path(p.file).name, p.line) for p in problems} == {("plan.yaml", 4)}


def _mapping(text: str) -> Mapping:
    node, problems = parse_tree(Source("x.yaml", None, text, text.encode()))
    assert not problems
    assert isinstance(node, Mapping)
    return node


def _plain(node: Node) -> object:
    if isinstance(node, Mapping):
        return {key: _plain(value) for key, value in node.entries.items()}
    assert isinstance(node, Scalar)
    return node.value


@pytest.mark.parametrize(
    ("base", "over", "merged"),
    [
        ("a: 1\nb: {c: 1, d: 2}", "b: {d: 3, e: 4}", {"a": 1, "b": {"c": 1, "d": 3, "e": 4}}),
        ("a: {b: 1}", "a: 2", {"a": 2}),
        ("a: 1", "a: {b: 2}", {"a": {"b": 2}}),
        ("driver: x\noptions: {a: 1}\nrate: 1", "driver: y", {"driver": "y"}),
        ("driver: x\nrate: 1", "profile: y", {"profile": "y"}),
        ("driver: x\nrate: 1", "driver: sim", {"driver": "sim", "rate": 1}),
        ("driver: x\noptions: {a: 1}", "driver: x", {"driver": "x", "options": {"a": 1}}),
        ("driver: x\noptions: {a: 1}", "options: {b: 2}",
         {"driver": "x", "options": {"a": 1, "b": 2}}),
        ("system_stiffness: {value: 1, msde: 2}", "system_stiffness: {value: 3}",
         {"system_stiffness": {"value": 3}}),
        ("system_stiffness: {value: 1, msde: 2}", "system_stiffness: {record: x}",
         {"system_stiffness": {"value": 1, "msde": 2, "record": "x"}}),
        ("force: {value: 1, msde: 2}", "force: {value: 3}", {"force": {"value": 3, "msde": 2}}),
    ],
)  # fmt: skip
def test_what_is_laid_over_a_profile(base: str, over: str, merged: object) -> None:
    found = overlay(_mapping(base), _mapping(over))
    assert _plain(found) == merged
    assert list(found.keys) == list(found.entries)
