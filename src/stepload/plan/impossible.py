"""How a check reports values that contradict each other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from typing import Any, NamedTuple

from stepload.declaration.sections import UnknownError
from stepload.units import format_quantity


class Impossibility(NamedTuple):
    """Values that cannot be together; `path` is a chain of keys from the checked section down."""

    path: tuple[str, ...]
    message: str
    hint: str


Check = Callable[[Any], Iterator[Impossibility]]


def run_checks(checks: Iterable[Check], section: object) -> Iterator[Impossibility]:
    """What these checks find; one that asks for a value that is not known ends there."""
    for check in checks:
        with suppress(UnknownError):
            yield from check(section)


def newton(force: float) -> str:
    """A force with its unit, to six digits."""
    return format_quantity(force, "N", digits=6)


def metre(length: float) -> str:
    """A length with its unit, to six digits."""
    return format_quantity(length, "m", digits=6)
