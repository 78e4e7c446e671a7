"""Sections as far as they are known, so that a bad value hides nothing that does not need it.

A draft stands in for a section while a plan is read: checks and derived values are written for the
section itself (`procedure.top_force_n`) and are run on its draft.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeVar

from stepload.plan.sections import Kind, entries

T = TypeVar("T")


class UnknownError(AttributeError):
    """A value was read that the plan leaves out, or that is bad."""


class Draft:
    """A section of which only the good values are known; to ask for others is an `UnknownError`."""

    def __init__(self, kind: Kind) -> None:
        self._kind = kind
        self._known: dict[str, Any] = {}
        self._left_out: set[str] = set()

    def __getattr__(self, field: str) -> Any:
        try:
            return self.__dict__["_known"][field]
        except KeyError:
            raise UnknownError(field) from None


def _draft(section: object) -> Draft:
    assert isinstance(section, Draft)
    return section


def kind_of(section: object) -> Kind:
    """The kind of section that `section` is, or is a draft of."""
    return section._kind if isinstance(section, Draft) else type(section)


def put(section: object, field: str, value: object) -> None:
    """Make a value of a draft known, or another one."""
    _draft(section)._known[field] = value


def leave_out(section: object, field: str) -> None:
    """Note in a draft that the plan does not give a value that follows from others."""
    _draft(section)._left_out.add(field)


def left_out(section: object) -> list[str]:
    """Fields of a draft that the plan does not give and that are not known yet."""
    draft = _draft(section)
    return sorted(draft._left_out - draft._known.keys())


def written(section: object, field: str) -> Any:
    """The value of a draft as the plan gives it; None where it leaves it out.

    Raises:
        UnknownError: it is bad.
    """
    return None if field in _draft(section)._left_out else getattr(section, field)


def drafts_in(section: object) -> Iterator[tuple[str, object]]:
    """The drafts of sections right below a draft, each with the name of its key."""
    draft = _draft(section)
    for entry in entries(draft._kind):
        if isinstance(inner := draft._known.get(entry.field), Draft):
            yield entry.name, inner


def whole(section: T) -> T:
    """The section that a draft has become, all drafts in it made sections too.

    Raises:
        UnknownError: a value is not known.
        ArithmeticError: the values make no section.
    """
    if not isinstance(section, Draft):
        return section
    for entry in entries(section._kind):
        if entry.kept:
            getattr(section, entry.field)
    made: T = section._kind(**{field: whole(value) for field, value in section._known.items()})
    return made
