"""Output of `stepload identify --all`: every record of a directory, then and now."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from stepload.results.terminal import Output

if TYPE_CHECKING:
    from stepload.data.again import Again
    from stepload.results.wishes import Wishes

EVERY_S = 10.0


def show_all(
    directory: Path, wishes: Wishes, processes: int | None, scheduler: str | None, output: Output
) -> None:
    """Identify every record in a directory and below, and show one row for each.

    Raises:
        BadInputError: it is no directory, or there is no record.
    """
    from stepload.data.again import identify_all
    from stepload.runner.choose import open_pool

    due_s = [time.monotonic() + EVERY_S]

    def on_done(done: int, of: int) -> None:
        if time.monotonic() >= due_s[0]:
            due_s[0] = time.monotonic() + EVERY_S
            print(f"{done} of {of} records", file=sys.stderr, flush=True)

    with open_pool(processes, scheduler) as pool:
        found = identify_all(directory, wishes, pool, on_done)
    other = [row for row in found if row.differs]
    output.table(
        f"{_counted(found)} in {directory}, identified again",
        ("run", "payload", "verdict then", "chord", "verdict now", "chord", "95 %"),
        [_cells(row) for row in found],
    )
    for row in found:
        if row.problem:
            output.line(f"not identified: {row.path}: {row.problem}")
    output.line(f"{_counted(other)} with another verdict than then")
    output.result({"runs": [asdict(row) | {"differs": row.differs} for row in found]})


def _counted(rows: Sequence[Again]) -> str:
    return "1 record" if len(rows) == 1 else f"{len(rows)} records"


def _cells(row: Again) -> tuple[str, ...]:
    from stepload.units import format_quantity

    def stiffness(value: float | None) -> str:
        return "" if value is None else format_quantity(value, "N/m")

    low, high = stiffness(row.low_n_per_m), stiffness(row.high_n_per_m)
    return (
        f"{row.run_id}{' (simulated)' if row.simulated else ''}", row.payload,
        row.verdict_then.replace("_", " "), stiffness(row.chord_then_n_per_m),
        row.verdict.replace("_", " "), stiffness(row.chord_n_per_m),
        f"{low} to {high}" if low and high else "",
    )  # fmt: skip
