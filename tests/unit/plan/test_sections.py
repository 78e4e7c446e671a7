"""A declaration and what follows from it: keys, reading, JSON Schema, tables."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from pydantic import Field
from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import Flag, Force, Length, Name, Quantity
from stepload.declaration.sections import (
    DERIVED,
    INTERNAL,
    SECTION,
    Made,
    key,
    key_of,
    keys,
    sections_below,
)
from stepload.declaration.uncertain import Uncertain
from stepload.plan.calibration import CalibrationRecord
from stepload.plan.derived import RULES
from stepload.plan.model import Plan
from stepload.plan.problems import Problem
from stepload.plan.reader import read_section
from stepload.plan.schema import json_schema
from stepload.plan.source import Source
from stepload.plan.tree import Place, parse_tree


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Ball:
    """A ball, as its diameter."""

    shape: Literal["ball"]
    radius_m: Annotated[Length, key("Radius.")]

    def made(self) -> float:
        return 2.0 * self.radius_m


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Cube:
    """A cube, as its side."""

    shape: Literal["cube"]
    side_m: Annotated[Length, key("Side.")] = 0.01

    def made(self) -> float:
        return self.side_m


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Size:
    """A size, as its side."""

    side_m: Annotated[Length, key("Side.")] = 0.01

    def made(self) -> float:
        return self.side_m


@dataclass(frozen=True, slots=True, config=SECTION)
class Inner:
    """Something inside."""

    on: Annotated[Flag, key("Whether it is on.")] = True


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Outer:
    """A section with everything a section may have.

    More of it.
    """

    grip: Annotated[Name, key("Name of the grip.")]
    options: Annotated[dict[str, object], key("Whatever it takes.")] = Field(default_factory=dict)
    force_n: Annotated[Force, key("A force.")]
    limit_n: Annotated[Force | None, key("A limit; none: none.", alias="ceiling")] = None
    steps_n: Annotated[tuple[Force, ...], key("Steps.")] = DERIVED
    shape: Annotated[
        float, Made(Annotated[Ball | Cube, Field(discriminator="shape")]), key("A shape.")
    ]
    size: Annotated[float, Made(Size), key("A size.")]
    inner: Annotated[Inner, key("What is inside.")] = Field(default_factory=Inner)
    extra: Annotated[Inner | None, key("What is beside.")] = None
    path: Annotated[Path, INTERNAL] = Path("nowhere")


GOOD = """\
grip: jaw
options: {a: 1}
force: 3 N
ceiling: 5 N
steps: [1 N, 3 N]
shape: {shape: ball, radius: 1 m}
size: {side: 2 m}
inner: {on: false}
extra: {}
"""


def read(text: str, kind: Any = Outer) -> tuple[Any, list[Problem]]:
    source = Source("x.yaml", None, text, text.encode())
    node, problems = parse_tree(source)
    return read_section(kind, node, Place(source, 1, 1), problems), problems


def test_a_section_is_made_of_what_is_written() -> None:
    outer, problems = read(GOOD)
    assert problems == []
    assert (outer.force_n, outer.limit_n, outer.steps_n) == (3.0, 5.0, (1.0, 3.0))
    assert (outer.shape, outer.size) == (2.0, 2.0)
    assert (outer.inner.on, outer.extra) == (False, Inner())
    assert (outer.options, outer.path) == ({"a": 1}, Path("nowhere"))


def test_what_is_left_out_takes_its_default_or_follows() -> None:
    outer, problems = read("grip: jaw\nforce: 3 N\nshape: {shape: cube}\nsize: {}\n")
    assert problems == []
    assert (outer.shape, outer.size, outer.inner, outer.extra) == (0.01, 0.01, Inner(), None)
    assert outer.steps_n is DERIVED


@pytest.mark.parametrize(
    ("old", "new", "line", "column", "message", "hint"),
    [
        ("grip: jaw\n", "", 1, 1, "missing key 'grip'", "Name of the grip. Expected a text"),
        ("grip: jaw", "gripp: jaw", 1, 1, "unknown key 'gripp'", "did you mean 'grip'?"),
        ("options: {a: 1}", "options: 3", 2, 10, "'3' where a mapping belongs", ""),
        ("options: {a: 1}", "options: ~", 2, 10, "nothing stands behind `options`", "leave"),
        ("force: 3 N", "force: 3 mm", 3, 8, "force: '3 mm' is a length, not a force", '"50 N"'),
        ("force: 3 N", "force: ~", 3, 8, "force: nothing is not a force", '"50 N"'),
        ("force: 3 N", "force: [3 N]", 3, 8, "a list where one value belongs", "A force. Expected"),
        ("force: 3 N", "force: {}", 3, 8, "force: a mapping is not a force", '"50 N"'),
        ("force: 3 N", "zzz: 3 N", 3, 1, "unknown key 'zzz'", "known keys: grip,"),
        ("3 N]", "x]", 5, 14, "steps[1]: 'x' is not a number", '"50 N"'),
        ("[1 N, 3 N]", "1 N", 5, 8, "'1 N' where a list belongs", "Steps. Expected a list"),
        ("{shape: ball, radius: 1 m}", "1", 6, 8, "'1' where a mapping belongs", "shapes: ball,"),
        ("shape: ball, ", "", 6, 1, "missing key 'shape'", "shapes: ball, cube"),
        ("shape: ball", "shape: bal", 6, 16, "'bal' is not a shape", "did you mean 'ball'?"),
        ("shape: ball", "shape: {}", 6, 16, "a mapping is not a shape", "shapes: ball, cube"),
        ("radius", "side", 6, 22, "unknown key 'side'", "known keys: shape, radius"),
        (", radius: 1 m", "", 6, 1, "missing key 'radius'", "Radius. Expected a length"),
        ("size: {side: 2 m}", "size: x", 7, 7, "'x' where a mapping belongs", "keys: side"),
        ("inner: {on: false}", "inner: ~", 8, 8, "nothing stands behind `inner`", "leave the key"),
    ],
)  # fmt: skip
def test_what_is_bad_is_reported_at_its_place(
    old: str, new: str, line: int, column: int, message: str, hint: str
) -> None:
    assert GOOD.count(old) == 1
    _, problems = read(GOOD.replace(old, new))
    found = next(p for p in problems if message in p.message)
    assert (found.line, found.column) == (line, column)
    assert hint in found.hint


@pytest.mark.parametrize("kind", [*sections_below(Plan), CalibrationRecord])
def test_every_section_of_a_plan_is_well_declared(kind: Any) -> None:
    assert kind.__doc__
    names = [each.name for each in keys(kind)]
    assert len(set(names)) == len(names) > 0
    for each in keys(kind):
        for note in each.info.metadata:
            if isinstance(note, Quantity) and (note.unit or not isinstance(note, Uncertain)):
                assert each.field.endswith(note.suffix), each.field
                assert key_of(each.field) == each.field.removesuffix(note.suffix)


def test_every_key_that_may_be_left_out_has_a_rule_or_is_settled() -> None:
    settled = {("SystemStiffness", "stiffness_n_per_m"), ("SystemStiffness", "sigma_n_per_m")}
    sections = {"": "Plan", "procedure": "Procedure", "identify": "IdentifyPlan"}
    ruled = {(sections[section], field) for section, field, _ in RULES}

    def derived(kind: Any) -> Iterator[tuple[str, str]]:
        for each in keys(kind):
            for inner in each.sections:
                yield from derived(inner)
            if each.derived:
                yield kind.__name__, each.field

    assert set(derived(Plan)) == settled | ruled


def test_the_json_schema_of_a_plan() -> None:
    schema = json_schema()
    definitions = schema["$defs"]
    assert schema["properties"]["stepload"] == {
        "const": 1, "type": "integer", "title": "Stepload",
        "description": "Version of the plan format.",
    }  # fmt: skip
    assert schema["properties"]["payload"]["anyOf"] == [
        {"$ref": "#/$defs/Payload"}, {"type": "string", "minLength": 1},
    ]  # fmt: skip
    assert schema["properties"]["record"]["$ref"] == "#/$defs/RecordPlan"
    assert definitions["Payload"]["required"] == ["name", "geometry", "material", "plate"]
    assert definitions["MaterialSection"]["required"] == ["name", "youngs_modulus", "poisson_ratio"]
    assert definitions["Procedure"]["required"] == ["top_force", "surface_distance"]
    for name in ("Rig", "ArmSpec", "ForceSpec", "DisplacementSpec", "SystemStiffness"):
        assert "required" not in definitions[name]
    assert all(
        each["additionalProperties"] is False
        for each in [schema, *definitions.values()]
        if each["type"] == "object"
    )
    levels = definitions["Procedure"]["properties"]["levels"]
    assert (levels["type"], levels["items"]["type"]) == ("array", "string")
    options = definitions["ArmSpec"]["properties"]["options"]
    assert {"$ref": "#/$defs/ArmSpec options of ur"} in options["anyOf"]
    sphere = definitions["SphereSection"]
    assert sphere["properties"]["shape"]["const"] == "sphere"
    provenance = definitions["SystemStiffness"]["properties"]["provenance"]
    assert provenance["default"] == "declared"
    assert definitions["Provenance"]["enum"] == ["measured", "declared", "indicative"]
    assert definitions["Procedure"]["properties"]["hold"]["default"] == "3 s"
    assert definitions["RecordPlan"]["properties"]["directory"]["default"] == "runs"
