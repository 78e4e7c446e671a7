"""The whole campaign: which runs there are, which are still to be done, and what they came to."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import stepload
from stepload.rig.world import load_world
from stepload_verify.campaign.pool import Job, Work, run_all
from stepload_verify.campaign.result import Result
from stepload_verify.campaign.scenario import ONE_CHANNEL, TWO_CHANNELS
from stepload_verify.campaign.store import Store

ONE_CHANNEL_SHARE = 10
"""One run on a rig with one force channel for so many on rigs with two; they are extra."""
FILES = ("campaign.json", "runs.jsonl")
NOT_DECIDING = ("campaign.py", "replay.py", "store.py", "summary.py", "without.py")
"""Files of this room that only order, keep and count runs."""
DECIDING = ("contact", "engine", "envelope", "plan", "rig")
"""Rooms of stepload whose code decides what a simulated run comes to."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is."""

    done: int
    total: int
    above_elastic_limit: int
    false_trips: int


def fingerprint(*more: Path) -> str:
    """SHA-256 over the code that decides what a run comes to: ours and the simulator's.

    Args:
        more: directories of code that decides too.
    """
    product, here = Path(stepload.__file__).parent, Path(__file__).parent
    simulator = Path(inspect.getfile(type(load_world()))).parent
    digest = hashlib.sha256()
    counting = {here / name for name in NOT_DECIDING}
    for room in (*(product / name for name in DECIDING), here, simulator, *more):
        for file in sorted(set(room.rglob("*.py")) - counting):
            digest.update(file.relative_to(room.parent).as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


def jobs_for(runs: int) -> list[Job]:
    """Runs 0 … `runs` − 1 with two force channels, and a tenth as many with one."""
    jobs = [Job(TWO_CHANNELS, index) for index in range(runs)]
    return jobs + [Job(ONE_CHANNEL, index) for index in range(-(-runs // ONE_CHANNEL_SHARE))]


def run_campaign(
    work: Work,
    jobs: Sequence[Job],
    *,
    processes: int,
    directory: Path | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> list[Result]:
    """Do those of these runs that are not in `directory` yet; all their results, in order.

    Raises:
        RefusedError: the directory holds another campaign.
    """
    if directory is None:
        return _ordered(_finish(work, jobs, [], processes, None, on_progress), jobs)
    header: dict[str, object] = {
        "seed": work.seed,
        "faults": ",".join(work.kinds),
        "without": work.ablation,
        "plan": work.template.sources[0].sha256 if work.template.sources else "",
        "code": fingerprint(),
    }
    with Store(directory, FILES, header, Result.from_line) as store:
        return _ordered(_finish(work, jobs, store.rows, processes, store, on_progress), jobs)


def _finish(
    work: Work,
    jobs: Sequence[Job],
    results: list[Result],
    processes: int,
    store: Store[Result] | None,
    on_progress: Callable[[Progress], None] | None,
) -> list[Result]:
    wanted = set(jobs)
    there = {Job(row.series, row.index) for row in results}
    left = [job for job in jobs if job not in there]
    kept = [row for row in results if Job(row.series, row.index) in wanted]
    above = sum(_above(row) for row in kept)
    false = sum(row.false_trip for row in kept)
    with closing(run_all(work, left, processes)) as chunks:
        for chunk in chunks:
            if store:
                store.add(chunk)
            kept += chunk
            above += sum(_above(row) for row in chunk)
            false += sum(row.false_trip for row in chunk)
            if on_progress:
                on_progress(Progress(len(kept), len(jobs), above, false))
    return kept


def _above(row: Result) -> bool:
    return row.series == TWO_CHANNELS and not row.hazard and row.peak_ratio > 1.0


def _ordered(results: Sequence[Result], jobs: Sequence[Job]) -> list[Result]:
    place = {job: number for number, job in enumerate(jobs)}
    return sorted(results, key=lambda row: place[Job(row.series, row.index)])
