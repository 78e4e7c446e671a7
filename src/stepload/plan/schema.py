"""JSON Schema of a plan file, from the declarations of its sections."""

from __future__ import annotations

import inspect
from typing import Any

from stepload.plan.driver_options import expected
from stepload.plan.leaves import Quantity
from stepload.plan.model import Plan, Rig
from stepload.plan.sections import (
    SHAPE,
    Content,
    Each,
    Entry,
    Kind,
    Nested,
    OneOf,
    Options,
    sections_below,
    written_entries,
)
from stepload.rig.options import Option
from stepload.rig.plugins import list_drivers, load_driver
from stepload.units import format_quantity

_Schema = dict[str, Any]
SECTIONS = {
    "stepload.arms": "ArmSpec",
    "stepload.force_sensors": "ForceSpec",
    "stepload.displacement_sensors": "DisplacementSpec",
}
"""The section that names a driver of each group."""


def json_schema() -> _Schema:
    """JSON Schema (2020-12) of a plan file, for editors.

    It knows keys, types and units; what only `load_plan` can see (files, other keys) it does not.
    Since a rig may take any key from a profile, no key of a rig is required here.
    """
    definitions: dict[str, _Schema] = {}
    schema = _section(Plan, definitions)
    for kind in sections_below(Rig):
        del definitions[kind.__name__]["required"]
    for key in ("payload", "rig", "procedure"):
        inline = schema["properties"][key]
        meaning = inline.pop("description")
        path = {"type": "string", "minLength": 1}
        schema["properties"][key] = {"anyOf": [inline, path], "description": meaning}
    _add_options(definitions)
    version = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": version, **schema, "$defs": definitions}


def _section(kind: Kind, definitions: dict[str, _Schema]) -> _Schema:
    entries = list(written_entries(kind))
    return {
        "type": "object",
        "description": (inspect.getdoc(kind) or "").partition("\n\n")[0],
        "properties": {entry.name: _entry(entry, definitions) for entry in entries},
        "required": [entry.name for entry in entries if entry.required],
        "additionalProperties": False,
    }


def _entry(entry: Entry, definitions: dict[str, _Schema]) -> _Schema:
    schema = _content(entry.content, definitions)
    if entry.default_text is not None:
        schema["default"] = entry.default_text
    return schema | {"description": entry.key.meaning}


def _content(content: Content, definitions: dict[str, _Schema]) -> _Schema:
    match content:
        case Nested(kind):
            if kind.__name__ not in definitions:
                definitions[kind.__name__] = _section(kind, definitions)
            return {"$ref": f"#/$defs/{kind.__name__}"}
        case OneOf(kinds):
            return {"oneOf": [_shaped(kind, definitions) for kind in kinds]}
        case Each(leaf):
            return {"type": "array", "items": leaf.json_schema()}
        case Options():
            return {"type": "object"}
        case _:
            return content.json_schema()


def _shaped(kind: Kind, definitions: dict[str, _Schema]) -> _Schema:
    schema = _section(kind, definitions)
    schema["properties"][SHAPE] = {"const": kind.__name__}
    schema["required"].append(SHAPE)
    return schema


def _add_options(definitions: dict[str, _Schema]) -> None:
    """Add the options of every installed driver to the section of its kind of device.

    Where the driver is that of a profile, the options must be those of one that is installed.
    No option is required: a profile may give it.
    """
    for group, section in SECTIONS.items():
        drivers = [each.name for each in list_drivers() if each.group == group and not each.problem]
        names = {driver: f"{section} options of {driver}" for driver in drivers}
        for driver, name in names.items():
            definitions[name] = _options(load_driver(group, driver).OPTIONS, driver)
        content = definitions[section]
        free = content["properties"]["options"]
        content["properties"]["options"] = {
            "anyOf": [_reference(name) for name in names.values()],
            "description": free["description"],
        }
        content["allOf"] = [
            {
                "if": {"properties": {"driver": {"const": driver}}, "required": ["driver"]},
                "then": {"properties": {"options": _reference(name)}},
            }
            for driver, name in names.items()
        ]


def _reference(name: str) -> _Schema:
    return {"$ref": f"#/$defs/{name}"}


def _options(declared: Any, driver: str) -> _Schema:
    return {
        "type": "object",
        "description": f"Options of the driver {driver}.",
        "properties": {key: _option(option) for key, option in declared.items()},
        "additionalProperties": False,
    }


def _option(option: Option) -> _Schema:
    told = f"{option.help}; {expected(option)}"
    schema = _kind(option) | {"description": told}
    if option.default is not None:
        schema["default"] = _written(option)
    return schema


def _kind(option: Option) -> _Schema:
    limits = {"minimum": option.low, "maximum": option.high}
    within = {key: value for key, value in limits.items() if value is not None}
    match option.kind:
        case "text":
            return {"enum": list(option.choices)} if option.choices else {"type": "string"}
        case "quantity":
            leaf = Quantity(option.unit, float("-inf"), float("inf"))
            shown = leaf.json_schema()
            return {key: shown[key] for key in ("type", "pattern", "examples")}
        case "vector":
            return {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
        case "boolean":
            return {"type": "boolean"}
        case _:
            return {"type": option.kind, **within}


def _written(option: Option) -> object:
    """The default as a plan would write it."""
    if option.kind == "quantity" and isinstance(option.default, float | int):
        return format_quantity(float(option.default), option.unit)
    return list(option.default) if isinstance(option.default, tuple) else option.default
