"""YAML 1.2 scalars and the places of nodes."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from stepload.plan.problems import PlanError, Problem
from stepload.plan.source import Source
from stepload.plan.tree import Mapping, Scalar, Sequence, parse_tree, resolve


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("", None), ("~", None), ("null", None), ("true", True), ("False", False),
        ("no", "no"), ("on", "on"), ("y", "y"), ("1:30", "1:30"), ("0x1F", "0x1F"),
        ("017", 17), ("-3", -3), ("1_000", "1_000"), ("1.5", 1.5), (".5", 0.5), ("1e3", 1000.0),
        ("-.inf", -math.inf), ("50 N", "50 N"), ("2025-03-01", "2025-03-01"), ("nan", "nan"),
    ],
)  # fmt: skip
def test_plain_scalars_mean_what_yaml_1_2_says(text: str, value: object) -> None:
    found = resolve(text)
    assert found == value
    assert type(found) is type(value)


def test_nodes_know_their_places() -> None:
    text = "a: 1\nb:\n  - x\n  - c: 'no'\r\nd:\ne: 2\n"
    root, problems = parse_tree(Source("f.yaml", Path("f.yaml"), text, text.encode()))
    assert problems == []
    assert isinstance(root, Mapping)
    assert (root.keys["b"].line, root.keys["b"].column) == (2, 1)
    items = root.entries["b"]
    assert isinstance(items, Sequence)
    inner = items.items[1]
    assert isinstance(inner, Mapping)
    value = inner.entries["c"]
    assert isinstance(value, Scalar)
    assert (value.value, value.place.line, value.place.column) == ("no", 4, 8)
    empty = root.entries["d"]
    assert isinstance(empty, Scalar)
    assert (empty.value, empty.place.line, empty.place.column) == (None, 5, 3)


def problems(text: str) -> list[Problem]:
    try:
        return parse_tree(Source("f.yaml", Path("f.yaml"), text, text.encode()))[1]
    except PlanError as error:
        return list(error.problems)


@pytest.mark.parametrize(
    ("text", "line", "column", "message", "hint"),
    [
        ("a: 1\na: 2", 2, 1, "duplicate key 'a'", "given already in line 1"),
        ("a: *b", 1, 4, "alias *b", "write the value where it is used"),
        ("a: &b 1", 1, 4, "anchor &b", "write the value where it is used"),
        ("<<: {a: 1}", 1, 1, "merge key <<", "write the value where it is used"),
        ("a: !x 1", 1, 4, "tag !x", "plans are plain data"),
        ("[a]: 1", 1, 1, "a key that is not a word", "write key: value"),
        ("a: 1\n---\nb: 1", 2, 1, "a second document", "one plan per file"),
        ("%YAML 1.1\n---\na: 1", 2, 1, "a YAML directive", "without directives"),
        ("%TAG ! x\n---\na: 1", 2, 1, "a YAML directive", "without directives"),
        ("a: \0", 1, 4, "a NUL character", "plans are text"),
        ("a: \x07", 1, 4, "character U+0007 is not allowed", "remove it"),
        ("a:\n\tb: 1", 2, 1, "a tab", "indent with spaces"),
        ("a: [1", 1, 6, "a comma is missing before this, or the [", "column 4"),
        ("", 1, 1, "the file is empty", "docs/plan.md"),
    ],
)
def test_what_is_no_plain_yaml_is_reported_at_its_place(
    text: str, line: int, column: int, message: str, hint: str
) -> None:
    (problem,) = problems(text)
    assert (problem.line, problem.column) == (line, column)
    assert message in problem.message
    assert hint in problem.hint
