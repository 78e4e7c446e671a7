"""Keys of a plan by their last word, for a user who met one in a message."""

from __future__ import annotations

from collections.abc import Iterator

from stepload.explain.model import Explanation
from stepload.plan.model import Plan
from stepload.plan.sections import Entry, Kind, nested_kinds, written_entries

KEY = "key"
"""Group name of keys, which are no codes."""


def keys_called(name: str) -> tuple[Explanation, ...]:
    """Every key of a plan with this name, with all places where it may stand."""
    places: dict[str, tuple[Entry, list[str]]] = {}
    for path, entry in _below(Plan, ""):
        if entry.name == name:
            places.setdefault(entry.key.meaning, (entry, []))[1].append(path)
    return tuple(
        Explanation(
            KEY, name, f"{', '.join(dict.fromkeys(paths))}: {meaning}",
            f"Write {entry.leaf.expected() if entry.leaf else 'a mapping'}.", "plan.md",
        )
        for meaning, (entry, paths) in places.items()
    )  # fmt: skip


def _below(kind: Kind, path: str) -> Iterator[tuple[str, Entry]]:
    for entry in written_entries(kind):
        here = f"{path}{entry.name}"
        yield here, entry
        for inner in nested_kinds(entry):
            yield from _below(inner, f"{here}.")
