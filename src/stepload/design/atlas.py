"""Computation of a map: rig, payloads, cells, rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from stepload.design.answers import Map
from stepload.design.points import columns, points
from stepload.design.work import Work, run_all
from stepload.envelope.benches import bench, specimen
from stepload.errors import BadInputError
from stepload.plan.shipped import payload_folder
from stepload.runner.pool import Pool

CHECK_EVERY = 7
"""One run of every so many cells goes through the whole pipeline as well."""
Start = Callable[[int], None]


def shipped_payloads() -> list[Path]:
    """The payloads that come with stepload."""
    return sorted(payload_folder().glob("*.yaml"))


def make(
    rig: str,
    payloads: Sequence[Path],
    *,
    shipped: Sequence[Path] = (),
    top_n: float | None = None,
    samples: int,
    seed: int,
    pool: Pool,
    on_start: Start | None = None,
    only: Sequence[str] = (),
) -> Map:
    """The map of a rig with its payloads.

    Args:
        rig: a profile that comes with stepload, or a rig file.
        payloads: payload files; each name once.
        shipped: more of them, left out where `payloads` has one of the same name.
        top_n: top force; None: 300 N, or the largest that the rig can press.
        samples: runs of each cell.
        seed: the same seed gives the same map, whatever the number of processes.
        pool: the worker pool.
        on_start: called with the number of cells before the computation.
        only: series to compute; empty: all.

    Raises:
        BadInputError: no such rig or payload, or two payloads of one name.
        PlanError: a file is invalid.
    """
    base = bench(rig, top_n)
    bodies = [specimen(rig, path, base.top_n) for path in payloads]
    names = [each.name for each in bodies]
    for name in names:
        if names.count(name) > 1:
            raise BadInputError(
                f"two payloads are named {name!r}", hint="give each a name of its own"
            )
    bodies += (
        body for path in shipped if (body := specimen(rig, path, base.top_n)).name not in names
    )
    cells = points(base, bodies, columns(base, bodies))
    asked = [cell for cell in cells if not only or cell.series in only]
    if on_start is not None:
        on_start(len(asked))
    rows = run_all(Work(seed, samples, CHECK_EVERY), asked, pool)
    return Map(base, bodies, rows, seed, samples)
