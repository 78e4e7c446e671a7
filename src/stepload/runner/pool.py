"""Batches on processes of this machine."""

from __future__ import annotations

import logging
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Collection, Generator, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    Future,
    ProcessPoolExecutor,
    as_completed,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from typing import TypeVar

from stepload.errors import RefusedError
from stepload.runner.interrupts import interruptible

PartT = TypeVar("PartT")
DoneT = TypeVar("DoneT")
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
MOST_IN_A_ROW = 5
"""Largest number of lost processes in a row, without a finished batch."""
PARENT_POLL_S = 1.0
AHEAD = 2
"""Pending batches for each worker, so that the next one is ready."""
_log = logging.getLogger(__name__)


def cores() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0))


class Pool:
    """A fixed number of processes until the end of the `with` block; with 1 the work is done here.

    A process that is killed is replaced, and its pending batches are done again.

    Args:
        processes: at least 1; one for each core where no number is given.
    """

    def __init__(self, processes: int | None = None) -> None:
        self._processes = processes or cores()
        self._executor: ProcessPoolExecutor | None = None

    @property
    def here(self) -> bool:
        """Whether this process does the work itself. Then a batch is one job: Ctrl+C ends the job
        that it comes into, and those before it are kept."""
        return self._processes <= 1

    def finished(
        self, do: Callable[[PartT], DoneT], parts: Iterable[PartT]
    ) -> Generator[DoneT, None, None]:
        """Results of `do` for each part, once each, in order of completion.

        Closing the generator cancels pending parts. At Ctrl+C the parts that are being done are
        waited for and come too, before KeyboardInterrupt; here the part is given up. Another
        Ctrl+C kills the processes.

        Raises:
            RefusedError: processes are killed again and again.
        """
        if self.here:
            for part in parts:
                with interruptible():
                    result = do(part)
                yield result
            return
        lost, left = 0, iter(parts)
        again: deque[PartT] = deque()
        pending: dict[Future[DoneT], PartT] = {}
        try:
            while True:
                broken = not self._fill(pending, do, again, left)
                if not (pending or broken):
                    return
                done = wait(pending, return_when=FIRST_COMPLETED).done if pending else set()
                for future in done:
                    if isinstance(future.exception(), BrokenProcessPool):
                        broken = True
                        continue
                    del pending[future]
                    lost = 0
                    yield future.result()
                if broken:
                    again.extend(pending.values())
                    pending.clear()
                    self._end()
                    lost += 1
                    if lost > MOST_IN_A_ROW:
                        raise RefusedError(
                            f"a process was lost {lost} times in a row, and no batch was finished",
                            hint="look for a worker that was killed for its memory; what is done"
                            " is kept",
                        )
        except KeyboardInterrupt:
            yield from self._last(pending)
            raise
        finally:
            for future in pending:
                future.cancel()

    def _last(self, pending: Collection[Future[DoneT]]) -> Generator[DoneT, None, None]:
        """Results of the parts that are being done; no other is begun."""
        begun = [future for future in pending if not future.cancel()]
        if begun:
            _log.warning("waiting for what is being done; another Ctrl+C gives it up")
        try:
            for future in as_completed(begun):
                if future.exception() is None:
                    yield future.result()
        except BaseException:
            if self._executor is not None:
                _kill(self._executor)
            raise

    def _fill(
        self,
        pending: dict[Future[DoneT], PartT],
        do: Callable[[PartT], DoneT],
        again: deque[PartT],
        left: Iterator[PartT],
    ) -> bool:
        """Submit parts until enough are pending; False where the processes are gone.

        Ctrl+C waits until a part that is sent is pending: else it would be done, and not kept.
        """
        while len(pending) < AHEAD * self._processes:
            part = again.popleft() if again else next(left, None)
            if part is None:
                return True
            try:
                with interruptible(at_once=False):
                    pending[self._send(do, part)] = part
            except BrokenProcessPool:
                again.appendleft(part)
                return False
        return True

    def _send(self, do: Callable[[PartT], DoneT], part: PartT) -> Future[DoneT]:
        if self._executor is None:
            context = get_context("spawn")
            self._executor = ProcessPoolExecutor(self._processes, context, initializer=quiet)
        with one_thread():  # processes are started by what is sent
            return self._executor.submit(do, part)

    def _end(self) -> None:
        executor, self._executor = self._executor, None
        if executor is not None:
            try:
                executor.shutdown(wait=True, cancel_futures=True)
            except KeyboardInterrupt:
                _kill(executor)
                raise

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()


def _kill(executor: ProcessPoolExecutor) -> None:
    """Kill its processes, with what they do."""
    for process in dict(executor._processes or {}).values():
        process.kill()


def quiet() -> None:
    """Ignore Ctrl+C, which is for the parent; a worker ends with its parent in any case."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def follow() -> None:
        while os.getppid() == parent:
            time.sleep(PARENT_POLL_S)
        os._exit(1)

    threading.Thread(target=follow, name="parent of the pool", daemon=True).start()


@contextmanager
def one_thread() -> Iterator[None]:
    """Processes started in this block use one thread each; this process is unchanged."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
