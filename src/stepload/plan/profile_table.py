"""The table of a profile from a CSV file, as if its points were written in the payload."""

from __future__ import annotations

import re

from stepload.plan.compose import at, replaced
from stepload.plan.problems import PlanError, Problem
from stepload.plan.source import Source
from stepload.plan.tree import Broken, Mapping, Node, Place, Scalar, Sequence

_HEAD = re.compile(r"\s*(r|z)\s*\[\s*([a-zµμ]+)\s*\]\s*")
PATH = ("geometry", "table")


def table_file(payload: Node) -> Scalar | None:
    """The name of the CSV file that a payload's profile is in; None where it names none."""
    found = at(payload, PATH)
    return found if isinstance(found, Scalar) and isinstance(found.value, str) else None


def with_table(payload: Node, table: Node) -> Node:
    """The payload with this table in place of the file's name."""
    assert isinstance(payload, Mapping)
    return replaced(payload, PATH, table)


def table_of(source: Source) -> Node:
    """Points of a CSV file, each with its place; heads name the columns and their units.

    Raises:
        PlanError: a line that is no point, or heads that are not `r [mm],z [mm]`.
    """
    lines = [(at, line) for at, line in enumerate(source.lines, 1) if line.strip()]
    heads = [_HEAD.fullmatch(cell) for cell in lines[0][1].split(",")] if lines else []
    names = [head[1] for head in heads if head]
    if sorted(names) != ["r", "z"] or len(heads) != 2:
        raise PlanError((source.problem(1, 1, "this is no table of r and z",
                                        "the first line is `r [mm],z [mm]`"),))  # fmt: skip
    units = [head[2] for head in heads if head]
    points: list[Node] = []
    problems: list[Problem] = []
    for number, line in lines[1:]:
        place, cells = Place(source, number, 1), line.split(",")
        if len(cells) != 2:
            problems.append(place.problem("this is not a point of r and z"))
            points.append(Broken(place))
            continue
        texts = [f"{cell.strip()} {unit}" for cell, unit in zip(cells, units, strict=True)]
        items: list[Node] = [Scalar(place, text, text) for text in texts]
        points.append(Sequence(place, items if names == ["r", "z"] else items[::-1]))
    if problems:
        raise PlanError(tuple(problems))
    return Sequence(Place(source, 1, 1), points)
