"""Application of a function to many cases."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any, NamedTuple, TypeVar

from stepload.runner.jobs import run_all
from stepload.runner.pool import Pool

CaseT = TypeVar("CaseT")
FoundT = TypeVar("FoundT")
AT_ONCE = 4
"""Cases in a batch: most take longer than a tenth of a second."""


class Each(NamedTuple):
    """The work of a trial: `do` for every case, which comes with its number."""

    do: Callable[[Any], Any]

    def run(self, job: tuple[int, Any], /) -> tuple[int, Any]:
        """Do one case."""
        return job[0], self.do(job[1])


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
        RefusedError: a process was killed.
    """
    with Pool(processes) as pool:
        batches = run_all(Each(do), list(enumerate(cases)), pool, AT_ONCE)
        found = dict(chain.from_iterable(batches))
    return [found[number] for number in range(len(cases))]
