"""Options of drivers, as plans write them, against what drivers declare."""

from __future__ import annotations

from pathlib import Path

import pytest

from stepload.plan import driver_options
from stepload.plan.problems import Problem
from stepload.plan.source import Source
from stepload.plan.tree import Mapping, Place, parse_tree
from stepload.rig.options import Option
from stepload.rig.plugins import GROUPS, driver_names, load_driver
from stepload.units import describe_unit

DECLARED = {
    "host": Option("text", "address", required=True),
    "mode": Option("text", "how", default="a", choices=("a", "b")),
    "count": Option("integer", "how many", low=1, high=9),
    "gain": Option("number", "servo gain", default=300.0, low=100.0),
    "fast": Option("boolean", "whether", default=False),
    "lookahead": Option("quantity", "look-ahead", unit="s", default=0.1, low=0.03, high=0.2),
    "approach": Option("vector", "direction"),
}


class Fake:
    """Stands for a driver class."""

    OPTIONS = DECLARED


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch):  # type: ignore[no-untyped-def]
    """Reads a text as the options of the fake driver: options and problems."""
    monkeypatch.setattr(driver_options, "load_driver", lambda group, name: Fake)

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
        ("host: 3", "3 is not a text", "address"),
        ('host: "\\e[2J"', "is not a text", "address"),
        ("mode: c", "c is not one of a, b", "how"),
        ("count: 10", "10 is not a whole number from 1 to 9", "how many"),
        ("count: 1.5", "1.5 is not a whole number", "how many"),
        ("count: true", "True is not a whole number", "how many"),
        ("gain: 50", "50 is not a plain number from 100", "servo gain"),
        ("gain: .inf", "inf is not a plain number from 100", "servo gain"),
        ("gain: .nan", "nan is not a plain number", "servo gain"),
        ("fast: yes", "yes is not true or false", "whether"),
        ("lookahead: 0.05", "0.05 has no unit", "a time"),
        ("lookahead: 50 mm", "is a length, not a time", "a time"),
        ("lookahead: 1 s", "1 s is not a quantity in s from 0.03 to 0.2 s", "look-ahead"),
        ("approach: [0, 0]", "is not a list of three plain numbers", "direction"),
        ("approach: [0, 0, .inf]", "is not a list of three plain numbers", "direction"),
        ("approach: [0, 0, down]", "is not a list of three plain numbers", "direction"),
        ("approach: [0, 0, -1, 0]", "is not a list of three plain numbers", "direction"),
        ("approach: down", "down is not a list of three", "direction"),
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


def test_a_missing_required_option_is_reported_with_its_meaning(read) -> None:  # type: ignore[no-untyped-def]
    _, problems = read("gain: 200")
    assert [(p.message, p.hint) for p in problems] == [
        ("driver 'fake' needs the option 'host'", "address; a text")
    ]


@pytest.mark.parametrize("group", GROUPS)
def test_every_installed_driver_declares_units_that_plans_can_write(group: str) -> None:
    for name in driver_names(group):
        for key, option in load_driver(group, name).OPTIONS.items():
            if option.kind == "quantity":
                assert describe_unit(option.unit)[1], f"{name}.{key}"
