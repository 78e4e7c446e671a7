"""Reads a tree of nodes into sections by pydantic: every problem with its place, all at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from stepload.declaration.quantities import REFUSED, WRITTEN, Relative, shown
from stepload.declaration.sections import (
    UNKNOWN,
    Key,
    Kind,
    UnknownError,
    adapter,
    fields_of,
    keys,
    schema_of,
)
from stepload.declaration.sections import expected as words_for
from stepload.errors import BadInputError, guess, printable
from stepload.plan.problems import PlanError, Problem
from stepload.plan.source import Source
from stepload.plan.tree import Broken, Mapping, Node, Place, Scalar, Sequence, parse_tree

T = TypeVar("T")
SHAPE = "shape"
"""The key that tells sections of one place apart."""


def read_file(
    kind: Callable[..., T], source: Source, impossible: Callable[[Source, T], Iterable[Problem]]
) -> T:
    """The one section that `source` holds, in which null stands for what is not known.

    Args:
        impossible: what is wrong with its values together.

    Raises:
        PlanError: every problem with its place.
    """
    root, problems = parse_tree(source)
    section = read_section(kind, root, Place(source, 1, 1), problems, null=True)
    with suppress(UnknownError):
        problems += impossible(source, section)
    if problems:
        raise PlanError(tuple(problems))
    return section


def read_section(
    kind: Callable[..., T], node: Node, at: Place, problems: list[Problem], *, null: bool = False
) -> T:
    """The section in `node`; what is wrong with it is added to `problems`.

    A value that is bad is `UNKNOWN` in what is returned.

    Args:
        at: where a missing key is reported.
        null: whether null may be written.
    """
    section_kind: Any = kind
    data = _plain(node, (section_kind,), problems, null)
    try:
        section: T = adapter(kind).validate_python(
            data, context=WRITTEN, by_alias=True, by_name=False
        )
    except ValidationError as error:
        found = (_problem(section_kind, node, at, each) for each in error.errors(include_url=False))
        problems += [problem for problem in found if problem]
        section = _partial(section_kind, data)
    return section


class _Bad:
    """Stands for a node that is reported already."""


_BAD = _Bad()


def _plain(node: Node, kinds: tuple[Kind, ...], problems: list[Problem], null: bool) -> Any:
    """A tree as plain data; null where a key may be left out is a problem."""
    if isinstance(node, Sequence):
        return [_plain(item, (), problems, null) for item in node.items]
    if not isinstance(node, Mapping):
        return node.value if isinstance(node, Scalar) else _BAD
    known, data = {key.name: key for kind in kinds for key in keys(kind)}, {}
    for name, inner in node.entries.items():
        key = known.get(name)
        nothing = isinstance(inner, Scalar) and inner.value is None
        if nothing and key and not key.required and not null:
            message = f"nothing stands behind `{name}`"
            problems.append(inner.place.problem(message, "write a value, or leave the key out"))
            data[name] = _BAD
        else:
            data[name] = _plain(inner, key.sections if key else (), problems, null)
    return data


def _partial(kind: Any, data: Any) -> Any:
    """A section of which only the good values are known."""
    made, written = object.__new__(kind), data if isinstance(data, dict) else {}
    by_field = {key.field: key for key in keys(kind)}
    for name, info in fields_of(kind).items():
        value = UNKNOWN
        if (key := by_field.get(name)) and key.name in written:
            value = _known(key, written[key.name])
        elif isinstance(data, dict) and not info.is_required():
            value = info.default_factory() if info.default_factory else info.default  # type: ignore[call-arg]
        if isinstance(value, Relative):  # a share of a value that may be bad
            value = UNKNOWN
        object.__setattr__(made, name, value)
    return made


def _known(key: Key, data: Any) -> Any:
    try:
        return adapter(key.hint).validate_python(
            data, context=WRITTEN, by_alias=True, by_name=False
        )
    except ValidationError:
        return _partial(key.sections[0], data) if key.is_section else UNKNOWN


def unknown_key(place: Place, key: str, known: list[str]) -> Problem:
    """The problem of a key that means nothing here, with the nearest one that does."""
    hint = guess(key, known).rstrip() or f"known keys: {', '.join(known) or 'none'}"
    return place.problem(f"unknown key {printable(key)!r}", hint)


def checked(hint: Any, text: str) -> Any:
    """A value that stands alone, read as a plan would read it where this hint stands.

    Raises:
        BadInputError: what is wrong and what may be written.
    """
    try:
        return adapter(hint).validate_python(text, context=WRITTEN)
    except ValidationError as error:
        may = words_for(schema_of(hint))
        message, told = _words(error.errors(include_url=False)[0], may)
        raise BadInputError(message, hint=told) from None


def expected(key: Key) -> str:
    """What a key means and what may be written there."""
    if not key.expected:
        return key.meaning
    then = " Expected" if key.meaning.endswith(".") else "; expected"
    return f"{key.meaning}{then} {key.expected}"


def _problem(kind: Kind, root: Node, at: Place, error: ErrorDetails) -> Problem | None:
    """An error of pydantic in our words, at its place; None where it is reported already."""
    loc, told, value = error["loc"], error["type"], error["input"]
    node, place, section, key = _walk(kind, root, at, loc)
    if isinstance(value, _Bad) or isinstance(node, Broken):
        return None
    name = str(loc[-1]) if loc else ""
    if told == "missing":
        return place.problem(f"missing key {name!r}", expected(key) if key else "")
    if told == "unexpected_keyword_argument":
        return unknown_key(place, name, [each.name for each in keys(section)])
    if isinstance(node, Mapping) and isinstance(node.entries.get(SHAPE), Broken):
        return None
    if key and key.shaped and told in (*_OF_UNIONS, *_NOT_A_MAPPING):
        return _of_shape(node, place, tuple(map(_shape, key.sections)))
    if told in _NOT_A_MAPPING:
        names = [each.name for kind_ in (key.sections if key else (kind,)) for each in keys(kind_)]
        kinds = key.sections if key else (kind,)
        needed = [f"{each.name}: …" for k in kinds for each in keys(k) if each.required]
        hint = f"write {{{', '.join(needed)}}}; " if needed else ""
        hint += f"keys: {', '.join(names)}" if names else ""
        return node.place.problem(f"{_shown(node)} where a mapping belongs", hint)
    if told in _NOT_A_LIST:
        hint = expected(key) if key else ""
        return node.place.problem(f"{_shown(node)} where a list belongs", hint)
    item = isinstance(loc[-1], int)
    if isinstance(node, Sequence) and key is not None and not key.expected.startswith("a list"):
        return node.place.problem("a list where one value belongs", expected(key))
    may = (key.each_expected if item else key.expected) if key else ""
    message, hint = _words(error, may)
    unquoted = told == "string_type" or "is not a text" in message
    if unquoted and isinstance(node, Scalar) and node.value is not None:
        message = f"{printable(node.text)} is not a text"
        hint += f'; put it in quotes: "{printable(node.text)}"'
    if isinstance(node, Mapping) and key and key.sections:  # of the section as a whole
        return place.problem(message, hint)
    called = f"{key.name}[{loc[-1]}]" if item and key else name
    return node.place.problem(f"{called}: {message}", hint)


_OF_UNIONS = ("union_tag_not_found", "union_tag_invalid")
_NOT_A_MAPPING = ("dataclass_type", "dataclass_exact_type", "mapping_type", "dict_type",
                  "model_attributes_type")  # fmt: skip
_NOT_A_LIST = ("tuple_type", "list_type")


def _walk(
    kind: Kind, root: Node, at: Place, loc: tuple[int | str, ...]
) -> tuple[Node, Place, Kind, Key | None]:
    """Node and place at a path of pydantic, the section it is in and its key there.

    Where nothing is written at its end, the node is that of the section around it, the place that
    of its key.
    """
    node, place, section, key = root, at, kind, None
    kinds: tuple[Kind, ...] = (kind,)
    for part in loc:
        if isinstance(part, int):
            if isinstance(node, Sequence):
                node = node.items[part]
            continue
        if len(kinds) > 1:  # the shape that was chosen
            kinds = tuple(k for k in kinds if _shape(k) == part) or kinds[:1]
            continue
        section = kinds[0] if kinds else section
        key = next((each for each in keys(section) if each.name == part), None)
        kinds = key.sections if key else ()
        if isinstance(node, Mapping) and part in node.entries:
            place = node.keys[part]
            node = node.entries[part]
    return node, place, section, key


def _shape(kind: Kind) -> str:
    return str(fields_of(kind)[SHAPE].annotation.__args__[0])  # type: ignore[union-attr]


def _of_shape(node: Node, place: Place, shapes: tuple[str, ...]) -> Problem:
    hint = "shapes: " + ", ".join(shapes)
    if not isinstance(node, Mapping):
        return node.place.problem(f"{_shown(node)} where a mapping belongs", hint)
    tag = node.entries.get(SHAPE)
    if tag is None:
        return place.problem(f"missing key {SHAPE!r}", hint)
    text = tag.value if isinstance(tag, Scalar) else ""
    return tag.place.problem(f"{_shown(tag)} is not a shape", guess(str(text), shapes) + hint)


def _words(error: ErrorDetails, may: str) -> tuple[str, str]:
    """What is wrong with one value, and what may be written instead."""
    told, value, context = error["type"], error["input"], error.get("ctx", {})
    if told == REFUSED:
        return context["message"], context["hint"]
    hint = f"expected {may}"
    match told:
        case "literal_error" if may.startswith("`"):
            return f"{shown(value)} is not accepted here", hint.replace("`", "")
        case "literal_error" | "enum":
            return f"{shown(value)} is not a choice here", hint
        case "bool_type":
            return f"{shown(value)} is neither true nor false", "write true or false"
        case "string_type":
            return f"{shown(value)} is not a text", hint
        case "string_too_short":
            return "an empty text", hint
        case "string_too_long":
            return f"a text of {len(value)} characters", hint
        case "greater_than" | "greater_than_equal" | "less_than" | "less_than_equal":
            return f"{value:.12g} is out of range", hint
        case "int_type" | "float_type" | "finite_number" | "int_from_float":
            noun = " ".join(may.split()[:3])
            return f"{shown(value)} is not {noun}", hint
    return error["msg"], hint


def _shown(node: Node) -> str:
    if isinstance(node, Scalar):
        return "nothing" if node.value is None else repr(printable(str(node.value)))
    return "a list" if isinstance(node, Sequence) else "a mapping"
