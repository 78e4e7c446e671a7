"""Execution of a batch by a worker of a cluster."""

from __future__ import annotations

import importlib
import os
import pickle
from typing import Any

from stepload.errors import RefusedError
from stepload.runner.threads import THREADS


def unpack_and_do(data: bytes) -> Any:
    """Do the batch in these bytes, made by a `DaskPool`.

    Raises:
        RefusedError: this worker does several batches at once, or its linear algebra may use
            several threads.
    """
    worker = importlib.import_module("distributed").get_worker()
    if worker.state.nthreads != 1:
        raise RefusedError(
            f"the worker {worker.address} has {worker.state.nthreads} threads: runs disturb each"
            " other",
            hint="start workers with --nthreads 1 and one for each core: --nworkers -1",
        )
    many = [name for name in THREADS if os.environ.get(name) != "1"]
    if many:
        raise RefusedError(
            f"the worker {worker.address} has no {many[0]}=1: its figures may be rounded otherwise",
            hint="start workers with their nanny, or set " + " ".join(f"{n}=1" for n in THREADS),
        )
    do, part = pickle.loads(data)  # noqa: S301  what the user's own command sent
    return do(part)
