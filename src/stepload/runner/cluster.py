"""Batches on the workers of an existing Dask cluster."""

from __future__ import annotations

import logging
import pickle
import socket
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import suppress
from typing import Any

from stepload.errors import BadInputError, RefusedError
from stepload.runner.extras import extra
from stepload.runner.jobs import DoneT, PartT
from stepload.runner.local import AHEAD
from stepload.runner.losses import Losses

CONNECT_S = 10.0
"""Time limit for a scheduler to answer, and to have a first worker."""
PATIENCE_S = 600.0
"""Time for which a lost scheduler is waited for."""
LOOK_S = 2.0
"""Interval at which the cluster's number of workers is read."""
_RETRY_S = 1.0
_log = logging.getLogger(__name__)


class DaskPool:
    """The workers of a scheduler, whatever their present number.

    Workers may come and go; a lost worker's batches are done again by another. A scheduler that was
    restarted is waited for, and its batches are submitted again.

    Args:
        address: of the scheduler, such as tcp://10.0.0.5:8786.
        patience_s: time for which a lost scheduler is waited for.

    Raises:
        BadInputError: the extra `dask` is not installed, or the address is invalid.
        RefusedError: no scheduler answers there, or it has no workers.
    """

    here = False
    _client: Any = None

    def __init__(self, address: str, patience_s: float = PATIENCE_S) -> None:
        self._dask: Any = extra("distributed", "--scheduler", "dask")
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # reported by this pool
        self._address, self._host_port = address, _host_port(address)
        self._patience_s = patience_s
        self._workers, self._look_s = 0, 0.0
        self._connect(CONNECT_S)
        try:
            self._client.wait_for_workers(1, timeout=CONNECT_S)
        except TimeoutError:
            self.close()
            raise RefusedError(
                f"the scheduler at {address} has no worker",
                hint=f"start some: dask worker {address} --nthreads 1 --nworkers -1",
            ) from None

    def finished(
        self, do: Callable[[PartT], DoneT], parts: Iterable[PartT]
    ) -> Generator[DoneT, None, None]:
        """Results of `do` for each part, once each, in order of completion.

        Closing the generator (Ctrl+C) cancels pending parts.

        Raises:
            RefusedError: workers are lost again and again, or the scheduler does not return.
        """
        losses, left = Losses(), iter(parts)
        again: deque[PartT] = deque()
        pending: dict[Any, PartT] = {}
        try:
            while True:
                try:
                    self._fill(pending, do, again, left)
                    if not pending:
                        return
                    done = [self._come(future) for future in self._done(pending)]
                except (OSError, CancelledError):
                    again.extend(pending.values())
                    pending.clear()
                    losses.one("the scheduler was lost")
                    _log.warning("the scheduler at %s was lost: waiting for it", self._address)
                    self._connect(self._patience_s)
                    continue
                for future, error, result in done:
                    part = pending.pop(future)
                    if isinstance(error, self._dask.scheduler.KilledWorker):
                        again.append(part)
                        losses.one("the worker of a batch was lost")
                        continue
                    if error is not None:
                        raise self._plain(error)
                    losses.none()
                    yield result
        finally:
            if pending:
                with suppress(OSError, CancelledError):
                    self._client.cancel(list(pending), force=True)

    def _fill(
        self,
        pending: dict[Any, PartT],
        do: Callable[[PartT], DoneT],
        again: deque[PartT],
        left: Iterator[PartT],
    ) -> None:
        """Submit parts until enough are pending."""
        while len(pending) < self._wanted():
            part = again.popleft() if again else next(left, None)
            if part is None:
                return
            try:
                future = self._client.submit(_there(), pickle.dumps((do, part)), pure=False)
            except BaseException:
                again.appendleft(part)
                raise
            pending[future] = part

    def _wanted(self) -> int:
        """Number of batches to keep pending: some for each present worker."""
        if time.monotonic() >= self._look_s:
            self._workers = len(self._client.nthreads())
            self._look_s = time.monotonic() + LOOK_S
        return AHEAD * max(1, self._workers)

    def _done(self, pending: dict[Any, PartT]) -> list[Any]:
        """The finished batches; possibly none for a while."""
        with suppress(TimeoutError):
            self._dask.wait(list(pending), timeout=LOOK_S, return_when="FIRST_COMPLETED")
        return [future for future in pending if future.status != "pending"]

    def _come(self, future: Any) -> tuple[Any, BaseException | None, Any]:
        """A finished batch: itself, its error, and its rows."""
        error = future.exception()
        return future, error, future.result() if error is None else None

    def _plain(self, error: BaseException) -> BaseException:
        """The error of a batch, as text if it is not the batch's own."""
        if isinstance(error, ModuleNotFoundError) and (error.name or "").startswith("stepload"):
            return RefusedError(
                f"a worker of {self._address} has no {error.name}",
                hint="install the same version everywhere and restart the workers",
            )
        return error

    def _connect(self, patience_s: float) -> None:
        """A new client; the old one does not know what a restarted scheduler has."""
        self.close()
        give_up_s = time.monotonic() + patience_s
        while (client := self._try()) is None:
            if time.monotonic() >= give_up_s:
                raise RefusedError(
                    f"no scheduler answers at {self._address} for {patience_s:.0f} s",
                    hint="look whether it runs; what is done is kept, the same command goes on",
                )
            time.sleep(_RETRY_S)
        self._client = client
        self._look_s = 0.0

    def _try(self) -> Any:
        """A client, or None; the address is tried first: a client that fails leaves a thread."""
        try:
            socket.create_connection(self._host_port, timeout=CONNECT_S).close()
            return self._dask.Client(self._address, timeout=CONNECT_S, name="stepload")
        except OSError:
            return None

    def close(self) -> None:
        """Leave the cluster; it goes on without this program."""
        client, self._client = self._client, None
        if client is not None:
            client.close()

    def __enter__(self) -> DaskPool:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _host_port(address: str) -> tuple[str, int]:
    host, _, port = address.rpartition("://")[2].rpartition(":")
    if not (host and port.isdecimal() and int(port) < 65536):
        raise BadInputError(
            f"--scheduler {address!r}: no address with a port", hint="such as tcp://10.0.0.5:8786"
        )
    return host.strip("[]"), int(port)


def _there() -> Callable[[bytes], Any]:
    """The function sent to a worker, pickled by value since the worker may not have stepload."""

    def there(data: bytes) -> Any:
        from stepload.runner.there import unpack_and_do

        return unpack_and_do(data)

    return there
