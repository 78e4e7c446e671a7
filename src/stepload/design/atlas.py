"""Computation of a map: rig, payloads, cells, rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from stepload.design.answers import Map
from stepload.design.points import columns, points, row_of
from stepload.envelope.benches import bench, specimen
from stepload.errors import BadInputError
from stepload.plan.shipped import payload_folder

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
    on_start: Start | None = None,
) -> Map:
    """The map of a rig with its payloads.

    Args:
        rig: a profile that comes with stepload, or a rig file.
        payloads: payload files; each name once.
        shipped: more of them, left out where `payloads` has one of the same name.
        top_n: top force; None: 300 N, or the largest that the rig can press.
        on_start: called with the number of cells before the computation.

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
    if on_start is not None:
        on_start(len(cells))
    return Map(base, bodies, [row_of(cell) for cell in cells])
