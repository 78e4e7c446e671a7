"""Evaluates untrusted files: errors that their numbers cause are reported as the file's fault."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from stepload.errors import BadInputError


@contextmanager
def untrusted(path: Path) -> Iterator[None]:
    """Evaluate what was read from `path`.

    Raises:
        BadInputError: in place of every error of arithmetic, shape, type or memory.
    """
    try:
        with np.errstate(all="ignore"):
            yield
    except (ArithmeticError, ValueError, TypeError, LookupError, MemoryError) as error:
        if isinstance(error, BadInputError):
            raise
        raise BadInputError(
            f"{path}: its numbers cannot be evaluated: {error}",
            hint="the file is damaged, or was not made by stepload",
        ) from error
