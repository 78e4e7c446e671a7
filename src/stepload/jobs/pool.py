"""Batches on processes of this machine."""

from __future__ import annotations

import os
import signal
import threading
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from types import FrameType
from typing import TypeVar

from stepload.errors import RefusedError

PartT = TypeVar("PartT")
DoneT = TypeVar("DoneT")
ENVIRONMENT = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "PYTHONSAFEPATH"), "1"
)
"""Of a process: one thread, and no module from the working directory in place of Python's."""


def cores() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0))


class Pool:
    """A fixed number of processes until the end of the `with` block; with 1 the work is done here.

    Each process has a pipe of its own and one batch at a time: no lock, queue or thread is shared
    that a killed process could leave locked or unread. `ProcessPoolExecutor` of Python 3.11 hangs
    where it starts a process while another is lost.

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

        Ctrl+C, and the end of the generator, give up the parts that are being done.

        Raises:
            RefusedError: a process was killed.
        """
        if self.here:
            for part in parts:
                with interruptible():
                    result = do(part)
                yield result
            return
        left, busy = iter(parts), set[Connection]()
        try:
            while True:
                while len(busy) < self._processes and (due := next(left, None)) is not None:
                    pipe = next((each for each in self._workers if each not in busy), None)
                    pipe = pipe or self._start()
                    busy.add(pipe)
                    with _none_killed():
                        pipe.send((do, due))
                if not busy:
                    return
                for pipe in [each for each in wait(list(busy)) if isinstance(each, Connection)]:
                    with _none_killed():
                        result, error = pipe.recv()
                    busy.remove(pipe)
                    if error is not None:
                        raise error
                    yield result
        finally:
            self._end(busy)

    def _start(self) -> Connection:
        context = get_context("spawn")
        pipe, other = context.Pipe()
        process = context.Process(target=serve, args=(other,), daemon=True)
        with one_thread(), other:
            process.start()
        self._workers[pipe] = process
        return pipe

    def _end(self, pipes: Iterable[Connection]) -> None:
        processes = [self._workers.pop(pipe) for pipe in list(pipes)]
        for process in processes:
            process.kill()
        for process in processes:
            process.join()

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, *_: object) -> None:
        self._end(self._workers)


@contextmanager
def _none_killed() -> Iterator[None]:
    """An exchange with a process: a pipe whose process is dead raises these errors."""
    try:
        yield
    except (EOFError, OSError) as error:
        raise RefusedError(
            "a process that did the work was killed",
            hint="look for one that took too much memory; what is done is kept",
        ) from error


@contextmanager
def interruptible() -> Iterator[None]:
    """Ctrl+C ends the block with KeyboardInterrupt, however the block itself ends.

    A simulated run takes it for a fault and ends safely: its result is that of no run.
    """
    came = False
    former = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(former):
        yield
        return

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal came
        came = True
        former(number, frame)

    try:
        signal.signal(signal.SIGINT, note)
        yield
    finally:
        signal.signal(signal.SIGINT, former)
        if came:
            raise KeyboardInterrupt


def serve(pipe: Connection) -> None:
    """What a process of the pool does until the other end of the pipe is closed; Ctrl+C is for the
    parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            do, part = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            pipe.send((do(part), None))
        except BaseException as error:
            error.add_note("".join(traceback.format_exception(error)))
            pipe.send((None, error))


@contextmanager
def one_thread() -> Iterator[None]:
    """Processes started in this block use one thread each; this process is unchanged."""
    before = {name: os.environ.get(name) for name in ENVIRONMENT}
    os.environ.update(ENVIRONMENT)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
