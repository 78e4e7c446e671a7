"""Trials over processes that stay, in the order in which they were asked for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from types import TracebackType

from stepload.runner.local import quiet
from stepload_verify.falsify.trial import Point, Search, Trial, try_points

BATCH = 12


class Workers:
    """Tries points of one search on so many processes; here, where that is one."""

    def __init__(self, search: Search, processes: int) -> None:
        self._search = search
        self._pool: ProcessPoolExecutor | None = None
        if processes > 1:
            context = get_context("spawn")
            self._pool = ProcessPoolExecutor(processes, mp_context=context, initializer=quiet)

    def as_done(self, points: Sequence[Point]) -> Iterator[list[Trial]]:
        """The trials of these points, a batch at a time, in their order."""
        batches = [points[start : start + BATCH] for start in range(0, len(points), BATCH)]
        if self._pool is None:
            for batch in batches:
                yield try_points(self._search, batch)
        else:
            yield from self._pool.map(try_points, [self._search] * len(batches), batches)

    def __call__(self, points: Sequence[Point]) -> list[Trial]:
        """The trials of these points, in their order."""
        return [trial for batch in self.as_done(points) for trial in batch]

    def __enter__(self) -> Workers:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=True)
