"""The whole campaign: its runs, those still to be done, and their results."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from pathlib import Path

from stepload.jobs.jobs import run_all
from stepload.jobs.pool import Pool
from stepload.jobs.store import RowT, Store
from stepload.plan.compose import SIMULATED
from stepload_verify.campaign.result import Job, Result
from stepload_verify.campaign.work import Work

FILES = ("campaign.json", "runs.jsonl")


def jobs_for(runs: int, series: Sequence[str]) -> list[Job]:
    """So many runs in all, evenly over the series."""
    return [Job(series[number % len(series)], number // len(series)) for number in range(runs)]


def run_campaign(
    work: Work,
    jobs: Sequence[Job],
    *,
    pool: Pool,
    directory: Path | None = None,
    on_progress: Callable[[Sequence[Result]], None] | None = None,
) -> list[Result]:
    """Do those of these runs that are not in `directory` yet; all their results, in order.

    Raises:
        RefusedError: the directory holds another campaign.
    """
    if directory is None:
        return _finish(work, jobs, [], pool, None, on_progress)
    header: dict[str, object] = {
        "seed": work.seed,
        "faults": ",".join(work.kinds),
        "faults_per_run": work.at_once,
        "without": work.ablation,
        "plan": [source.sha256 for source in work.template.sources],
        "code": work.digest,
        **({} if work.world == SIMULATED else {"world": work.world}),
    }
    with Store(directory, FILES, header, Result.from_line) as store:
        return _finish(work, jobs, store.rows, pool, store, on_progress)


def _finish(
    work: Work,
    jobs: Sequence[Job],
    results: list[Result],
    pool: Pool,
    store: Store[Result] | None,
    on_progress: Callable[[Sequence[Result]], None] | None,
) -> list[Result]:
    place = {job: number for number, job in enumerate(jobs)}
    kept = [row for row in results if Job(row.series, row.index) in place]
    there = {Job(row.series, row.index) for row in kept}
    left = [job for job in jobs if job not in there]
    collect(run_all(work, left, pool), kept, store, on_progress)
    return sorted(kept, key=lambda row: place[Job(row.series, row.index)])


def collect(
    batches: Generator[list[RowT], None, None],
    rows: list[RowT],
    store: Store[RowT] | None,
    on_progress: Callable[[Sequence[RowT]], None] | None,
) -> None:
    """Add the batches to the rows and to their store, as they come."""
    with closing(batches):
        for batch in batches:
            if store:
                store.add(batch)
            rows += batch
            if on_progress:
                on_progress(rows)
