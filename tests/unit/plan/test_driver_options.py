"""Options of drivers, as plans write them, against what drivers declare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pytest
from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import WRITTEN, Choice, Flag, Setting, Vector, Verbatim, number
from stepload.declaration.sections import SECTION, adapter, key, keys
from stepload.plan import driver_options
from stepload.plan.problems import Problem
from stepload.plan.source import Source
from stepload.plan.tree import Mapping, Place, parse_tree
from stepload.rig.plugins import GROUPS, driver_names, load_driver

_Gain = Annotated[float, number(100.0, 1e9), key("servo gain")]


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Options:
    """Options of each kind."""

    host: Annotated[Verbatim, key("address")]
    mode: Annotated[str, Choice(("a", "b")), key("how")] = "a"
    count: Annotated[Annotated[int, number(1, 9)] | None, key("how many")] = None
    gain: _Gain = 300.0
    fast: Annotated[Flag, key("whether")] = False
    lookahead_s: Annotated[float, Setting("s", 0.03, 0.2), key("look-ahead")] = 0.1
    approach: Annotated[Vector | None, key("direction")] = None


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch):  # type: ignore[no-untyped-def]
    """Reads a text as the options of the fake driver: options and problems."""
    monkeypatch.setattr(driver_options, "options_of", lambda group, name: Options)

    def read(text: str) -> tuple[dict[str, object], list[Problem]]:
        source = Source("rig.yaml", Path("rig.yaml"), text, text.encode())
        node, problems = parse_tree(source)
        assert isinstance(node, Mapping)
        at = Place(source, 1, 1)
        return driver_options.read_options("stepload.arms", "fake", at, node, problems), problems

    return read


def test_good_options_arrive_in_si_with_the_defaults(read) -> None:  # type: ignore[no-untyped-def]
    options, problems = read("host: 127.0.0.1\nlookahead: 50 ms\napproach: [0, 0, -1]\ncount: 3")
    assert problems == []
    assert options == {
        "host": "127.0.0.1", "mode": "a", "gain": 300.0, "fast": False,
        "lookahead": 0.05, "approach": (0.0, 0.0, -1.0), "count": 3,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("hots: a", "unknown key 'hots'", "'host'"),
        ("host: 3", "3 is not a text", "in quotes"),
        ('host: "\\e[2J"', "U+001B", "remove it"),
        ("mode: c", "'c' is not a choice", "one of a, b"),
        ("count: 10", "10 is out of range", "from 1 to 9"),
        ("count: 1.5", "1.5 is not a whole number", "from 1 to 9"),
        ("count: true", "true is not a whole number", "from 1 to 9"),
        ("count:", "nothing stands", "leave the key out"),
        ("gain: 50", "50 is out of range", "from 100"),
        ("gain: .inf", "inf is not a plain number", "from 100"),
        ("gain: .nan", "nan is not a plain number", "from 100"),
        ("gain: [200]", "a list where one value belongs", "servo gain"),
        ("fast: yes", "'yes' is neither true nor false", "true or false"),
        ("lookahead: 0.05", "0.05 has no unit", "a time"),
        ("lookahead: 50 mm", "is a length, not a time", "a time"),
        ("lookahead: 1 s", "1 s is out of range", "from 30 ms to 200 ms"),
        ("approach: [0, 0]", "not a list of three plain numbers", "[0, 0, -1]"),
        ("approach: [0, 0, .inf]", "not a list of three plain numbers", "[0, 0, -1]"),
        ("approach: [0, 0, down]", "not a list of three plain numbers", "[0, 0, -1]"),
        ("approach: [0, 0, -1, 0]", "not a list of three plain numbers", "[0, 0, -1]"),
        ("approach: down", "not a list of three", "[0, 0, -1]"),
    ],
)
def test_bad_options_are_reported_at_their_place(  # type: ignore[no-untyped-def]
    read, text: str, message: str, hint: str
) -> None:
    _, problems = read(f"gain: 200\n{text}" if not text.startswith("gain") else f"\n{text}")
    reported = [p for p in problems if message in p.message]
    assert reported, problems
    assert reported[0].line == 2
    assert hint in reported[0].hint


@pytest.mark.parametrize("group", GROUPS)
def test_every_default_of_an_installed_driver_is_one_that_a_plan_may_write(group: str) -> None:
    for name in driver_names(group):
        declared = load_driver(group, name).OPTIONS
        for each in keys(declared):
            assert each.meaning, f"{name}.{each.name}"
            if each.default_text is not None:
                read = adapter(each.hint).validate_python(each.default_text, context=WRITTEN)
                assert read == pytest.approx(each.info.default), f"{name}.{each.name}"
