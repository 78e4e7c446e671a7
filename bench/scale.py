"""What a second worker gains, and what a batch costs beside its runs.

python bench/scale.py                       this machine
python bench/scale.py --runs 400            runs of the campaign in each measurement

"efficiency" is (time of one worker) / (2 × time of two), both by processes that are warm. On a
machine that is busy it is less than the pool's own. "overhead" is the time of a batch whose jobs do
nothing, batches one after the other. "CPU" of a run is that of this process alone.
"""

from __future__ import annotations

import argparse
import importlib
import os
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from stepload.jobs.jobs import BATCH, Work, run_all
from stepload.jobs.pool import Pool
from stepload.plan.load import load_plan
from stepload_verify.campaign.campaign import jobs_for
from stepload_verify.campaign.result import Job
from stepload_verify.campaign.scenario import kinds_from
from stepload_verify.campaign.work import Work as Campaign

PLAN = Path(__file__).parents[1] / "procedures" / "campaign.yaml"
REPEATS = 3
EMPTY = 200
"""Batches without work."""


@dataclass(frozen=True)
class Nothing:
    """Work that takes no time."""

    def run(self, job: Job, /) -> int:
        return job.index


def took(work: Work[Job, object], jobs: Sequence[Job], pool: Pool) -> float:
    """Seconds for these jobs."""
    begin_s = time.perf_counter()
    for _ in run_all(work, jobs, pool):
        pass
    return time.perf_counter() - begin_s


def shown(name: str, values: Sequence[float], unit: str) -> None:
    low, high = min(values), max(values)
    print(f"{name:44} {statistics.median(values):8.3g} {unit} ({low:.3g} to {high:.3g})")


def campaign() -> Campaign:
    """The fault campaign, every kind of fault, seed 1."""
    return Campaign(load_plan(PLAN), 1, kinds_from("all"))


def cpu_of(work: Work[Job, object], jobs: Sequence[Job]) -> float:
    """CPU seconds for these jobs in this process."""
    begin_s = time.process_time()
    took(work, jobs, Pool(1))
    return time.process_time() - begin_s


def efficiencies(runs: int, repeats: int) -> list[float]:
    """(Time of one process) / (2 × time of two), both warm."""
    jobs, work = jobs_for(runs, ("one",)), campaign()
    found = []
    with Pool(2) as pair:
        for pool in (Pool(1), pair):
            took(work, jobs[: 4 * BATCH], pool)
        for _ in range(repeats):
            alone_s = took(work, jobs, Pool(1))
            found.append(alone_s / (2.0 * took(work, jobs, pair)))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=100)
    jobs = jobs_for(parser.parse_args().runs, ("one",))
    nothing = importlib.import_module("scale").Nothing()  # of this file, as workers find it
    work = campaign()
    warm, empty = jobs[: 4 * BATCH], [Job("", index) for index in range(BATCH * EMPTY)]
    one, cpu, two = ([] for _ in range(3))
    overheads: list[float] = []
    with Pool(2) as pair:
        for pool in (Pool(1), pair):
            took(nothing, empty[:BATCH], pool)
            took(work, warm, pool)
        for _ in range(REPEATS):
            begin_s = time.process_time()
            one.append(took(work, jobs, Pool(1)))
            cpu.append(time.process_time() - begin_s)
            two.append(took(work, jobs, pair))
            overheads.append(took(nothing, empty, pair))
    print(f"{len(jobs)} runs of the campaign, load of the machine {os.getloadavg()[0]:.1f}")
    shown("CPU of a run", [1e3 * s / len(jobs) for s in cpu], "ms")
    shown("efficiency of two processes", [a / (2 * b) for a, b in zip(one, two, strict=True)], "")
    shown("overhead of a batch, two processes", [1e3 * s / EMPTY for s in overheads], "ms")


if __name__ == "__main__":
    main()
