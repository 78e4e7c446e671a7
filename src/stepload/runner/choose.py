"""The pool that a command asks for."""

from __future__ import annotations

from contextlib import AbstractContextManager

from stepload.runner.jobs import Pool
from stepload.runner.local import LocalPool, cores


def open_pool(processes: int | None = None) -> AbstractContextManager[Pool]:
    """Processes of this machine, one for each core where no number is given."""
    return LocalPool(processes or cores())
