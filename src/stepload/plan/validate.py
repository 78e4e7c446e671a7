"""Checks a position tree against the section models: every key by itself, every problem kept.

Each field is validated by pydantic on its own, so that a bad value hides neither its neighbours'
problems nor the checks that do not need it.
"""

from __future__ import annotations

import types
from difflib import get_close_matches
from functools import cache
from typing import Annotated, Any, get_args, get_origin

from pydantic import TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from stepload.plan.introspect import (
    item_type,
    leaf_of,
    parts_of,
    section_of,
    shapes_of,
)
from stepload.plan.payload_section import Section
from stepload.plan.problems import Problem, printable
from stepload.plan.tree import Broken, Mapping, Node, Place, Scalar, Sequence

Values = dict[str, Any]
"""Good values by key; nested sections are `Values`, driver options stay a `Mapping` node."""


def read_section(model: type[Section], node: Node, at: Place, problems: list[Problem]) -> Values:
    """The good values of `node`, defaults filled in; what is wrong is added to `problems`.

    `at` is where a missing key is reported.
    """
    if isinstance(node, Broken):
        return {}
    if not isinstance(node, Mapping):
        keys = ", ".join(model.model_fields)
        problems.append(
            node.place.problem(f"{_told(node)} where a mapping belongs", f"keys: {keys}")
        )
        return {}
    for key, place in node.keys.items():
        if key not in model.model_fields:
            problems.append(unknown_key(place, key, list(model.model_fields)))
    values: Values = {}
    for name, field in model.model_fields.items():
        if name in node.entries:
            _read_field(name, field, node, values, problems)
        elif not field.is_required():
            default = field.get_default(call_default_factory=True)
            values[name] = default.model_dump() if isinstance(default, Section) else default
        else:
            problems.append(at.problem(f"missing key {name!r}", _wanted(field)))
    return values


def unknown_key(place: Place, key: str, known: list[str]) -> Problem:
    """The problem of a key that means nothing here, with the nearest one that does."""
    near = get_close_matches(key[:60], known, n=1)
    hint = f"did you mean {near[0]!r}?" if near else "known keys: " + (", ".join(known) or "none")
    return place.problem(f"unknown key {printable(key)!r}", hint)


def _read_field(
    name: str, field: FieldInfo, parent: Mapping, values: Values, problems: list[Problem]
) -> None:
    node = parent.entries[name]
    if isinstance(node, Broken):
        return
    optional = not field.is_required() and field.default is None
    if optional and isinstance(node, Scalar) and node.value is None:
        values[name] = None
    elif field.discriminator is not None:
        _read_tagged(name, field, parent, values, problems)
    elif model := section_of(field):
        values[name] = read_section(model, node, parent.keys[name], problems)
    elif get_origin(field.annotation) is dict:
        if isinstance(node, Mapping):
            values[name] = node
        else:
            problems.append(node.place.problem(f"{_told(node)} where a mapping belongs"))
    elif isinstance(node, Sequence) or item_type(field) is not None:
        _read_list(name, field, node, values, problems)
    else:
        _read_leaf(name, _adapter(field), node, values, problems)


def _read_tagged(
    name: str, field: FieldInfo, parent: Mapping, values: Values, problems: list[Problem]
) -> None:
    node = parent.entries[name]
    shapes = [str(s) for m in get_args(field.annotation) for s in shapes_of(m)]
    hint = "shapes: " + ", ".join(shapes)
    if not isinstance(node, Mapping):
        problems.append(node.place.problem(f"{_told(node)} where a mapping belongs", hint))
        return
    tag = node.entries.get("shape")
    if tag is None:
        problems.append(parent.keys[name].problem("missing key 'shape'", hint))
        return
    model = section_of(field, tag.value if isinstance(tag, Scalar) else None)
    if model is not None:
        values[name] = read_section(model, node, parent.keys[name], problems)
    elif not isinstance(tag, Broken):
        near = get_close_matches(str(getattr(tag, "value", ""))[:60], shapes, n=1)
        hint = f"did you mean {near[0]!r}? {hint}" if near else hint
        problems.append(tag.place.problem(f"{_told(tag)} is not a shape", hint))


def _read_list(
    name: str, field: FieldInfo, node: Node, values: Values, problems: list[Problem]
) -> None:
    inner = item_type(field)
    if inner is None or not isinstance(node, Sequence):
        wanted = "one value belongs" if inner is None else "a list belongs"
        problems.append(node.place.problem(f"{_told(node)} where {wanted}", _wanted(field)))
        return
    items: Values = {}
    for index, item in enumerate(node.items):
        _read_leaf(f"{name}[{index}]", _leaf_adapter(inner, ()), item, items, problems)
    if len(items) == len(node.items):
        values[name] = list(items.values())


def _read_leaf(
    name: str, adapter: TypeAdapter[Any], node: Node, values: Values, problems: list[Problem]
) -> None:
    if isinstance(node, Broken):
        return
    value: Any = node.value if isinstance(node, Scalar) else {} if isinstance(node, Mapping) else []
    try:
        values[name] = adapter.validate_python(value)
    except ValidationError as error:
        first = error.errors()[0]
        context = first.get("ctx", {})
        message = context.get("message", f"{_told(node)} is not accepted here")
        hint = context.get("hint") or f"expected {context.get('expected', 'something else')}"
        problems.append(node.place.problem(f"{name}: {message}", hint))


@cache
def _leaf_adapter(annotation: Any, metadata: tuple[Any, ...]) -> TypeAdapter[Any]:
    return TypeAdapter(Annotated[(annotation, *metadata)] if metadata else annotation)


def _adapter(field: FieldInfo) -> TypeAdapter[Any]:
    annotation = next(p for p in parts_of(field.annotation) if p is not types.NoneType)
    return _leaf_adapter(annotation, tuple(field.metadata))


def _wanted(field: FieldInfo) -> str:
    leaf = leaf_of(field)
    return f"{field.description} Expected {leaf.expected()}" if leaf else str(field.description)


def _told(node: Node) -> str:
    if isinstance(node, Scalar):
        return "nothing" if node.value is None else repr(printable(str(node.value)))
    return "a list" if isinstance(node, Sequence) else "a mapping"
