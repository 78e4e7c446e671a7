"""The lists of mutants fit the sources they change."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

HERE = Path(__file__).resolve().parents[1] / "mutants"


def _runner() -> ModuleType:
    spec = importlib.util.spec_from_file_location("mutants_run", HERE / "run.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["mutants_run"] = module
    spec.loader.exec_module(module)
    return module


run = _runner()


@pytest.mark.parametrize("path", sorted(HERE.glob("*.toml")), ids=lambda path: path.stem)
def test_every_mutant_changes_exactly_one_place(path: Path) -> None:
    assert run.problems_of(run.mutants_in([path])) == []


@pytest.mark.parametrize(
    ("old", "new", "tests", "problem"),
    [
        ("no such text", "x", "tests/unit", "occurs 0 times"),
        ("force", "x", "tests/unit", "occurs"),
        ("def check_leash(", "def (", "tests/unit", "invalid syntax"),
        ("def check_leash(", "def check_leash(", "tests/unit", "nothing is changed"),
        ("def check_leash(", "def look_leash(", "tests/nowhere.py", "there is no"),
    ],
)
def test_a_mutant_that_does_not_fit_is_named(old: str, new: str, tests: str, problem: str) -> None:
    mutant = run.Mutant("envelope", "a name", "src/stepload/envelope/leash.py", old, new, tests)
    (found,) = run.problems_of([mutant])
    assert "a name" in found or "nowhere" in found
    assert problem in found


def test_a_mutant_that_stands_there_twice_is_named(tmp_path: Path) -> None:
    entry = '[[mutant]]\nsays = "no check"\nfile = "src/stepload/envelope/leash.py"\n'
    entry += 'old = "def check_leash("\nnew = "def other("\ntests = "tests/unit"\n'
    path = tmp_path / "envelope.toml"
    path.write_text(2 * entry)
    assert run.problems_of(run.mutants_in([path])) == ["envelope: 'no check' stands there twice"]
    path.write_text(entry + 'why = "no such key"\n')
    with pytest.raises(ValueError, match=r"envelope.toml: no check: .*why"):
        run.mutants_in([path])


def test_the_table_counts_by_room_and_names_what_survived() -> None:
    killed, survived, same = (
        run.Mutant(room, says, "file.py", "a", "b", "tests", equivalent)
        for room, says, equivalent in [
            ("run", "no R1", ""), ("plan", "no check", ""), ("plan", "a comment", "no effect")
        ]
    )  # fmt: skip
    text = run.table([run.Result(killed, "test_x"), run.Result(survived, "")], [same])
    lines = [line.split() for line in text.splitlines()]
    assert ["run", "1", "1", "0"] in lines
    assert ["plan", "0", "1", "1"] in lines
    assert ["all", "1", "2", "1", "50.0%"] in lines
    assert "survived: no check (file.py)" in text
    assert "equivalent: a comment: no effect" in text
