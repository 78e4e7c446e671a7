"""Values of a parameter that `make long` tries and `make test` does not."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def long(values: Iterable[Any]) -> list[Any]:
    """Each of `values` with the mark `long`."""
    return [pytest.param(value, marks=pytest.mark.long) for value in values]
