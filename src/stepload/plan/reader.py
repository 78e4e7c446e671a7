"""Reads a position tree into drafts of sections: every key by itself, every problem kept."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any, TypeVar, cast

from stepload.plan.draft import Draft, UnknownError, kind_of, leave_out, put, whole, written
from stepload.plan.leaves import Leaf, LeafError, Relative, Sigma, Stated
from stepload.plan.problems import PlanError, Problem, guess, printable
from stepload.plan.sections import (
    SHAPE,
    Each,
    Entry,
    Nested,
    OneOf,
    Options,
    entries,
    written_entries,
)
from stepload.plan.source import Source
from stepload.plan.tree import Broken, Mapping, Node, Place, Scalar, Sequence, parse_tree

T = TypeVar("T")


def read_file(
    kind: Callable[..., T], source: Source, impossible: Callable[[Source, T], Iterable[Problem]]
) -> T:
    """The one section that `source` holds.

    Args:
        impossible: what is wrong with its values together.

    Raises:
        PlanError: every problem with its place.
    """
    root, problems = parse_tree(source)
    section = read_section(kind, root, Place(source, 1, 1), problems)
    with suppress(UnknownError):
        problems += impossible(source, section)
    if problems:
        raise PlanError(tuple(problems))
    return whole(section)


def read_section(
    kind: Callable[..., T], node: Node, at: Place, problems: list[Problem], *, shaped: bool = False
) -> T:
    """The draft of the section in `node`; what is wrong with it is added to `problems`.

    Args:
        at: where a missing key is reported.
        shaped: whether the mapping also holds the key that names its shape.
    """
    draft = cast(T, Draft(kind))
    known = [SHAPE] * shaped + [entry.name for entry in written_entries(kind)]
    if isinstance(node, Mapping):
        for key, place in node.keys.items():
            if key not in known:
                problems.append(unknown_key(place, key, known))
        _read_entries(draft, node, at, problems)
    elif not isinstance(node, Broken):
        needed = [f"{each.name}: …" for each in written_entries(kind) if each.required]
        hint = f"write {{{', '.join(needed)}}}; " if needed else ""
        message = f"{_shown(node)} where a mapping belongs"
        problems.append(node.place.problem(message, f"{hint}keys: {', '.join(known)}"))
    return draft


def unknown_key(place: Place, key: str, known: list[str]) -> Problem:
    """The problem of a key that means nothing here, with the nearest one that does."""
    hint = guess(key, known).rstrip() or f"known keys: {', '.join(known) or 'none'}"
    return place.problem(f"unknown key {printable(key)!r}", hint)


def _read_entries(draft: object, node: Mapping, at: Place, problems: list[Problem]) -> None:
    for entry in entries(kind_of(draft)):
        nested = entry.content.kind if isinstance(entry.content, Nested) else None
        if nested and entry.key.inline:
            inner = Draft(nested)
            _read_entries(inner, node, at, problems)
            put(draft, entry.field, inner)
        elif entry.name in node.entries:
            with suppress(UnknownError):
                _read_entry(draft, entry, node.entries[entry.name], node.keys[entry.name], problems)
        elif nested and entry.key.derived:
            put(draft, entry.field, read_section(nested, Mapping(at), at, problems))
        elif entry.key.derived:
            leave_out(draft, entry.field)
        elif entry.required:
            problems.append(at.problem(f"missing key {entry.name!r}", expected(entry)))
        elif entry.kept:
            _keep(draft, entry, entry.default)


def _read_entry(
    draft: object, entry: Entry, node: Node, at: Place, problems: list[Problem]
) -> None:
    null = isinstance(node, Scalar) and node.value is None
    if null and not entry.key.null and not entry.required:
        message = f"nothing stands behind `{entry.name}`"
        raise _refused(problems, node, message, "write a value, or leave the key out")
    value = None if null and entry.key.null else _value(entry, node, at, problems)
    if isinstance(value, Relative) and isinstance(entry.leaf, Sigma):
        whole = written(draft, entry.leaf.of)
        if whole is None:
            message = f"`{entry.name}` is a share of a value that is not stated"
            raise _refused(problems, node, message, expected(entry))
        value = value * whole
    if entry.kept:
        _keep(draft, entry, value)


def _keep(draft: object, entry: Entry, value: Any) -> None:
    """Store a value in a draft, with its standard uncertainty and its range where it has them."""
    stated = value if isinstance(value, Stated) else Stated(value, None)
    if entry.sigma_field:
        put(draft, entry.sigma_field, stated.sigma)
    if entry.ends_field:
        put(draft, entry.ends_field, stated.ends)
    put(draft, entry.field, stated.value)


def _value(entry: Entry, node: Node, at: Place, problems: list[Problem]) -> Any:
    """The value of an entry, `at` the place of its key; raises UnknownError where it is bad."""
    content = entry.content
    if isinstance(node, Broken):
        raise UnknownError
    if isinstance(content, Nested):
        return read_section(content.kind, node, at, problems)
    if isinstance(content, OneOf):
        return _shaped(content, node, at, problems)
    if isinstance(content, Options):
        if not isinstance(node, Mapping):
            raise _refused(problems, node, f"{_shown(node)} where a mapping belongs")
        return node
    if isinstance(content, Each):
        if not isinstance(node, Sequence):
            message = f"{_shown(node)} where a list belongs"
            raise _refused(problems, node, message, expected(entry))
        return _list(entry.name, content.leaf, node, problems)
    if isinstance(node, Sequence):
        raise _refused(problems, node, "a list where one value belongs", expected(entry))
    return _leaf(entry.name, content, node, problems)


def _shaped(content: OneOf, node: Node, at: Place, problems: list[Problem]) -> object:
    kinds = {kind.__name__: kind for kind in content.kinds}
    hint = "shapes: " + ", ".join(kinds)
    if not isinstance(node, Mapping):
        raise _refused(problems, node, f"{_shown(node)} where a mapping belongs", hint)
    tag = node.entries.get(SHAPE)
    if tag is None:
        problems.append(at.problem(f"missing key {SHAPE!r}", hint))
        raise UnknownError
    if isinstance(tag, Broken):
        raise UnknownError
    shape = tag.value if isinstance(tag, Scalar) else None
    if shape not in kinds:
        hint = guess(str(shape or ""), kinds) + hint
        raise _refused(problems, tag, f"{_shown(tag)} is not a shape", hint)
    return read_section(kinds[str(shape)], node, at, problems, shaped=True)


def _list(name: str, leaf: Leaf, node: Sequence, problems: list[Problem]) -> tuple[object, ...]:
    items = []
    for index, item in enumerate(node.items):
        with suppress(UnknownError):
            items.append(_leaf(f"{name}[{index}]", leaf, item, problems))
    if len(items) < len(node.items):
        raise UnknownError
    return tuple(items)


def _leaf(name: str, leaf: Leaf, node: Node, problems: list[Problem]) -> object:
    if isinstance(node, Broken):
        raise UnknownError
    value: Any = node.value if isinstance(node, Scalar) else {} if isinstance(node, Mapping) else []
    try:
        return leaf.read(value)
    except LeafError as error:
        message, hint = f"{name}: {error.message}", error.hint
        if error.quoted and isinstance(node, Scalar):
            message = f"{name}: {printable(node.text)} is not a text"
            hint += f'; put it in quotes: "{printable(node.text)}"'
        raise _refused(problems, node, message, hint) from None


def _refused(problems: list[Problem], node: Node, message: str, hint: str = "") -> UnknownError:
    problems.append(node.place.problem(message, hint))
    return UnknownError()


def expected(entry: Entry) -> str:
    """What a key means and what may be written there."""
    meaning = entry.key.meaning
    return f"{meaning} Expected {entry.leaf.expected()}" if entry.leaf else meaning


def _shown(node: Node) -> str:
    if isinstance(node, Scalar):
        return "nothing" if node.value is None else repr(printable(str(node.value)))
    return "a list" if isinstance(node, Sequence) else "a mapping"
