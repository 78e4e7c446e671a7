"""Values of a parameter that `make long` tries and `make test` does not."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import pytest


def long(values: Iterable[Any]) -> list[Any]:
    """Each of `values` with the mark `long`."""
    return [pytest.param(value, marks=pytest.mark.long) for value in values]


def long_rows(rows: Iterable[Sequence[Any]]) -> list[Any]:
    """The same for several parameters at once: each row has a value of each."""
    return [pytest.param(*row, marks=pytest.mark.long) for row in rows]
