"""Application of a function to many cases."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import stepload
import stepload_verify
from stepload.rig.world import load_world
from stepload.runner.digest import code_digest
from stepload.runner.jobs import run_in_order
from stepload.runner.pool import Pool

CaseT = TypeVar("CaseT")
FoundT = TypeVar("FoundT")
AT_ONCE = 4
"""Cases in a batch: most take longer than a tenth of a second."""


class Each(NamedTuple):
    """The work of a trial: `do` for every case."""

    do: Callable[[Any], Any]

    @property
    def digest(self) -> str:
        """Digest of all of the project's code, since a trial may use any of it."""
        return _digest()

    def run(self, job: Any, /) -> Any:
        """Do one case."""
        return self.do(job)


@cache
def _digest() -> str:
    simulator = inspect.getfile(type(load_world()))
    files = (stepload.__file__, stepload_verify.__file__, simulator)
    return code_digest(Path(file).parent for file in files)


def for_each(
    do: Callable[[CaseT], FoundT],
    cases: Sequence[CaseT],
    processes: int | None = None,
) -> list[FoundT]:
    """Results of `do`, a function of a module, for every case, in their order.

    Args:
        do: does one case; the same case gives the same result.
        cases: arguments of `do`.
        processes: number of processes on this machine; all cores by default.

    Raises:
        RefusedError: processes are killed again and again.
    """
    with Pool(processes) as pool:
        batches = run_in_order(Each(do), cases, pool, AT_ONCE)
        return [found for batch in batches for found in batch]
