"""A search from its beginning to its tables; it can be resumed."""

from __future__ import annotations

import csv
import hashlib
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path

from stepload.errors import SteploadError
from stepload.runner.jobs import Pool, run_in_order
from stepload.runner.store import Store
from stepload_verify.falsify.hunt import Hunt
from stepload_verify.falsify.scene import scenario_at
from stepload_verify.falsify.scene_file import text_of
from stepload_verify.falsify.search import search
from stepload_verify.falsify.strata import Stratum
from stepload_verify.falsify.trial import Point, Search, Trial, left_out
from stepload_verify.falsify.weak import weakness

FILES = ("search.json", "trials.jsonl")
WORST = "worst.csv"
SCENES = "scenes"
BATCH = 12
"""Trials that are done and kept together."""
KEPT_SCENES = 40
"""Number of the worst strata whose worst run is written as a scene file; every broken one is."""


@dataclass(frozen=True, slots=True)
class Worst:
    """The worst run of a stratum after so many runs; `j` and the rest are None where none ran."""

    stratum: str
    runs: int
    found_after: int | None
    j: float | None
    peak_ratio: float | None
    ended_by: str
    phase: str
    hazard: str


def falsify(
    what: Search,
    strata: Sequence[Stratum],
    *,
    trials: int,
    seed: int,
    pool: Pool,
    directory: Path | None = None,
    on_progress: Callable[[list[Hunt]], None] | None = None,
) -> list[Hunt]:
    """Search these strata; with a directory every trial is kept there, and none is done twice.

    Raises:
        RefusedError: the directory holds another search.
    """
    run, weigh = (
        partial(_in_batches, what, pool),
        partial(weakness, what.template, left_out(what.ablation)),
    )
    if directory is None:

        def anew(points: Sequence[Point]) -> list[Trial]:
            return list(chain(*run(points)))

        return search(strata, trials, seed, anew, on_progress, weigh)
    names = "\n".join(stratum.name for stratum in strata)
    header: dict[str, object] = {
        "seed": seed,
        "trials": trials,  # they determine how many points of a stratum are drawn at random
        "strata": hashlib.sha256(names.encode()).hexdigest(),
        "without": what.ablation,
        "plan": what.template.digest,
        "code": what.digest,
    }
    with Store(directory, FILES, header, Trial.from_line) as store:
        hunts = search(strata, trials, seed, _remembered(run, store), on_progress, weigh)
    _write(directory, what, hunts)
    return hunts


def _in_batches(what: Search, pool: Pool, points: Sequence[Point]) -> Iterator[list[Trial]]:
    return run_in_order(what, points, pool, BATCH)


def _remembered(
    run_anew: Callable[[Sequence[Point]], Iterable[list[Trial]]], store: Store[Trial]
) -> Callable[[Sequence[Point]], list[Trial]]:
    """Runs the trials that are not stored yet, in small parts, so that a crash loses little."""
    there = {(trial.series, trial.index): trial for trial in store.rows}

    def run(points: Sequence[Point]) -> list[Trial]:
        missing = [p for p in points if (p.stratum.name, p.number) not in there]
        for done in run_anew(missing):
            store.add(done)
            there.update({(trial.series, trial.index): trial for trial in done})
        return [there[point.stratum.name, point.number] for point in points]

    return run


def worst(hunts: Sequence[Hunt]) -> list[Worst]:
    """One row per stratum, the worst first."""
    rows = []
    for hunt in _ranked(hunts):
        best = hunt.worst[1] if hunt.worst else None
        rows.append(
            Worst(
                hunt.stratum.name,
                hunt.runs,
                hunt.found_after,
                best.j if best else None,
                best.peak_ratio if best else None,
                best.ended_by if best else "",
                best.phase if best else "",
                best.hazard if best else "",
            )
        )
    return rows


def _ranked(hunts: Sequence[Hunt]) -> list[Hunt]:
    return sorted(hunts, key=lambda hunt: -(hunt.worst[1].j if hunt.worst else -math.inf))


def _write(directory: Path, what: Search, hunts: Sequence[Hunt]) -> None:
    with (directory / WORST).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(Worst.__slots__)
        writer.writerows([getattr(row, name) for name in Worst.__slots__] for row in worst(hunts))
    scenes = directory / SCENES
    scenes.mkdir(exist_ok=True)
    for rank, hunt in enumerate(_ranked(hunts)):
        if hunt.worst and (rank < KEPT_SCENES or hunt.found_after is not None):
            write_scene(scenes, what, hunt)


def write_scene(directory: Path, what: Search, hunt: Hunt) -> Path:
    """The worst run of a stratum as a scene file."""
    if hunt.worst is None:
        raise SteploadError(f"{hunt.stratum.name}: nothing was run")
    point, trial = hunt.worst
    ablation = left_out(what.ablation)
    scenario = scenario_at(what.template, hunt.stratum, point.number, point.point, ablation)
    assert scenario is not None
    path = directory / f"{re.sub(r'[^a-zA-Z0-9_]+', '-', hunt.stratum.name)}.json"
    found = {"j": trial.j, "peak_ratio": trial.peak_ratio}
    path.write_text(text_of(scenario, found), encoding="utf-8")
    return path
