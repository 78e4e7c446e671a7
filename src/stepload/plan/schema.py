"""JSON Schema of a plan file, from the declarations of its sections."""

from __future__ import annotations

import inspect
from typing import Any

from stepload.plan.driver_schema import add_options
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

_Schema = dict[str, Any]


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
    add_options(definitions)
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
