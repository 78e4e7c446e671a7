"""Reads a tree of nodes into sections by pydantic: every problem with its place, all at once.

What contradicts itself within a section is found where each of its keys is good.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from stepload.declaration.quantities import REFUSED, WRITTEN, shown
from stepload.declaration.sections import Key, Kind, adapter, keys, schema_of
from stepload.declaration.sections import expected as words_for
from stepload.errors import BadInputError, guess, printable
from stepload.plan.problems import PlanError, Problem
from stepload.plan.source import Source
from stepload.plan.tree import Broken, Mapping, Node, Place, Scalar, Sequence, locate, parse_tree

T = TypeVar("T")
SHAPE = "shape"
"""The key that tells sections of one place apart."""


def read_file(kind: Callable[..., T], source: Source) -> T:
    """The one section that `source` holds, in which null stands for what is not known.

    Raises:
        PlanError: every problem with its place.
    """
    root, problems = parse_tree(source)
    section = read_section(kind, root, Place(source, 1, 1), problems, null=True)
    if problems or section is None:
        raise PlanError(tuple(problems))
    return section


def read_section(
    kind: Callable[..., T], node: Node, at: Place, problems: list[Problem], *, null: bool = False
) -> T | None:
    """The section in `node`; None where it is bad, and what is wrong is added to `problems`.

    Args:
        at: where a missing key is reported.
        null: whether null may be written.
    """
    section, errors = validated(kind, node, problems, null=null)
    for error in errors:
        problems += in_words(kind, node, at, error)
    return section


def validated(
    kind: Callable[..., T], node: Node, problems: list[Problem], *, null: bool = False
) -> tuple[T | None, list[ErrorDetails]]:
    """The section in `node`, and what pydantic says against it."""
    section_kind: Any = kind
    data = _plain(node, (section_kind,), problems, null)
    try:
        return adapter(section_kind).validate_python(
            data, context=WRITTEN, by_alias=True, by_name=False
        ), []
    except ValidationError as error:
        return None, error.errors(include_url=False)


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


def in_words(kind: Any, root: Node, at: Place, error: ErrorDetails) -> Iterator[Problem]:
    """An error of pydantic in our words, at its place; none where it is reported already."""
    loc, told, value = error["loc"], error["type"], error["input"]
    node, place, section, key = _walk(kind, root, at, loc)
    name = str(loc[-1]) if loc else ""
    if isinstance(value, _Bad) or isinstance(node, Broken):
        return
    if told == REFUSED and "found" in error["ctx"]:
        for at_key, message, hint in error["ctx"]["found"]:
            yield locate(node, [at_key], place).problem(message, hint)
    elif told == "missing":
        yield place.problem(f"missing key {name!r}", expected(key) if key else "")
    elif told == "unexpected_keyword_argument":
        yield unknown_key(place, name, [each.name for each in keys(section)])
    elif isinstance(node, Mapping) and isinstance(node.entries.get(SHAPE), Broken):
        return
    elif key and key.shaped and told in (*_OF_UNIONS, *_NOT_A_MAPPING):
        yield _of_shape(node, place, tuple(map(_shape, key.sections)))
    elif told in _NOT_A_MAPPING:
        below = [each for of in (key.sections if key else (kind,)) for each in keys(of)]
        needed = ", ".join(f"{each.name}: …" for each in below if each.required)
        hint = f"write {{{needed}}}; " if needed else ""
        hint += f"keys: {', '.join(each.name for each in below)}" if below else ""
        yield node.place.problem(f"{_shown(node)} where a mapping belongs", hint)
    elif told in _NOT_A_LIST:
        hint = expected(key) if key else ""
        yield node.place.problem(f"{_shown(node)} where a list belongs", hint)
    elif isinstance(node, Sequence) and key and not key.expected.startswith("a list"):
        yield node.place.problem("a list where one value belongs", expected(key))
    else:
        yield _of_value(node, place, key, error)


def _of_value(node: Node, place: Place, key: Key | None, error: ErrorDetails) -> Problem:
    loc, told = error["loc"], error["type"]
    item = isinstance(loc[-1], int)
    may = (key.each_expected if item else key.expected) if key else ""
    message, hint = _words(error, may)
    unquoted = told == "string_type" or "is not a text" in message
    if unquoted and isinstance(node, Scalar) and node.value is not None:
        message = f"{printable(node.text)} is not a text"
        hint += f'; put it in quotes: "{printable(node.text)}"'
    if isinstance(node, Mapping) and key and key.sections:  # of the section as a whole
        return place.problem(message, hint)
    called = f"{key.name}[{loc[-1]}]" if item and key else str(loc[-1])
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
    return str(kind.__pydantic_fields__[SHAPE].annotation.__args__[0])


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
