"""JSON Schema of a plan file, from the declarations of its sections."""

from __future__ import annotations

from typing import Any

from stepload.declaration.sections import Kind, keys, schema_of, sections_below
from stepload.plan.model import Plan, Rig
from stepload.rig.plugins import WORLDS, list_drivers, options_of

_Schema = dict[str, Any]
SECTIONS = {
    "stepload.arms": "ArmSpec",
    "stepload.force_sensors": "ForceSpec",
    "stepload.displacement_sensors": "DisplacementSpec",
    WORLDS: "Simulation",
}
"""The section that names a driver of each group, or a world."""


def json_schema() -> _Schema:
    """JSON Schema (2020-12) of a plan file, for editors.

    It knows keys, types and units; what only `load_plan` can see (files, other keys) it does not.
    Since a rig may take any key from a profile, no key of a rig is required here.
    """
    schema: _Schema = _tidy(schema_of(Plan))
    definitions = schema.pop("$defs")
    for kind in sections_below(Plan):
        _write_words(schema if kind is Plan else definitions[kind.__name__], kind)
    for kind in sections_below(Rig):
        definitions[kind.__name__].pop("required", None)
    for name in ("payload", "rig", "procedure"):
        inline = schema["properties"][name]
        meaning = inline.pop("description")
        path = {"type": "string", "minLength": 1}
        schema["properties"][name] = {"anyOf": [inline, path], "description": meaning}
    _add_options(definitions)
    version = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": version, "$id": "urn:stepload:plan:1", **schema, "$defs": definitions}


def _tidy(schema: Any) -> Any:
    """A schema without null, which no plan may write, and without words for our own errors."""
    if isinstance(schema, list):
        return [_tidy(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {
        key: _tidy(value)
        for key, value in schema.items()
        if key != "x-expected" and not (key == "default" and value is None)
    }
    options = [each for each in kept.get("anyOf", ()) if each != {"type": "null"}]
    if len(options) == 1:
        del kept["anyOf"]
        return options[0] | kept
    return kept


def _add_options(definitions: dict[str, _Schema]) -> None:
    """Add the options of every installed driver to the section of its kind of device.

    Where the driver is that of a profile, the options must be those of one that is installed.
    No option is required: a profile may give it.
    """
    for group, section in SECTIONS.items():
        drivers = [each.name for each in list_drivers() if each.group == group and not each.problem]
        names = {driver: f"{section} options of {driver}" for driver in drivers}
        for driver, name in names.items():
            definitions[name] = _options(options_of(group, driver), driver)
        named, options = "driver", "options"
        if group == WORLDS:
            named, options = "world", "world_options"
        content = definitions[section]
        free = content["properties"][options]
        content["properties"][options] = {
            "anyOf": [_reference(name) for name in names.values()],
            "description": free["description"],
        }
        content["allOf"] = [
            {
                "if": {"properties": {named: {"const": driver}}, "required": [named]},
                "then": {"properties": {options: _reference(name)}},
            }
            for driver, name in names.items()
        ]


def _reference(name: str) -> _Schema:
    return {"$ref": f"#/$defs/{name}"}


def _options(declared: Any, driver: str) -> _Schema:
    """The options of a driver or world, none of which is required."""
    schema: _Schema = _tidy(schema_of(declared))
    schema.pop("required", None)
    _write_words(schema, declared)
    for key in keys(declared):
        schema["properties"][key.name]["description"] += f"; {key.expected}"
    return schema | {"description": f"Options of the driver {driver}."}


def _write_words(schema: _Schema, kind: Kind) -> None:
    """Put the meaning of every key into a schema, and its default as a plan would write it."""
    for key in keys(kind):
        found = schema["properties"][key.name]
        if key.meaning:
            found["description"] = key.meaning
        if key.default_text is not None:
            found["default"] = key.default_text
