"""Asks the section models what stands where: for validation, JSON Schema and the reference."""

from __future__ import annotations

import types
from collections.abc import Iterator
from typing import Any, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from stepload.plan.fields import Leaf, Quantity
from stepload.plan.payload_section import Section
from stepload.units import format_quantity


def section_of(field: FieldInfo, shape: object = None) -> type[Section] | None:
    """The section model that stands in `field`, by its tag where there are several."""
    models = models_in(field)
    if field.discriminator is not None:
        return next((m for m in models if shape in shapes_of(m)), None)
    return models[0] if models else None


def shapes_of(model: type[Section]) -> tuple[object, ...]:
    """The tags of a model that is one of several."""
    return get_args(model.model_fields["shape"].annotation)


def leaf_of(field: FieldInfo) -> Leaf | None:
    """The field type that says what may be written in `field`."""
    found = [*field.metadata]
    for part in parts_of(field.annotation):
        found += getattr(part, "__metadata__", ())
    return next((item for item in found if isinstance(item, Leaf)), None)


def parts_of(annotation: Any) -> list[Any]:
    """The types a union or list is made of; a single type as it is."""
    if get_origin(annotation) in (Union, types.UnionType, list):
        return [inner for part in get_args(annotation) for inner in parts_of(part)]
    return [annotation]


def _is_section(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, Section)


def item_type(field: FieldInfo) -> Any:
    """What a list in `field` holds; None where no list belongs."""
    lists = [a for a in (field.annotation, *get_args(field.annotation)) if get_origin(a) is list]
    return get_args(lists[0])[0] if lists else None


def default_text(field: FieldInfo) -> str | bool | int | float | None:
    """The default as a plan would write it; None where it follows from other keys, or is none."""
    leaf, value = leaf_of(field), field.default
    if isinstance(leaf, Quantity) and isinstance(value, float):
        return format_quantity(value, leaf.unit, digits=6)
    return value if isinstance(value, (str, bool, int, float)) else None


def sections_below(model: type[Section]) -> Iterator[type[Section]]:
    """`model` and every section model in it, depth first, each once."""
    seen: dict[type[Section], None] = {}

    def visit(found: type[Section]) -> None:
        if found in seen:
            return
        seen[found] = None
        for field in found.model_fields.values():
            for inner in models_in(field):
                visit(inner)

    visit(model)
    return iter(seen)


def models_in(field: FieldInfo) -> list[type[Section]]:
    """The section models that may stand in `field`."""
    return [m for m in (field.annotation, *get_args(field.annotation)) if _is_section(m)]
