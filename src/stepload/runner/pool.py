"""Batches on processes of this machine."""

from __future__ import annotations

import logging
import os
import signal
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Container, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, TypeVar

from stepload.errors import RefusedError
from stepload.runner.interrupts import interruptible

PartT = TypeVar("PartT")
DoneT = TypeVar("DoneT")
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
MOST_IN_A_ROW = 5
"""Largest number of lost processes in a row, without a finished batch."""
PARENT_POLL_S = 1.0
GONE = (EOFError, OSError)
"""What a pipe raises whose process is dead."""
_log = logging.getLogger(__name__)


def cores() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0))


class Pool:
    """A fixed number of processes until the end of the `with` block; with 1 the work is done here.

    A process that is killed is replaced, and its batch is done again. Each process has a pipe of
    its own and one batch at a time: no lock, queue or thread is shared that a killed process could
    leave locked or unread. `ProcessPoolExecutor` of Python 3.11 hangs where it starts a process
    while another is lost.

    Args:
        processes: at least 1; one for each core where no number is given.
    """

    def __init__(self, processes: int | None = None) -> None:
        self._processes = processes or cores()
        self._workers: dict[Connection, SpawnProcess] = {}

    @property
    def here(self) -> bool:
        """Whether this process does the work itself. Then a batch is one job: Ctrl+C ends the job
        that it comes into, and those before it are kept."""
        return self._processes <= 1

    def finished(
        self, do: Callable[[PartT], DoneT], parts: Iterable[PartT]
    ) -> Generator[DoneT, None, None]:
        """Results of `do` for each part, once each, in order of completion.

        Closing the generator waits for the parts that are being done. At Ctrl+C they come too,
        before KeyboardInterrupt; here the part is given up. Another Ctrl+C kills the processes.

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
        busy: dict[Connection, PartT] = {}
        came: deque[tuple[DoneT, BaseException | None]] = deque()
        try:
            while True:
                # Ctrl+C waits: what is sent is known to be busy, and what came is kept.
                with interruptible(at_once=False):
                    for pipe in _ready(busy, 0.0):
                        lent = busy.pop(pipe)
                        try:
                            came.append(pipe.recv())
                            lost = 0
                        except GONE:
                            self._end([pipe])
                            again.append(lent)
                            lost += 1
                    while len(busy) < self._processes and lost <= MOST_IN_A_ROW:
                        due = again.popleft() if again else next(left, None)
                        if due is None:
                            break
                        busy[self._send(do, due, busy)] = due
                while came:
                    yield _result(*came.popleft())
                if lost > MOST_IN_A_ROW:
                    raise RefusedError(
                        f"a process was lost {lost} times in a row, and no batch was finished",
                        hint="look for a worker that was killed for its memory; what is done"
                        " is kept",
                    )
                if not busy:
                    return
                _ready(busy)
        except KeyboardInterrupt:
            while came:
                yield _result(*came.popleft())
            if busy:
                _log.warning("waiting for what is being done; another Ctrl+C gives it up")
            yield from self._last(busy)
            raise
        finally:
            for _ in self._last(busy):
                pass

    def _last(self, busy: dict[Connection, Any]) -> Generator[Any, None, None]:
        """Results of the parts that are being done; no other is begun."""
        try:
            while busy:
                for pipe in _ready(busy):
                    del busy[pipe]
                    with suppress(*GONE):
                        result, error = pipe.recv()
                        if error is None:
                            yield result
        except BaseException:
            self._end(list(self._workers), kill=True)
            busy.clear()
            raise

    def _send(
        self, do: Callable[[PartT], DoneT], part: PartT, busy: Container[Connection]
    ) -> Connection:
        """Send it to a process that is idle, or to a new one."""
        for pipe in [each for each in self._workers if each not in busy]:
            try:
                pipe.send((do, part))
            except GONE:
                self._end([pipe])
            else:
                return pipe
        context = get_context("spawn")
        pipe, other = context.Pipe()
        process = context.Process(target=serve, args=(other,))
        with one_thread(), other:
            process.start()
        self._workers[pipe] = process
        with suppress(*GONE):  # dead already: its end of the pipe tells
            pipe.send((do, part))
        return pipe

    def _end(self, pipes: Sequence[Connection], kill: bool = False) -> None:
        """End these processes, which are idle, dead or to be killed."""
        processes = [self._workers.pop(pipe) for pipe in pipes]
        try:
            for pipe, process in zip(pipes, processes, strict=True):
                if kill:
                    process.kill()
                pipe.close()
            for process in processes:
                process.join()
        except KeyboardInterrupt:
            for process in processes:
                process.kill()
            raise

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, *_: object) -> None:
        self._end(list(self._workers))


def _ready(pipes: Iterable[Connection], timeout_s: float | None = None) -> list[Connection]:
    """Those on which an answer came, or whose process is dead."""
    there = list(pipes)
    ready = wait(there, timeout_s)
    return [pipe for pipe in there if pipe in ready]


def _result(result: DoneT, error: BaseException | None) -> DoneT:
    if error is not None:
        raise error
    return result


def serve(pipe: Connection) -> None:
    """What a process of the pool does until the other end of the pipe is closed."""
    quiet()
    while True:
        try:
            do, part = pipe.recv()
        except GONE:
            return
        try:
            pipe.send((do(part), None))
        except BaseException as error:
            error.add_note("".join(traceback.format_exception(error)))
            pipe.send((None, error))


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
