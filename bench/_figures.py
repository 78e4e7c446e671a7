"""The figures of the table of speeds, each from the bench that measures it.

CPU figures are of user and system time, which other work on the machine stretches less than time on
the wall. Efficiency of two workers is the one figure by the wall.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import dry_run
import estimators
import record
import scale
from _row import Row

from stepload_verify.campaign.campaign import jobs_for

PLAN = Path(__file__).parents[1] / "procedures" / "plastic-sphere.yaml"
LIBRARIES = "typer, numpy, pydantic, rich.table"
"""What a preflight imports besides its own modules."""
OLDER_RUNS_PER_S = 10.0
"""Campaign runs per CPU second in the campaign of 110,000 runs of docs/scale.md (0.1 s each)."""


COSTS = {"run and record": ("cpu_s", "writer_cpu_s"), "identify": ("identify_cpu_s",)}


@dataclass(frozen=True)
class Effort:
    """How much is measured for each figure.

    Attributes:
        repeats: of what takes seconds.
        slow_repeats: of what takes half a minute.
        record_s: length of the record that is repaired.
        runs: of the campaign in one repeat.
        many_runs: of the campaign whose cost of a run is compared with that.
        samples: of each cell of a map.
        long_fit: samples of the long fits.
        rounds: of each fit in one repeat.
        minutes: lengths of records whose cost is compared.
    """

    repeats: int = 5
    slow_repeats: int = 3
    record_s: int = 120
    runs: int = 50
    many_runs: int = 200
    samples: int = 250
    long_fit: tuple[int, ...] = (300_000, 3_000_000)
    rounds: int = 8
    minutes: tuple[float, ...] = (1.0, 10.0, 100.0)


WHOLE = Effort()
QUICK = Effort(1, 1, 5, 2, 4, 1, (3000,), 1, (0.25, 0.5))
Step = Callable[[Effort], Iterator[Row]]


def cpu_of_process(words: list[str], repeats: int) -> list[float]:
    """CPU seconds of a new process, its modules compiled by one that is not counted."""
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": ""}
    found = []
    for number in range(repeats + 1):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(
            [sys.executable, *words], check=True, stdout=subprocess.DEVNULL, env=environment
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if number:
            found.append(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)
    return found


def starts(effort: Effort) -> Iterator[Row]:
    """How soon the command line answers."""
    for name, words, goal, libraries in (
        ("stepload --help", ["--help"], 0.1, "typer"),
        ("preflight of the plastic sphere", ["preflight", str(PLAN)], 0.45, LIBRARIES),
    ):
        values = cpu_of_process(["-m", "stepload", *words], 2 * effort.repeats)
        beside = cpu_of_process(["-c", f"import {libraries}"], 2 * effort.repeats)
        yield Row(name, "s of CPU", values, goal, True, f"import {libraries}", beside)


def dry_runs(effort: Effort) -> Iterator[Row]:
    """`make demo`: the whole command once the plan is read, and its loop with recording."""
    done = [dry_run.in_a_process(0.0) for _ in range(effort.repeats)]
    whole = [one["command_cpu_s"] for one in done]
    loop = [one["virtual_s"] / (one["cpu_s"] + one["writer_cpu_s"]) for one in done]
    loops = [one["cpu_s"] for one in done]
    yield Row("make demo after set-up", "s of CPU", whole, 3.0, True, "its loop alone", loops)
    yield Row("the loop of make demo, with recording", "×", loop, 100.0, False, "real time")


def lengths(effort: Effort) -> Iterator[Row]:
    """Whether a long record costs more for each minute than a short one."""
    done = [dry_run.in_a_process(minutes / 60.0) for minutes in effort.minutes]
    lasted = [one["virtual_s"] / 60.0 for one in done]
    for name, keys in COSTS.items():
        cost_s = [sum(one[k] for k in keys) / m for one, m in zip(done, lasted, strict=True)]
        for minutes, each_s in zip(lasted[1:], cost_s[1:], strict=True):
            yield Row(
                f"{name}, a minute of a record of {minutes:.0f} minutes",
                "×",
                [each_s / cost_s[0]],
                smaller=True,
                against=f"a minute of one of {lasted[0]:.0f} minutes, {cost_s[0]:.2g} s of CPU",
            )


def repairs(effort: Effort) -> Iterator[Row]:
    """Messages that are repaired, counted and read back."""
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        rates = record.repaired_per_s(directory, effort.record_s, effort.repeats)
        beside = record.decoded_per_s(directory / "whole.mcap", 1)
    unit, plain = "messages per CPU second", "decoded by mcap"
    yield Row("repair of a record", unit, rates, 1e6, False, plain, beside)


def campaigns(effort: Effort) -> Iterator[Row]:
    """Runs of the fault campaign, and what a second process gains."""
    work, few = scale.campaign(), jobs_for(effort.runs)
    scale.cpu_of(work, few[:4])
    rates = [len(few) / scale.cpu_of(work, few) for _ in range(effort.slow_repeats)]
    ratios = [rate / OLDER_RUNS_PER_S for rate in rates]
    older = f"{OLDER_RUNS_PER_S:g} a second, the campaign of 110,000 runs"
    yield Row("campaign, runs per CPU second", "×", ratios, 1.6, False, older)
    many = jobs_for(effort.many_runs)
    growth = scale.cpu_of(work, many) / len(many) * statistics.median(rates)
    beside = f"CPU of a run among {effort.runs}"
    yield Row(f"campaign, CPU of a run among {effort.many_runs}", "×", [growth], None, True, beside)
    gained = scale.efficiencies(2 * effort.runs, effort.slow_repeats)
    against = "two processes that hinder each other in nothing: 1"
    yield Row("efficiency at two workers", "", gained, 0.85, False, against)


def fits(effort: Effort) -> Iterator[Row]:
    """Estimators beside the libraries that could be used instead."""
    x, y = estimators.data()
    least = [
        estimators.against_least_squares(x, y, 4 * effort.rounds) for _ in range(effort.repeats)
    ]
    yield _ratios(
        f"joint fit of {estimators.PRODUCTION} samples", "scipy.optimize.least_squares", least
    )
    for samples in effort.long_fit:
        x, y = estimators.data(samples)
        svd = [estimators.against_svd(x, y, effort.rounds)[0] for _ in range(effort.repeats)]
        yield _ratios(
            f"RS-BTLS of {samples:.0e} samples".replace("e+0", "e"), "numpy.linalg.svd", svd
        )


def _ratios(name: str, against: str, rows: list[estimators.Row]) -> Row:
    worst = max(row.disagreement for row in rows)
    if worst > rows[0].allowed:
        raise SystemExit(f"{name}: answers differ from {against} by {worst:.1e}")
    return Row(name, "×", [row.ratio for row in rows], rows[0].wanted, False, f"{against}")


STEPS: tuple[Step, ...] = (starts, dry_runs, repairs, campaigns, fits, lengths)
