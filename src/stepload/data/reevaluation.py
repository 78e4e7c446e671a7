"""Repeated identification of every record of a directory: its result then and now."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from stepload.data.catalog import RunRow, rows
from stepload.errors import BadInputError
from stepload.jobs.jobs import run_all
from stepload.jobs.pool import Pool
from stepload.report.conditions import Stated
from stepload.report.from_file import results_of_file
from stepload.report.model import finite

AT_ONCE = 4
"""Records in a batch; each takes about a second."""


@dataclass(frozen=True, slots=True)
class Again:
    """One record, then and now; texts are "" and numbers None where there is no result.

    `chord_n_per_m` is the headline, `low_n_per_m` and `high_n_per_m` its 95 % interval; `problem`
    says why nothing could be identified now.
    """

    run_id: str
    path: str
    payload: str
    simulated: bool
    verdict_then: str
    chord_then_n_per_m: float | None
    verdict: str
    chord_n_per_m: float | None
    low_n_per_m: float | None
    high_n_per_m: float | None
    problem: str

    @property
    def differs(self) -> bool:
        """Whether the verdict has changed, or nothing can be identified any more."""
        return self.verdict != self.verdict_then


@dataclass(frozen=True, slots=True)
class Reidentify:
    """Settings with which all records of a directory are identified."""

    stated: Stated

    def run(self, job: RunRow, /) -> Again:
        """Identify one record; `problem` says why there is nothing to identify."""
        verdict = problem = ""
        value = low = high = None
        try:
            if job.problem:
                raise BadInputError(job.problem)
            found = results_of_file(Path(job.path), self.stated).found
            verdict = found.verdict.value
            if (headline := found.headline) is not None:
                value = finite(headline.value_n_per_m)
                low, high = map(finite, headline.interval_n_per_m)
        except BadInputError as error:
            problem = error.message
        return Again(
            job.run_id, job.path, job.payload, job.simulated,
            job.verdict, finite(job.chord_n_per_m), verdict, value, low, high, problem,
        )  # fmt: skip


def identify_all(
    directory: Path, stated: Stated, pool: Pool, on_done: Callable[[int, int], None]
) -> list[Again]:
    """Identify the records in a directory and below, the oldest first; nothing is changed.

    Args:
        directory: where the records are.
        stated: what the user states, the same for all.
        pool: the worker pool; it must see the same files.
        on_done: called with the number of finished records and of all records.

    Raises:
        BadInputError: it is no directory, or there is no record.
    """
    jobs = rows(directory.resolve())
    if not jobs:
        raise BadInputError(f"{directory}: no record in it", hint="the directory that holds runs")
    found: dict[str, Again] = {}
    for batch in run_all(Reidentify(stated), jobs, pool, AT_ONCE):
        found |= {each.path: each for each in batch}
        on_done(len(found), len(jobs))
    return [found[job.path] for job in jobs]
