"""Plain YAML as a flat list of keys, each with its text and where that comes from."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from stepload.plan.source import Source
from stepload.plan.tree import Mapping as Tree
from stepload.plan.tree import Node, Scalar, Sequence, parse_tree


class Value(NamedTuple):
    """One value as it stands in a file, and where it comes from."""

    text: str
    origin: str


def flat(source: Source, origin: str) -> dict[str, Value]:
    """Every value of a file by its dotted key; a comment behind it is added to `origin`."""
    root, _ = parse_tree(source)
    return {
        key: Value(text, f"{origin}: {note}" if note else origin)
        for key, text, note in _values(root, "")
    }


def below(found: Mapping[str, Value], key: str) -> dict[str, Value]:
    """The values below `key`, by the rest of their keys."""
    start = f"{key}."
    return {name[len(start) :]: value for name, value in found.items() if name.startswith(start)}


def _values(node: Node, key: str) -> Iterator[tuple[str, str, str]]:
    if isinstance(node, Tree):
        for name, inner in node.entries.items():
            yield from _values(inner, f"{key}.{name}" if key else name)
    elif isinstance(node, (Scalar, Sequence)):
        line = node.place.source.lines[node.place.line - 1]
        _, _, note = line[node.place.column - 1 :].partition(" #")
        yield key, as_text(node), note.strip()


def as_text(node: Node) -> str:
    """A value in one line of YAML; a text keeps its quotes where it needs them."""
    if isinstance(node, Sequence):
        return f"[{', '.join(as_text(item) for item in node.items)}]"
    value = node.value if isinstance(node, Scalar) else None
    return quoted(value) if isinstance(value, str) else json.dumps(value)


def quoted(text: str) -> str:
    """A text as YAML reads it back: in quotes where it could be something else."""
    plain = text[:1].isalnum() and not any(c in text for c in ':#"\n[]{},&*!|>%@`')
    plain = plain and text.isprintable() and text == text.strip()
    if plain and text.lower() not in ("true", "false", "null") and not _number(text):
        return text
    return json.dumps(text, ensure_ascii=False)


def _number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def written(
    values: Mapping[str, Value], head: tuple[str, ...] = (), notes: Mapping[str, str] | None = None
) -> str:
    """YAML of dotted keys in the order of their first parts, each with its origin as a comment.

    `notes` say what keys mean, by dotted key; each stands above its key.
    """
    rows = [f"# {line}".rstrip() for line in head]
    rows += _rows(values, 0, notes or {})
    return "\n".join(rows) + "\n"


def _rows(values: Mapping[str, Value], depth: int, notes: Mapping[str, str]) -> list[str]:
    rows = []
    for name in dict.fromkeys(key.partition(".")[0] for key in values):
        indent = "  " * depth
        if name in notes:
            rows.append(f"{indent}# {notes[name]}")
        if (value := values.get(name)) is not None:
            note = f" # {value.origin}" if value.origin else ""
            rows.append(f"{indent}{name}: {value.text}{note}")
        else:
            inner = {
                key.partition(".")[2]: n for key, n in notes.items() if key.startswith(f"{name}.")
            }
            rows += [f"{indent}{name}:", *_rows(below(values, name), depth + 1, inner)]
    return rows
