"""Broken plans: each is refused at the right line and column, with the right words."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest

from stepload.errors import ExitCode
from stepload.plan.load import load_plan
from stepload.plan.problems import PlanError

GOOD = """\
stepload: 1
payload:
  name: ball
  geometry:
    shape: sphere
    radius: 28.7 mm
  material:
    name: acetal
    youngs_modulus: 2.75 GPa
    poisson_ratio: 0.3
    yield_strength: 70 MPa
  plate:
    name: aluminium
    youngs_modulus: 70 GPa
    poisson_ratio: 0.33
rig: stvf
procedure:
  step: 50 N
  top_force: 300 N
  hold: 3 s
  surface_distance: 5 mm
"""


class Broken(NamedTuple):
    """The good plan with `old` replaced by `new`, and what must be said about it."""

    name: str
    old: str
    new: str
    line: int
    column: int
    message: str
    hint: str = ""


_RIG = "rig: stvf"
_STVF = "rig:\n  profile: stvf\n  "
_END = "  surface_distance: 5 mm\n"

BROKEN = [
    Broken("unknown key", "radius: 28.7", "radus: 28.7", 6, 5, "unknown key 'radus'", "'radius'"),
    Broken("missing key", "    radius: 28.7 mm\n", "", 4, 3, "missing key 'radius'", "Radius"),
    Broken("unknown top key", _RIG, _RIG + "\nprocedur: {}", 17, 1, "'procedur'", "'procedure'"),
    Broken("duplicate key", "hold: 3 s", "hold: 3 s\n  hold: 4 s", 21, 3, "duplicate", "line 20"),
    Broken("no unit", "hold: 3 s", "hold: 3", 20, 9, "3 has no unit", '"3 s"'),
    Broken("no unit, text", "28.7 mm", '"28.7"', 6, 13, "'28.7' has no unit", '"28.7 mm"'),
    Broken("wrong dimension", "hold: 3 s", "hold: 3 N", 20, 9, "is a force, not a time", "a time"),
    Broken("unknown unit", "28.7 mm", "28.7 mn", 6, 13, "unknown unit 'mn'", "28.7 mm"),
    Broken("prefix not in use", "28.7 mm", "28.7 Mm", 6, 13, "unknown unit 'Mm'", "'mm'"),
    Broken("decimal comma", "28.7 mm", "28,7 mm", 6, 13, "not a number", "decimal point"),
    Broken("NaN", "hold: 3 s", "hold: .nan", 20, 9, "nan is not a finite number"),
    Broken("NaN as number", "ratio: 0.33", "ratio: .nan", 15, 20, "nan is not a plain number"),
    Broken("infinite", "hold: 3 s", "hold: 1e999 s", 20, 9, "not a finite number"),
    Broken("huge", "300 N", "1e30 N", 19, 14, "out of range", "up to 1 MN"),
    Broken("negative radius", "28.7 mm", "-28.7 mm", 6, 13, "out of range", "above 0 m"),
    Broken("zero radius", "28.7 mm", "0 mm", 6, 13, "out of range", "above 0 m"),
    Broken("nothing given", "28.7 mm", "", 6, 12, "nothing is not a length", "a length"),
    Broken("Poisson ratio", "ratio: 0.33", "ratio: 0.51", 15, 20, "out of range", "to 0.5"),
    Broken(
        "no yes in 1.2", _END, _END + "  unload: no\n", 22, 11, "'no' is neither true", "true or"
    ),
    Broken("sexagesimal", "hold: 3 s", "hold: 1:30", 20, 9, "not a number", "a time"),
    Broken("level without unit", "step: 50 N", "levels: [100, 300 N]", 18, 12, "100 has no unit"),
    Broken("levels no list", "step: 50 N", "levels: 300 N", 18, 11, "where a list belongs"),
    Broken("a list", "28.7 mm", "[28.7 mm]", 6, 13, "a list where one value belongs"),
    Broken("unload fraction", _END, _END + "  unload_fraction: 90 %\n", 22, 20, "out of range"),
    Broken("share plain", _END, _END + "  unload_fraction: 0.1\n", 22, 20, "no unit", '"2 %"'),
    Broken("no touches", _END, _END + "  touches: 0\n", 22, 12, "out of range", "whole number"),
    Broken("half a cycle", _END, _END + "  cycles: 1.5\n", 22, 11, "not a whole number"),
    Broken("zero rate", _RIG, _STVF + "arm: {rate: 0 Hz}", 18, 15, "out of range", "1 Hz"),
    Broken("axis", _RIG, _STVF + "force: {axis: z}", 18, 17, "'z' is not a choice", "+fz"),
    Broken("driver", _RIG, _STVF + "arm: {driver: nosuch}", 18, 17, "no driver named", "sim"),
    Broken(
        "option", _RIG, _STVF + "arm: {options: {sede: 1}}", 18, 19, "unknown key 'sede'", "seed"
    ),
    Broken("option unit", _RIG, _STVF + "arm: {options: {rate: 500}}", 18, 25, "no unit", "a rate"),
    Broken("option kind", _RIG, _STVF + "arm: {options: {seed: a}}", 18, 25, "not a whole number"),
    Broken("profile", _RIG, "rig: stfv", 16, 6, "'stfv' is no rig profile", "'stvf'"),
    Broken("profile key", _RIG, "rig:\n  profile: x", 17, 12, "'x' is no rig profile", "ur5e"),
    Broken(
        "no such day",
        _RIG,
        _STVF + "system_stiffness: {measured_on: 2025-02-30}",
        18,
        35,
        "not a date",
        "2025-03-31",
    ),
    Broken("shape", "shape: sphere", "shape: sphre", 5, 12, "'sphre' is not a shape", "'sphere'"),
    Broken("format", "stepload: 1", "stepload: 2", 1, 11, "2 is not accepted", "1"),
    Broken(
        "control", _END, _END + 'record: {directory: "a\\eb"}\n', 22, 21, "control character U+001B"
    ),
    Broken("number as name", "name: ball", "name: 7", 3, 9, "7 is not a text", '"7"'),
    Broken("no such file", "rig: stvf", "rig: rigs/x.yaml", 16, 6, "no such file", "directory"),
    Broken("NUL in path", "rig: stvf", 'rig: "a/\\0"', 16, 6, "control character U+0000"),
    Broken("directory as file", "rig: stvf", "rig: ./", 16, 6, "not a regular file"),
    Broken("device as file", "rig: stvf", "rig: /dev/zero", 16, 6, "not a regular file"),
    Broken("mapping wanted", "procedure:\n", "procedure: [1]\nx:\n", 17, 12, "a list where a"),
    Broken("alias", "28.7 mm", "*r", 6, 13, "alias *r", "write the value"),
    Broken("anchor", "28.7 mm", "&r 28.7 mm", 6, 13, "anchor &r", "write the value"),
    Broken("merge key", "name: ball", "<<: {name: ball}", 3, 3, "merge key <<"),
    Broken("tag", "name: ball", "name: !!python/object:os.system x", 3, 9, "tag ", "plain data"),
    Broken("second document", _END, _END + "---\na: 1\n", 22, 1, "a second document"),
    Broken("directive", "stepload: 1", "%YAML 1.1\n---\nstepload: 1", 2, 1, "a YAML directive"),
    Broken("tab", "  name: ball", "\tname: ball", 3, 1, "a tab", "spaces"),
    Broken("unclosed", "28.7 mm", "'28.7 mm", 6, 13, "a quote that is never closed"),
    Broken("deep", "28.7 mm", "[" * 40, 6, 26, "nested deeper than 16"),
    Broken("odd key", "name: ball", "[a]: ball", 3, 3, "not a word"),
    Broken("forbidden character", "name: ball", "name: b\x07ll", 3, 10, "U+0007"),
]


@pytest.mark.parametrize("case", BROKEN, ids=lambda case: case.name)
def test_a_broken_plan_is_refused_at_its_place(case: Broken, tmp_path: Path) -> None:
    assert GOOD.count(case.old) == 1
    path = tmp_path / "plan.yaml"
    path.write_text(GOOD.replace(case.old, case.new), encoding="utf-8")
    with pytest.raises(PlanError) as caught:
        load_plan(path)
    assert caught.value.exit_code is ExitCode.BAD_INPUT
    reported = [(p.line, p.column, p.message, p.hint) for p in caught.value.problems]
    fitting = [p for p in caught.value.problems if case.message in p.message]
    assert fitting, reported
    assert (fitting[0].line, fitting[0].column) == (case.line, case.column), reported
    assert case.hint in fitting[0].hint, reported
    assert f"{path}:{case.line}:{case.column}: " in str(caught.value)


def test_all_problems_are_reported_at_once_in_their_order(tmp_path: Path) -> None:
    text = GOOD
    for old, new in [
        ("28.7 mm", "28.7"),
        ("ratio: 0.33", "ratio: 0.66"),
        ("rig: stvf", "rig: stfv"),
        ("300 N", "20 N"),
        ("hold: 3 s", "holt: 3 s"),
        (_END, _END + "  search_distance: 1 mm\nrecrd: {}\n"),
    ]:
        text = text.replace(old, new)
    path = tmp_path / "plan.yaml"
    path.write_text(text)
    with pytest.raises(PlanError) as caught:
        load_plan(path)
    assert [p.line for p in caught.value.problems] == [6, 15, 16, 20, 23]
    for old, new in [("holt:", "hold:"), ("0.66", "0.33"), ("28.7\n", "28.7 mm\n")]:
        text = text.replace(old, new)
    path.write_text(text)
    with pytest.raises(PlanError) as caught:
        load_plan(path)
    assert [p.line for p in caught.value.problems] == [16, 19, 22, 23]


def test_a_problem_shows_its_line_with_a_caret(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    path.write_text(GOOD.replace("hold: 3 s", "hold: 3"))
    with pytest.raises(PlanError) as caught:
        load_plan(path)
    assert str(caught.value) == (
        f"{path}:20:9: hold: 3 has no unit\n"
        "   20 |   hold: 3\n"
        "      |         ^\n"
        '  -> expected a time with its unit, for example "3 s"\n'
        "\n"
        "1 problem; what keys say together is checked after that"
    )
