"""Evaluates untrusted files: errors that their numbers cause are reported as the file's fault, and
every error of a damaged record says that it is damaged."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from stepload.errors import BadInputError
from stepload.record.reader import read_recording

OF_NUMBERS = (ArithmeticError, ValueError, TypeError, LookupError, MemoryError)
"""What the numbers of a file may cause."""
MEAN_OF = 100
"""Samples read as one where only the damage of a record is looked for."""


@contextmanager
def untrusted(path: Path) -> Iterator[None]:
    """Evaluate what was read from `path`.

    Args:
        path: the file, or the directory of a run, whose record is meant.

    Raises:
        BadInputError: in place of every error of arithmetic, shape, type or memory; one that comes
            of a damaged record names the damage first, for what it says is of the part before.
    """
    try:
        with np.errstate(all="ignore"):
            yield
    except BadInputError as error:
        _name_damage(error, path / "run.mcap" if path.is_dir() else path)
        raise
    except OF_NUMBERS as error:
        raise BadInputError(
            f"{path}: its numbers cannot be evaluated: {error}",
            hint="the file is damaged, or was not made by stepload",
        ) from error


def of_damaged(path: Path, damage: str, message: str) -> str:
    """What is said of the readable part of a record that is damaged."""
    return f"{path} is damaged: {damage}; what could be read of it: {message}"


def _name_damage(error: BadInputError, path: Path) -> None:
    """Let an error of a damaged record begin with the damage, once."""
    damage = ""
    # No record, or one whose error says it already; and its numbers may be anything.
    with suppress(BadInputError, *OF_NUMBERS, OSError), np.errstate(all="ignore"):
        damage = read_recording(path, MEAN_OF).damage
    if damage and damage not in error.message:
        error.message = of_damaged(path, damage, error.message)
        error.hint = (
            f"`stepload recover {path}` keeps all that is whole of it, also after the damage"
        )
