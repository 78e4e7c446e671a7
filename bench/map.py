"""Identifications of a map per CPU second, with the checks of the whole pipeline and without.

    python bench/map.py

The cells are those of the payloads that come with stepload on the STVF rig. One run of every
seventh cell goes through the whole pipeline too, as in `stepload map`; its time is in the figure.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["OMP_NUM_THREADS"] = "1"

import statistics
import time

from stepload.design import atlas
from stepload.runner.pool import Pool

SERIES = "payloads"
SAMPLES = 250
ROUNDS = 3


def identified_per_s(samples: int, *, checks: bool) -> float:
    """Identifications in a CPU second of this process."""
    every, atlas.CHECK_EVERY = atlas.CHECK_EVERY, atlas.CHECK_EVERY if checks else 0
    cells: list[int] = []
    try:
        begin_s = time.process_time()
        atlas.make(
            "stvf", atlas.shipped_payloads(), samples=samples, seed=1, pool=Pool(1),
            on_start=cells.append, only=(SERIES,),
        )  # fmt: skip
        return cells[0] * samples / (time.process_time() - begin_s)
    finally:
        atlas.CHECK_EVERY = every


def main() -> None:
    identified_per_s(1, checks=True)
    for checks in (False, True):
        rates = [identified_per_s(SAMPLES, checks=checks) for _ in range(ROUNDS)]
        rate = statistics.median(rates)
        name = "with checks by the whole pipeline" if checks else "without them"
        print(
            f"{name:34} {rate:6.0f} identifications per CPU second"
            f" ({min(rates):.0f} to {max(rates):.0f}); 100,000 on two cores:"
            f" {1e5 / rate / 2.0 / 60.0:.1f} minutes"
        )


if __name__ == "__main__":
    main()
