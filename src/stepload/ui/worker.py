"""A process that reads other people's files for the server, so that none of them can block it."""

from __future__ import annotations

import os
import resource
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any, TypeVar

from anyio import Lock, to_thread

from stepload.errors import BadInputError
from stepload.jobs.pool import one_thread, serve

Result = TypeVar("Result")
NICE = 5
MOST_BYTES = 4 << 30
"""Memory that a file may make the process take."""


def _begin(pipe: Connection) -> None:
    os.nice(NICE)
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    serve(pipe)


class Worker:
    """A process that does one thing at a time; it is started when it is needed.

    Args:
        patience_s: what takes longer is given up, with the process.
    """

    def __init__(self, patience_s: float) -> None:
        self._patience_s = patience_s
        self._lock = Lock()
        self._process: SpawnProcess | None = None
        self._pipe: Connection | None = None

    async def do(self, function: Callable[..., Result], *arguments: Any) -> Result:
        """What a function of a module returns for these arguments.

        Raises:
            BadInputError: it took too long, or the process was killed.
            Exception: its own.
        """
        async with self._lock:
            return await to_thread.run_sync(self._do, function, arguments)

    def _do(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        if self._pipe is None:
            self._start()
        assert self._pipe is not None
        try:
            self._pipe.send((_call, (function, arguments)))
            if not self._pipe.poll(self._patience_s):
                self.close()
                raise BadInputError(f"it took longer than {self._patience_s:g} s and was given up")
            result, error = self._pipe.recv()
        except (EOFError, OSError) as error:
            self.close()
            raise BadInputError("the process that read it was killed") from error
        if error is not None:
            raise error
        return result

    def _start(self) -> None:
        context = get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(target=_begin, args=(other,), daemon=True)
        with one_thread(), other:
            self._process.start()

    def close(self) -> None:
        """End the process."""
        if self._process is not None and self._pipe is not None:
            self._process.kill()
            self._process.join()
            self._pipe.close()
        self._process = self._pipe = None


def _call(work: tuple[Callable[..., Any], tuple[Any, ...]]) -> Any:
    function, arguments = work
    return function(*arguments)
