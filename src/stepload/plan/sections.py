"""Sections of a plan: a class, or a function, whose fields say which keys may be written.

A field is a key where its annotation holds a `Key`. What may be written there is in the annotation
too: a leaf (`stepload.plan.leaves`), a list of leaves, or another section. The reader, the JSON
Schema and the tables of docs/plan.md all follow from this one declaration::

    hold_s: Annotated[Duration, Key("How long each level is held.")] = 3.0

is the key `hold`, a time, 3 s where it is left out. The key is the name of the field without its
unit. A field without default is required. A key with nothing behind it is an error, also where it
may be left out. A class variable is a key that is checked and not kept. A function stands for a
class of another room that it makes. Behind an uncertain value ± may be written; its standard
uncertainty is put into a field of its own, `yield_strength_sigma_pa` beside `yield_strength_pa`;
the ends of a range into `…_ends_pa`.
"""

from __future__ import annotations

import inspect
import math
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass, is_dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Union, cast, get_args, get_origin, get_type_hints

from stepload.plan.leaves import Leaf, Quantity, Uncertain
from stepload.units import format_quantity

Kind = Callable[..., Any]
"""A section class, or a function that makes the object of a section."""

SHAPE = "shape"
"""The key that names which of several sections stands in a mapping."""

REQUIRED = inspect.Parameter.empty
"""The default of a field that has none."""


@dataclass(frozen=True, slots=True)
class Key:
    """Makes a field a key of its section.

    Attributes:
        meaning: what it is, for the reference and for errors.
        name: how it is written, where that is not the name of the field without its unit.
        derived: it may be left out although its field has no default: it follows from other keys.
        inline: the field is a section whose keys stand among those of the section around it.
        null: null may be written and says that it is not known, as in records that stepload writes.
    """

    meaning: str = ""
    name: str = ""
    derived: bool = False
    inline: bool = False
    null: bool = False


@dataclass(frozen=True, slots=True)
class Each:
    """A list, every item of which is one leaf."""

    leaf: Leaf


@dataclass(frozen=True, slots=True)
class Nested:
    """A mapping with the keys of one section."""

    kind: Kind


@dataclass(frozen=True, slots=True)
class OneOf:
    """A mapping with the keys of one of several sections; the key `SHAPE` names which."""

    kinds: tuple[Kind, ...]


@dataclass(frozen=True, slots=True)
class Options:
    """A mapping with keys that only a driver knows."""


Content = Leaf | Each | Nested | OneOf | Options


@dataclass(frozen=True, slots=True)
class Entry:
    """One key of a section: its name, the field it becomes and what may be written there.

    `kept` says whether there is such a field; a class variable is only checked. `sigma_field` takes
    the standard uncertainty of an uncertain value, `ends_field` the ends of a range; "" where none
    may be written.
    """

    name: str
    field: str
    key: Key
    content: Content
    default: object
    kept: bool
    sigma_field: str = ""
    ends_field: str = ""

    @property
    def leaf(self) -> Leaf | None:
        """The leaf that stands here, alone or in a list."""
        return _leaf(self.content)

    @property
    def required(self) -> bool:
        return self.default is REQUIRED and not self.key.derived

    @property
    def default_text(self) -> str | bool | int | float | None:
        """The default as a plan would write it; None where there is none to write."""
        if isinstance(self.leaf, Quantity) and isinstance(self.default, float):
            if self.leaf.unit == "rad":
                return f"{math.degrees(self.default):g} deg"
            return format_quantity(self.default, self.leaf.unit, digits=6)
        if isinstance(self.default, Path):
            return str(self.default)
        return self.default if isinstance(self.default, (str, bool, int, float)) else None


@cache
def entries(kind: Kind) -> tuple[Entry, ...]:
    """The keys of a section in the order of their declaration.

    Raises:
        TypeError: the name of a field does not end in the unit of its quantity, its annotation
            does not say what may be written, or there is no field for its uncertainty.
    """
    parameters = inspect.signature(kind).parameters
    found = []
    for field, hint in get_type_hints(kind, include_extras=True).items():
        annotation = get_args(hint)[0] if get_origin(hint) is ClassVar else hint
        notes = getattr(annotation, "__metadata__", ())
        if key := next((note for note in notes if isinstance(note, Key)), None):
            content = _content(annotation)
            name = _without_unit(field, content)
            kept = field in parameters
            default = parameters[field].default if kept else getattr(kind, field, REQUIRED)
            sigma, ends = _fields_beside(field, content)
            if missing := {sigma, ends} - {"", *parameters}:
                raise TypeError(f"{field} is uncertain: there must be a field {min(missing)}")
            found.append(Entry(key.name or name, field, key, content, default, kept, sigma, ends))
    return tuple(found)


def _content(annotation: Any) -> Content:
    """What may be written where a field has this annotation."""
    notes = getattr(annotation, "__metadata__", ())
    if content := next((note for note in notes if isinstance(note, Content)), None):
        return content
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _content(arguments[0])
    if origin in (Union, types.UnionType):
        return _content(next(a for a in arguments if a is not types.NoneType))
    if origin is tuple:
        item = _content(arguments[0])
        assert isinstance(item, Leaf)
        return Each(item)
    if not is_dataclass(annotation):
        raise TypeError(f"{annotation} does not say what may be written")
    return Nested(cast(Kind, annotation))


def _leaf(content: Content) -> Leaf | None:
    item = content.leaf if isinstance(content, Each) else content
    return item if isinstance(item, Leaf) else None


def _fields_beside(field: str, content: Content) -> tuple[str, str]:
    """The fields of an uncertain value's standard uncertainty and range; "" where it has none."""
    if not isinstance(content, Uncertain):
        return "", ""
    suffix = content.leaf.suffix if isinstance(content.leaf, Quantity) else ""
    name = field.removesuffix(suffix)
    return f"{name}_sigma{suffix}", f"{name}_ends{suffix}" if content.spread else ""


def _without_unit(field: str, content: Content) -> str:
    leaf = _leaf(content)
    if isinstance(leaf, Uncertain):
        leaf = leaf.leaf
    if not isinstance(leaf, Quantity):
        return field
    if not field.endswith(leaf.suffix):
        raise TypeError(f"{field} is in {leaf.unit}: its name must end in {leaf.suffix!r}")
    return field.removesuffix(leaf.suffix)


def written_entries(kind: Kind) -> Iterator[Entry]:
    """The keys of a section as they are written: those of inline sections among them."""
    for entry in entries(kind):
        if entry.key.inline:
            yield from written_entries(nested_kinds(entry)[0])
        else:
            yield entry


def nested_kinds(entry: Entry) -> tuple[Kind, ...]:
    """The sections that may stand at a key."""
    match entry.content:
        case Nested(kind):
            return (kind,)
        case OneOf(kinds):
            return kinds
    return ()


def sections_below(kind: Kind) -> tuple[Kind, ...]:
    """`kind` and every section in it, depth first, each once."""
    seen: dict[Kind, None] = {}

    def visit(found: Kind) -> None:
        if found not in seen:
            seen[found] = None
            for entry in written_entries(found):
                for inner in nested_kinds(entry):
                    visit(inner)

    visit(kind)
    return tuple(seen)
