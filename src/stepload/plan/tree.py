"""YAML 1.2 text as a tree of nodes that know their place; a small, inert part of YAML.

Plain data only: no anchors, aliases, merge keys, tags or directives; one document; `no` is a text
and `1:30` is a text, as YAML 1.2 has it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml import events as ev
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from stepload.errors import printable
from stepload.plan.problems import PlanError, Problem
from stepload.plan.source import Source
from stepload.plan.yaml_words import mistake

MAX_DEPTH = 16
MAX_NODES = 20_000


@dataclass(frozen=True, slots=True)
class Place:
    """Line and column (from 1) in a file."""

    source: Source
    line: int
    column: int

    def problem(self, message: str, hint: str = "") -> Problem:
        return self.source.problem(self.line, self.column, message, hint)


@dataclass(frozen=True, slots=True)
class Scalar:
    """A single value: None, bool, int, float or str by the YAML 1.2 core schema.

    `text` is what is written.
    """

    place: Place
    value: bool | int | float | str | None
    text: str = ""


@dataclass(frozen=True, slots=True)
class Sequence:
    """A list."""

    place: Place
    items: list[Node] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Mapping:
    """Keys to nodes in the order written; `keys` are the places of the keys themselves."""

    place: Place
    entries: dict[str, Node] = field(default_factory=dict)
    keys: dict[str, Place] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Broken:
    """A node whose problem is reported already."""

    place: Place


Node = Scalar | Sequence | Mapping | Broken

_NULL = frozenset(["", "~", "null", "Null", "NULL"])
_BOOL = {
    "true": True, "True": True, "TRUE": True,
    "false": False, "False": False, "FALSE": False,
}  # fmt: skip
_INTEGER = re.compile(r"[-+]?[0-9]{1,40}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_SPECIAL = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")


def resolve(text: str) -> bool | int | float | str | None:
    """What a plain (unquoted) scalar means in YAML 1.2; octal and hex stay text."""
    if text in _NULL:
        return None
    if text in _BOOL:
        return _BOOL[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _SPECIAL.fullmatch(text):
        return float(text.replace(".", "").lower())
    return text


class _StopError(Exception):
    """The text is not worth reading on."""


class _Builder:
    def __init__(self, source: Source) -> None:
        self.source = source
        self.problems: list[Problem] = []
        self.nodes = 0

    def place(self, mark: object) -> Place:
        line, column = getattr(mark, "line", 0), getattr(mark, "column", 0)
        return Place(self.source, line + 1, column + 1)

    def refuse(self, event: ev.Event, message: str, hint: str) -> None:
        self.problems.append(self.place(event.start_mark).problem(message, hint))

    def document(self, events: Iterator[ev.Event]) -> Node | None:
        root: Node | None = None
        for event in events:
            if isinstance(event, ev.DocumentStartEvent):
                if root is not None:
                    self.refuse(event, "a second document", "one plan per file: remove the `---`")
                    raise _StopError
                if event.version not in (None, (1, 2)) or event.tags:
                    self.refuse(event, "a YAML directive", "plans are YAML 1.2 without directives")
            elif isinstance(event, ev.NodeEvent):
                root = self.node(event, events, 1)
        return root

    def node(self, event: Any, events: Iterator[ev.Event], depth: int) -> Node:
        self.nodes += 1
        place = self.place(event.start_mark)
        if depth > MAX_DEPTH:
            self.refuse(event, f"nested deeper than {MAX_DEPTH} levels", "plans are flat")
            raise _StopError
        if self.nodes > MAX_NODES:
            self.refuse(event, f"more than {MAX_NODES} values", "is this the right file?")
            raise _StopError
        if isinstance(event, ev.AliasEvent):
            self.refuse(event, f"alias *{printable(event.anchor)}", _NO_ALIAS)
            return Broken(place)
        if event.anchor is not None:
            self.refuse(event, f"anchor &{printable(event.anchor)}", _NO_ALIAS)
        if event.tag is not None:
            self.refuse(
                event, f"tag {printable(str(event.tag))}", "plans are plain data: remove the tag"
            )
        if isinstance(event, ev.MappingStartEvent):
            return self.mapping(place, events, depth)
        if isinstance(event, ev.SequenceStartEvent):
            items: list[Node] = []
            while not isinstance(item := next(events), ev.SequenceEndEvent):
                items.append(self.node(item, events, depth + 1))
            return Sequence(place, items)
        if bad := next((c for c in event.value if "\ud800" <= c <= "\udfff"), None):
            self.refuse(event, f"U+{ord(bad):04X} is no character", "remove it")
            return Broken(place)
        value = resolve(event.value) if event.style is None else event.value
        return Scalar(place, value, event.value)

    def mapping(self, place: Place, events: Iterator[ev.Event], depth: int) -> Mapping:
        mapping = Mapping(place)
        while not isinstance(event := next(events), ev.MappingEndEvent):
            key = event.value if isinstance(event, ev.ScalarEvent) else None
            key_place = self.place(event.start_mark)
            self.node(event, events, depth + 1)
            value = self.node(next(events), events, depth + 1)
            if problem := _bad_key(mapping, key, key_place):
                self.problems.append(problem)
            elif isinstance(key, str):
                mapping.entries[key] = _behind(key, key_place, value)
                mapping.keys[key] = key_place
        return mapping


def _bad_key(mapping: Mapping, key: str | None, place: Place) -> Problem | None:
    if key is None or not key.isprintable():
        return place.problem("a key that is not a word", "write key: value")
    if key == "<<":
        return place.problem("merge key <<", _NO_ALIAS)
    if key in mapping.entries:
        return place.problem(
            f"duplicate key {printable(key)!r}",
            f"it is given already in line {mapping.keys[key].line}; keep one of the two",
        )
    return None


def _behind(key: str, place: Place, value: Node) -> Node:
    """`value`; where nothing is written, YAML puts it in a later line: put it behind its key."""
    if isinstance(value, Scalar) and value.value is None and value.place.line > place.line:
        return Scalar(Place(place.source, place.line, place.column + len(key) + 1), None)
    return value


_NO_ALIAS = "plans have no anchors, aliases or merge keys: write the value where it is used"


def parse_tree(source: Source) -> tuple[Node, list[Problem]]:
    """The tree of `source` and the problems that leave a tree (duplicate keys, tags, aliases).

    The tree may be another caller's too: lay keys over a copy of a mapping, never into it.

    Raises:
        PlanError: not YAML, empty, more than one document, too deep or too large.
    """
    root, problems = _parsed(source)
    return root, [*problems]


@lru_cache(maxsize=16)
def _parsed(source: Source) -> tuple[Node, tuple[Problem, ...]]:
    """The same, cached by text: hundreds of plans may name one profile (`design`, `campaign`)."""
    builder = _Builder(source)
    if "\0" in source.text:
        at = source.text.index("\0")
        raise PlanError((source.problem_at(at, "a NUL character", "plans are text"),))
    try:
        root = builder.document(iter(YAML(typ="safe", pure=True).parse(source.text)))
    except _StopError:
        raise PlanError(tuple(builder.problems)) from None
    except (YAMLError, ValueError, IndexError, AttributeError, TypeError, AssertionError) as error:
        raise PlanError((*builder.problems, _syntax(source, error))) from None
    if root is None:
        raise PlanError((source.problem(1, 1, "the file is empty", "see docs/plan.md"),))
    return root, tuple(builder.problems)


def _syntax(source: Source, error: Exception) -> Problem:
    """What the YAML parser complains about, in our words where we know better."""
    mark = None
    if isinstance(error, MarkedYAMLError):
        mark = error.problem_mark or error.context_mark
    text = str(getattr(error, "problem", "") or "cannot be read as YAML")
    if mark is None:
        position = getattr(error, "position", None)
        if isinstance(position, int):
            code = ord(source.text[position]) if position < len(source.text) else 0
            message = f"character U+{code:04X} is not allowed in YAML"
            return source.problem_at(position, message, "remove it")
        return source.problem(1, 1, printable(text, 200), "check the file with a YAML editor")
    line, column = mark.line + 1, mark.column + 1
    shown = source.lines[line - 1] if line <= len(source.lines) else ""
    if "\t" in shown[:column]:
        column = shown.index("\t") + 1
        return source.problem(line, column, "a tab", "indent with spaces; YAML allows no tabs here")
    hint = str(getattr(error, "context", "") or "")
    if found := mistake(text, hint, mark, getattr(error, "context_mark", None)):
        line, column = found.mark.line + 1, found.mark.column + 1
        return source.problem(line, column, found.message, found.hint)
    return source.problem(line, column, f"not YAML: {printable(text, 200)}", printable(hint, 200))
