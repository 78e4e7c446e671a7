"""A search over strata from its beginning to its table; it can be resumed and made longer."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from stepload.errors import BadInputError
from stepload.jobs.jobs import run_all
from stepload.jobs.pool import Pool
from stepload.jobs.store import Store
from stepload.plan.model import Plan
from stepload_verify.campaign.campaign import collect
from stepload_verify.campaign.work import loaded
from stepload_verify.falsify.hunt import Hunt, Row
from stepload_verify.falsify.scene import Bench
from stepload_verify.falsify.scene_file import text_of
from stepload_verify.falsify.strata import Stratum
from stepload_verify.falsify.trial import judge

FILES = ("search.json", "strata.jsonl")
TABLE = "strata.csv"
SCENES = "scenes"
COLUMNS = ("stratum", "evaluations", "above", "j", "peak_ratio", "ended_by", "phase", "hazards",
           "hazards_above", "hazard_j", "hazard")  # fmt: skip


class Search(NamedTuple):
    """Common settings of a search; a job is a stratum."""

    template: Plan
    seed: int
    evaluations: int

    @property
    def digest(self) -> str:
        """Digest of the code that determines a row."""
        return loaded(Path(__file__).parent)

    def run(self, stratum: Stratum, /) -> Row:
        """Search a stratum."""
        hunt = Hunt(self.template, stratum, self.seed)
        hunt.search(self.evaluations)
        return hunt.row(self.evaluations)


def falsify(
    what: Search,
    strata: Sequence[Stratum],
    *,
    pool: Pool,
    directory: Path | None = None,
    on_progress: Callable[[Sequence[Row]], None] | None = None,
) -> list[Row]:
    """Search these strata; with a directory their rows are kept there, and none is searched twice.

    Raises:
        RefusedError: the directory holds another search.
    """
    if directory is None:
        return _finish(what, strata, [], None, pool, on_progress)
    header: dict[str, object] = {
        "seed": what.seed, "plan": [source.sha256 for source in what.template.sources],
        "code": what.digest,
    }  # fmt: skip
    with Store(directory, FILES, header, Row.from_line) as store:
        wanted = {stratum.name for stratum in strata}
        kept = [r for r in store.rows if r.series in wanted and r.index == what.evaluations]
        rows = _finish(what, strata, kept, store, pool, on_progress)
    _write(directory, what, strata, rows)
    return rows


def _finish(
    what: Search,
    strata: Sequence[Stratum],
    rows: list[Row],
    store: Store[Row] | None,
    pool: Pool,
    on_progress: Callable[[Sequence[Row]], None] | None,
) -> list[Row]:
    there = {row.series for row in rows}
    left = [stratum for stratum in strata if stratum.name not in there]
    collect(run_all(what, left, pool, 1), rows, store, on_progress)
    return ranked(rows)


def ranked(rows: Sequence[Row]) -> list[Row]:
    """The worst stratum first."""
    return sorted(rows, key=lambda row: (-(-math.inf if row.j is None else row.j), row.series))


def _write(directory: Path, what: Search, strata: Sequence[Stratum], rows: Sequence[Row]) -> None:
    with (directory / TABLE).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for row in rows:
            figures = [getattr(row, name) for name in COLUMNS[1:]]
            writer.writerow([row.series, *figures])
    for row in rows:
        if row.above:
            write_scene(directory, what, strata, row)


def write_scene(directory: Path, what: Search, strata: Sequence[Stratum], row: Row) -> Path:
    """The worst run of a row as a scene file."""
    stratum = next(one for one in strata if one.name == row.series)
    scenario = Bench(what.template, stratum).scenario(0, row.point or row.hazard_point)
    assert scenario is not None
    trial = judge(scenario)
    name = re.sub(r"[^a-zA-Z0-9_]+", "-", row.series)
    path = directory / SCENES / f"{name}.json"
    path.parent.mkdir(exist_ok=True)
    found = {"j": trial.j, "peak_ratio": trial.peak_ratio}
    path.write_text(text_of(scenario, found), encoding="utf-8")
    return path


def stored_from(directory: Path, least_j: float) -> set[str]:
    """Names of the strata in a directory whose worst J is at least this."""
    lines = (directory / FILES[1]).read_text(encoding="utf-8").splitlines()
    rows = map(Row.from_line, lines)
    return {row.series for row in rows if row.j is not None and row.j >= least_j}


def stored_scene(what: Search, strata: Sequence[Stratum], directory: Path, name: str) -> Path:
    """The scene file of the worst run of a stratum that was searched.

    Raises:
        BadInputError: no such stratum there.
    """
    lines = (directory / FILES[1]).read_text(encoding="utf-8").splitlines()
    rows = [row for row in map(Row.from_line, lines) if row.series == name]
    if not rows or not (rows[-1].point or rows[-1].hazard_point):
        raise BadInputError(f"no runs of the stratum {name!r} in {directory}")
    return write_scene(directory, what, strata, rows[-1])
