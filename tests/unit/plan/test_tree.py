"""YAML 1.2 scalars and the places of nodes."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

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


def test_not_a_number_is_one() -> None:
    assert math.isnan(float(str(resolve(".nan"))))


def test_digits_without_end_are_no_integer() -> None:
    assert resolve("9" * 10_000) == math.inf


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
