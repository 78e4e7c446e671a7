"""Many jobs in batches; a row depends on its work and its job only, not on worker or time."""

from __future__ import annotations

import gc
from collections.abc import Generator, Iterator, Sequence
from functools import cache, partial
from typing import Protocol, TypeVar

from stepload.jobs.pool import Pool

BATCH = 25
"""Largest number of jobs that are sent, done and stored together."""

TAIL = 8
"""A batch holds at most the jobs left divided by this: towards the end batches become smaller, so
that no worker waits long for the last one of another."""

JobT = TypeVar("JobT")
RowT = TypeVar("RowT")
JobIn = TypeVar("JobIn", contravariant=True)
RowOut = TypeVar("RowOut", covariant=True)


class Work(Protocol[JobIn, RowOut]):
    """Common part of all jobs; it is pickled and sent with every batch."""

    def run(self, job: JobIn, /) -> RowOut:
        """Do one job. The same work and job give the same row on any machine."""
        ...


def run_all(
    work: Work[JobT, RowT], jobs: Sequence[JobT], pool: Pool, size: int = BATCH
) -> Generator[list[RowT], None, None]:
    """Rows in batches, in order of completion; each job is done once.

    Args:
        size: largest number of jobs in a batch; 1 where the pool is here.
    """
    size = 1 if pool.here else size
    yield from pool.finished(partial(_run_batch, work), _parts(jobs, size))


def _run_batch(work: Work[JobT, RowT], jobs: Sequence[JobT]) -> list[RowT]:
    _keep_what_is_there()
    rows = [work.run(job) for job in jobs]
    gc.collect()
    return rows


@cache
def _keep_what_is_there() -> None:
    """Present objects stay: the garbage collector need not scan them in each run.

    Once in a process: to count those that are frozen takes as long as to scan them.
    """
    if not gc.get_freeze_count():
        gc.freeze()


def _parts(jobs: Sequence[JobT], size: int) -> Iterator[Sequence[JobT]]:
    start = 0
    while start < len(jobs):
        count = max(1, min(size, (len(jobs) - start) // TAIL))
        yield jobs[start : start + count]
        start += count
