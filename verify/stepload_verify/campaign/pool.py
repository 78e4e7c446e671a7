"""Many runs over many processes; every run is the same wherever and whenever it is run."""

from __future__ import annotations

import gc
import os
import signal
import threading
import time
from collections.abc import Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from itertools import islice
from multiprocessing import get_context
from typing import NamedTuple

from stepload.plan.model import Plan
from stepload_verify.campaign.ablation import Ablation
from stepload_verify.campaign.result import Result
from stepload_verify.campaign.scenario import draw
from stepload_verify.campaign.single import run_scenario

PARENT_POLL_S = 1.0
CHUNK = 25


class Job(NamedTuple):
    """One run to be done."""

    series: str
    number: int


class Work(NamedTuple):
    """What all runs of a campaign have in common."""

    template: Plan
    seed: int
    kinds: tuple[str, ...]
    ablation: str = ""


def run_chunk(work: Work, jobs: Sequence[Job]) -> list[Result]:
    """Do these runs here, one after the other."""
    ablation = Ablation(work.ablation) if work.ablation else None
    results = []
    if not gc.get_freeze_count():
        gc.freeze()  # what is there now stays for all runs: no use looking through it in each
    for job in jobs:
        scenario = draw(work.template, work.seed, job.series, job.number, work.kinds)
        results.append(run_scenario(scenario, ablation)[0])
    gc.collect()
    return results


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0))


def quiet() -> None:
    """Ctrl+C is for the parent; a worker ends with its parent, however that ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def follow() -> None:
        while os.getppid() == parent:
            time.sleep(PARENT_POLL_S)
        os._exit(1)

    threading.Thread(target=follow, name="campaign parent", daemon=True).start()


def run_all(work: Work, jobs: Sequence[Job], processes: int) -> Generator[list[Result], None, None]:
    """Results in chunks, in the order in which they are done.

    Closing the iterator (Ctrl+C) ends the workers and loses the chunks under way.
    """
    chunks = (jobs[start : start + CHUNK] for start in range(0, len(jobs), CHUNK))
    if processes <= 1:
        for chunk in chunks:
            yield run_chunk(work, chunk)
        return
    pool = ProcessPoolExecutor(processes, mp_context=get_context("spawn"), initializer=quiet)
    pending: set[Future[list[Result]]] = set()
    try:
        for chunk in islice(chunks, 2 * processes):
            pending.add(pool.submit(run_chunk, work, chunk))
        while pending:
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            for chunk in islice(chunks, len(done)):
                pending.add(pool.submit(run_chunk, work, chunk))
            for future in done:
                yield future.result()
    finally:
        for future in pending:
            future.cancel()
        pool.shutdown(wait=True, cancel_futures=True)
