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
from multiprocessing import get_context

from stepload.runner.interrupts import interruptible
from stepload.runner.jobs import DoneT, PartT
from stepload.runner.losses import Losses
from stepload.runner.threads import one_thread

PARENT_POLL_S = 1.0
AHEAD = 2
"""Pending batches for each worker, so that the next one is ready."""
_log = logging.getLogger(__name__)


def cores() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0))


class LocalPool:
    """A fixed number of processes until the end of the `with` block; with 1 the work is done here.

    A process that is killed is replaced, and its pending batches are done again.

    Args:
        processes: at least 1.
    """

    def __init__(self, processes: int) -> None:
        self._processes = processes
        self._executor: ProcessPoolExecutor | None = None

    @property
    def here(self) -> bool:
        """Whether the work is done in this process."""
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
        losses, left = Losses(), iter(parts)
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
                    losses.none()
                    yield future.result()
                if broken:
                    again.extend(pending.values())
                    pending.clear()
                    self._end()
                    losses.one("a process was lost")
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

    def __enter__(self) -> LocalPool:
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
