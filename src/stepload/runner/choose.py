"""The worker pool that a command uses."""

from __future__ import annotations

from contextlib import AbstractContextManager

from stepload.errors import BadInputError
from stepload.runner.jobs import Pool
from stepload.runner.local import LocalPool, cores


def open_pool(
    processes: int | None = None, scheduler: str | None = None
) -> AbstractContextManager[Pool]:
    """Processes of this machine, one for each core where no number is given; or a cluster.

    Raises:
        BadInputError: both are given, or the library for a cluster is missing.
        RefusedError: the cluster does not answer.
    """
    if scheduler is not None:
        if processes is not None:
            raise BadInputError(
                "--processes beside --scheduler", hint="the cluster has the workers that it has"
            )
        from stepload.runner.cluster import DaskPool

        return DaskPool(scheduler)
    return LocalPool(processes or cores())
