"""A declaration and what follows from it: keys, reading, drafts, JSON Schema, reference."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import FrozenInstanceError, dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import pytest

from stepload.plan.calibration import CalibrationRecord
from stepload.plan.derived import RULES
from stepload.plan.draft import UnknownError, leave_out, left_out, put, whole, written
from stepload.plan.leaves import Force, Length, Name, Switch, UncertainForce, Version
from stepload.plan.model import IdentifyPlan, Plan, RecordPlan
from stepload.plan.problems import Problem
from stepload.plan.reader import read_section
from stepload.plan.reference import table
from stepload.plan.schema import json_schema
from stepload.plan.sections import (
    Key,
    Nested,
    OneOf,
    Options,
    entries,
    sections_below,
    written_entries,
)
from stepload.plan.source import Source
from stepload.plan.tree import Place, parse_tree


@dataclass(frozen=True, slots=True)
class Grip:
    """What holds the ball."""

    name: Annotated[Name, Key("Name of the grip.", name="grip")]
    options: Annotated[dict[str, object], Options(), Key("Whatever it takes.", derived=True)]


def ball(radius_m: Annotated[Length, Key("Radius.")]) -> float:
    """A ball, as its diameter."""
    return 2.0 * radius_m


def cube(side_m: Annotated[Length, Key("Side.")] = 0.01) -> float:
    """A cube, as its side."""
    return side_m


@dataclass(frozen=True, slots=True)
class Inner:
    """Something inside."""

    on: Annotated[bool, Switch(), Key("Whether it is on.")] = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Outer:
    """A section with everything a section may have.

    More of it.
    """

    version: ClassVar[Annotated[int, Version(3), Key("Version.")]]
    remark: ClassVar[Annotated[Name | None, Key("Only checked.")]] = None
    grip: Annotated[Grip, Key(inline=True)]
    force_n: Annotated[Force, Key("A force.")]
    limit_n: Annotated[Force | None, Key("A limit; none: none.", name="ceiling")] = None
    steps_n: Annotated[tuple[Force, ...], Key("Steps.", derived=True)]
    shape: Annotated[float, OneOf((ball, cube)), Key("A shape.")]
    size: Annotated[float, Nested(cube), Key("A size.")]
    inner: Annotated[Inner, Key("What is inside.")] = Inner()
    extra: Annotated[Inner | None, Key("What is beside.")] = None
    more: Annotated[Inner, Key("What is there in any case.", derived=True)]
    path: Path = Path("nowhere")


GOOD = """\
version: 3
remark: hello
grip: jaw
options: {a: 1}
force: 3 N
ceiling: 5 N
steps: [1 N, 3 N]
shape: {shape: ball, radius: 1 m}
size: {side: 2 m}
inner: {on: false}
extra: {}
more: {on: false}
"""


def read(text: str, kind: Any = Outer) -> tuple[Any, list[Problem]]:
    source = Source("x.yaml", None, text, text.encode())
    node, problems = parse_tree(source)
    return read_section(kind, node, Place(source, 1, 1), problems), problems


def test_a_section_is_made_of_what_is_written() -> None:
    draft, problems = read(GOOD)
    assert problems == []
    node = draft.grip.options
    put(draft.grip, "options", {"a": 1})
    made = whole(draft)
    assert list(node.entries) == ["a"]
    assert made == Outer(
        grip=Grip("jaw", {"a": 1}), force_n=3.0, limit_n=5.0, steps_n=(1.0, 3.0), shape=2.0,
        size=2.0, inner=Inner(False), extra=Inner(True), more=Inner(False),
    )  # fmt: skip


def test_what_is_left_out_has_its_default_or_follows_from_others() -> None:
    draft, problems = read("version: 3\ngrip: jaw\nforce: 3 N\nshape: {shape: cube}\nsize: {}\n")
    assert problems == []
    assert left_out(draft) == ["steps_n"]
    assert left_out(draft.grip) == ["options"]
    assert written(draft, "steps_n") is None
    with pytest.raises(UnknownError):
        whole(draft)
    put(draft, "steps_n", (1.0,))
    put(draft.grip, "options", {})
    assert left_out(draft) == []
    made = whole(draft)
    assert (made.limit_n, made.extra, made.inner, made.more) == (None, None, Inner(), Inner())
    assert (made.shape, made.size, made.path) == (0.01, 0.01, Path("nowhere"))


@pytest.mark.parametrize("nothing", ["", " ~", " null"])
def test_nothing_behind_a_key_is_not_the_same_as_no_key(nothing: str) -> None:
    """Who forgets the value of a lower limit must not get the one by theory without a word."""
    for entry in written_entries(Outer):
        text = "".join(line for line in GOOD.splitlines(True) if f"{entry.name}:" not in line)
        _, problems = read(f"{text}{entry.name}:{nothing}\n")
        place = (12, len(entry.name) + 2 + len(nothing.strip()[:1]))
        found = [p for p in problems if (p.line, p.column) == place]
        assert len(found) == 1, entry.name
        optional = entry.name not in ("version", "grip", "force", "shape", "size")
        assert (found[0].message == f"nothing stands behind `{entry.name}`") == optional
        assert (found[0].hint == "write a value, or leave the key out") == optional


def test_only_a_record_that_stepload_writes_itself_may_hold_null() -> None:
    kinds = (*sections_below(Plan), CalibrationRecord)
    may = {(kind.__name__, e.name) for kind in kinds for e in written_entries(kind) if e.key.null}
    assert may == {
        ("CalibrationRecord", name)
        for name in ("temperature", "smooth_error", "smooth_degrees", "smooth_length")
    }
    assert '"null"' not in json.dumps(json_schema())


@pytest.mark.parametrize(
    ("old", "new", "line", "column", "message", "hint"),
    [
        ("version: 3", "version: 4", 1, 10, "version: '4' is not accepted here", "expected 3"),
        ("version: 3\n", "", 1, 1, "missing key 'version'", "Version. Expected `3`"),
        ("remark: hello", "remark: 3", 2, 9, "remark: 3 is not a text", "quotes"),
        ("grip: jaw\n", "", 1, 1, "missing key 'grip'", "Name of the grip. Expected a text"),
        ("grip: jaw", "gripp: jaw", 3, 1, "unknown key 'gripp'", "did you mean 'grip'?"),
        ("options: {a: 1}", "options: 3", 4, 10, "'3' where a mapping belongs", ""),
        ("options: {a: 1}", "options: ~", 4, 10, "nothing stands behind `options`", "leave"),
        ("force: 3 N", "force: 3 mm", 5, 8, "force: '3 mm' is a length, not a force", '"50 N"'),
        ("force: 3 N", "force: ~", 5, 8, "force: nothing is not a force", '"50 N"'),
        ("force: 3 N", "force: [3 N]", 5, 8, "a list where one value belongs", "A force. Expected"),
        ("force: 3 N", "force: {}", 5, 8, "force: a mapping is not a force", '"50 N"'),
        ("force: 3 N", "zzz: 3 N", 5, 1, "unknown key 'zzz'", "known keys: version, remark, grip,"),
        ("3 N]", "x]", 7, 14, "steps[1]: 'x' is not a number", '"50 N"'),
        ("[1 N, 3 N]", "1 N", 7, 8, "'1 N' where a list belongs", "Steps. Expected a force"),
        ("{shape: ball, radius: 1 m}", "1", 8, 8, "'1' where a mapping belongs", "shapes: ball,"),
        ("shape: ball, ", "", 8, 1, "missing key 'shape'", "shapes: ball, cube"),
        ("shape: ball", "shape: bal", 8, 16, "'bal' is not a shape", "did you mean 'ball'?"),
        ("shape: ball", "shape: {}", 8, 16, "a mapping is not a shape", "shapes: ball, cube"),
        ("radius", "side", 8, 22, "unknown key 'side'", "known keys: shape, radius"),
        (", radius: 1 m", "", 8, 1, "missing key 'radius'", "Radius. Expected a length"),
        ("size: {side: 2 m}", "size: x", 9, 7, "'x' where a mapping belongs", "keys: side"),
        ("inner: {on: false}", "inner: ~", 10, 8, "nothing stands behind `inner`", "leave the key"),
        ("more: {on: false}", "more: ~", 12, 7, "nothing stands behind `more`", "leave the key"),
        ("more: {on: false}", "more: {on: 1}", 12, 12, "on: 1 is neither true nor false", "true"),
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


def test_every_bad_item_of_a_list_is_reported() -> None:
    draft, problems = read(GOOD.replace("[1 N, 3 N]", "[x, 3 N, 0 N]"))
    assert [p.message.split(":")[0] for p in problems] == ["steps[0]", "steps[2]"]
    assert not hasattr(draft, "steps_n")


def test_a_value_that_is_bad_is_unknown_and_its_neighbours_are_not() -> None:
    draft, problems = read(GOOD.replace("force: 3 N", "force: 3").replace("radius: 1 m", "r: 1 m"))
    assert len(problems) == 3
    assert (draft.limit_n, draft.inner.on, draft.grip.name) == (5.0, False, "jaw")
    for ask in (lambda: draft.force_n, lambda: draft.shape.radius_m, lambda: whole(draft)):
        with pytest.raises(UnknownError):
            ask()


def test_a_value_may_be_left_out_or_bad_and_is_unknown_in_both_cases() -> None:
    missing, _ = read(GOOD.replace("steps: [1 N, 3 N]\n", ""))
    bad, _ = read(GOOD.replace("[1 N, 3 N]", "x"))
    assert written(missing, "steps_n") is None
    assert (left_out(missing), left_out(bad)) == (["steps_n"], [])
    with pytest.raises(UnknownError):
        written(bad, "steps_n")
    leave_out(bad, "limit_n")
    assert left_out(bad) == []


def test_the_name_of_a_field_must_end_in_its_unit() -> None:
    def wrong(force_m: Annotated[Force, Key("A force.", name="force")]) -> None:
        """A force in metres."""

    with pytest.raises(TypeError, match=r"force_m is in N: its name must end in '_n'"):
        entries(wrong)


def test_a_field_must_say_what_may_be_written() -> None:
    def wrong(name: Annotated[str, Key("A name.")]) -> None:
        """Any text at all?"""

    with pytest.raises(TypeError, match="'str'> does not say what may be written"):
        entries(wrong)


@pytest.mark.parametrize("kind", [*sections_below(Plan), CalibrationRecord])
def test_every_section_of_a_plan_is_well_declared(kind: Any) -> None:
    assert kind.__doc__
    names = [entry.name for entry in written_entries(kind)]
    assert len(set(names)) == len(names) > 0


def test_every_key_that_may_be_left_out_has_a_rule_or_is_settled() -> None:
    settled = {("SystemStiffness", "stiffness_n_per_m"), ("SystemStiffness", "sigma_n_per_m"),
               ("DriverChoice", "options")}  # fmt: skip
    sections = {"": "Plan", "procedure": "Procedure", "identify": "IdentifyPlan"}
    ruled = {(sections[section], field) for section, field, _ in RULES}

    def derived(kind: Any) -> Iterator[tuple[str, str]]:
        for entry in entries(kind):
            inner = entry.content.kind if isinstance(entry.content, Nested) else None
            if inner:
                yield from derived(inner)
            elif entry.key.derived:
                yield kind.__name__, entry.field

    assert set(derived(Plan)) == settled | ruled


def test_sections_are_frozen_and_refuse_misspelt_names() -> None:
    identify = IdentifyPlan(secant_force_n=3.0)
    assert replace(identify, accuracy_t=4.0).accuracy_t == 4.0
    with pytest.raises(TypeError):
        replace(identify, acuracy_t=4.0)  # type: ignore[call-arg]
    with pytest.raises(FrozenInstanceError):
        RecordPlan().notes = "x"  # type: ignore[misc]
    assert not hasattr(identify, "__dict__")
    assert len(fields(Plan)) == 10


def test_the_table_of_a_section() -> None:
    assert table(Outer).splitlines()[2:] == [
        "| `version` | `3` | **required** | Version. |",
        "| `remark` | a text of one line of at most 100 characters |  | Only checked. |",
        "| `grip` | a text of one line of at most 100 characters | **required** | "
        "Name of the grip. |",
        "| `options` | a mapping |  | Whatever it takes. |",
        "| `force` | a force above 0 N up to 1 MN | **required** | A force. |",
        "| `ceiling` | a force above 0 N up to 1 MN |  | A limit; none: none. |",
        "| `steps` | a list, each a force above 0 N up to 1 MN |  | Steps. |",
        "| `shape` | a mapping with one of the shapes below | **required** | A shape. |",
        "| `size` | a mapping | **required** | A size. |",
        "| `inner` | a mapping |  | What is inside. |",
        "| `extra` | a mapping |  | What is beside. |",
        "| `more` | a mapping |  | What is there in any case. |",
    ]
    assert table(cube).splitlines()[2:] == [
        "| `side` | a length above 0 m up to 10 m | `10 mm` | Side. |"
    ]
    assert table(Inner).splitlines()[2:] == [
        "| `on` | true or false | `true` | Whether it is on. |"
    ]


def test_the_json_schema_of_a_plan() -> None:
    schema = json_schema()
    definitions = schema["$defs"]
    assert schema["properties"]["stepload"] == {
        "const": 1, "type": "integer", "description": "Version of the plan format.",
    }  # fmt: skip
    assert schema["properties"]["payload"]["anyOf"] == [
        {"$ref": "#/$defs/Payload"}, {"type": "string", "minLength": 1},
    ]  # fmt: skip
    assert schema["properties"]["record"]["$ref"] == "#/$defs/RecordPlan"
    assert definitions["Payload"]["required"] == ["name", "geometry", "material", "plate"]
    assert definitions["material"]["required"] == ["name", "youngs_modulus", "poisson_ratio"]
    assert definitions["Procedure"]["required"] == ["top_force", "surface_distance"]
    for name in ("Rig", "ArmSpec", "ForceSpec", "DisplacementSpec", "SystemStiffness"):
        assert "required" not in definitions[name]
    assert all(d["additionalProperties"] is False for d in [schema, *definitions.values()])
    levels = definitions["Procedure"]["properties"]["levels"]
    assert (levels["type"], levels["items"]["type"]) == ("array", "string")
    options = definitions["ArmSpec"]["properties"]["options"]
    assert {"$ref": "#/$defs/ArmSpec options of ur"} in options["anyOf"]
    sphere = definitions["Payload"]["properties"]["geometry"]["oneOf"][0]
    assert sphere["properties"]["shape"] == {"const": "sphere"}
    assert sphere["required"] == ["radius", "shape"]
    provenance = definitions["SystemStiffness"]["properties"]["provenance"]
    assert (provenance["enum"], provenance["default"]) == (
        ["measured", "declared", "indicative"], "declared",
    )  # fmt: skip
    assert definitions["RecordPlan"]["properties"]["directory"]["default"] == "runs"


def test_an_uncertain_value_needs_a_field_for_its_uncertainty() -> None:
    def wrong(force_n: Annotated[UncertainForce, Key("A force.")]) -> None:
        """A force that nobody knows well."""

    with pytest.raises(
        TypeError, match="force_n is uncertain: there must be a field force_sigma_n"
    ):
        entries(wrong)
