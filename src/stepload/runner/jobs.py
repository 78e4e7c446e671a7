"""Many jobs in batches; a row depends on its work and its job only, not on worker or time."""

from __future__ import annotations

import gc
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cache, partial
from typing import Protocol, TypeVar

from stepload.errors import RefusedError
from stepload.runner.pool import DoneT, PartT, Pool

BATCH = 25
"""Largest number of jobs that are sent, done and stored together."""

TAIL = 8
"""A batch holds at most the jobs left divided by this: towards the end batches become smaller, so
that no worker waits long for the last one of another."""

JobT = TypeVar("JobT")
RowT = TypeVar("RowT")
JobIn = TypeVar("JobIn", contravariant=True)
RowOut = TypeVar("RowOut", covariant=True)


@dataclass(frozen=True, slots=True)
class Job:
    """One run to be done.

    Attributes:
        series: runs of one kind.
        index: number of the run in its series; with the seed of the work it decides all draws.
        point: coordinates chosen by a directed search; empty where all is drawn.
    """

    series: str
    index: int
    point: tuple[float, ...] = ()


class Work(Protocol[JobIn, RowOut]):
    """Common part of all jobs; it is pickled and sent with every batch."""

    @property
    def digest(self) -> str:
        """Digest of the code that determines the result of a job on this machine."""
        ...

    def run(self, job: JobIn, /) -> RowOut:
        """Do one job. The same work and job give the same row on any machine."""
        ...


def run_batch(work: Work[JobT, RowT], digest: str, jobs: Sequence[JobT]) -> list[RowT]:
    """Do these jobs here, one after the other.

    Raises:
        RefusedError: the code here is not the code that `digest` was made from.
    """
    here = work.digest
    if here != digest:
        raise RefusedError(
            f"this worker's code is not the code that asks (digest {here[:12]}, not {digest[:12]})",
            hint="install the same version everywhere and restart the workers",
        )
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


def run_all(
    work: Work[JobT, RowT], jobs: Sequence[JobT], pool: Pool, size: int | None = None
) -> Generator[list[RowT], None, None]:
    """Rows in batches, in order of completion; each job is done once.

    Args:
        work: the common part of all jobs.
        jobs: the jobs.
        pool: the worker pool.
        size: largest number of jobs in a batch, by default `BATCH`; 1 where the pool is here.
    """
    yield from pool.finished(partial(run_batch, work, work.digest), _parts(jobs, pool, size))


def run_in_order(
    work: Work[JobT, RowT], jobs: Sequence[JobT], pool: Pool, size: int | None = None
) -> Generator[list[RowT], None, None]:
    """The same in the order of the jobs: an early batch waits for those before it."""
    do = partial(_numbered, partial(run_batch, work, work.digest))
    early: dict[int, list[RowT]] = {}
    due = 0
    with closing(pool.finished(do, enumerate(_parts(jobs, pool, size)))) as batches:
        for number, rows in batches:
            early[number] = rows
            while due in early:
                yield early.pop(due)
                due += 1


def _numbered(do: Callable[[PartT], DoneT], part: tuple[int, PartT]) -> tuple[int, DoneT]:
    return part[0], do(part[1])


def _parts(jobs: Sequence[JobT], pool: Pool, size: int | None) -> Iterator[Sequence[JobT]]:
    size, start = 1 if pool.here else size, 0
    while start < len(jobs):
        count = max(1, min(size or BATCH, (len(jobs) - start) // TAIL))
        yield jobs[start : start + count]
        start += count
