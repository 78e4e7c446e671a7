"""The list of a batch, and what of it is pressed already, by the records on disk alone."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from stepload.data.catalog import rows
from stepload.declaration.sections import keys
from stepload.errors import BadInputError, guess
from stepload.plan.model import Plan, Simulation
from stepload.plan.problems import PlanError, Problem
from stepload.plan.reader import checked
from stepload.plan.source import Source, read_source
from stepload.plan.tags import tagged
from stepload.record.outcome import RunStatus
from stepload.record.summary import Summary, read_summary
from stepload.report.batch import TRIAL, trial_of

COLUMNS = {"specimen": "specimen", "operator": "operator", "trial": "trial", "repeat": "trial",
           "plan": "plan", "notes": "notes"}  # fmt: skip
SIMULATED = "simulation."
"""Begin of a column with a key of `rig.simulation`: the truth of a specimen in a dry run."""
TRUTHS = {f"{SIMULATED}{key.name}": key for key in keys(Simulation)}
Key = tuple[str, str, str, str]
"""Plan, specimen, operator and trial: what tells one press from another."""


@dataclass(frozen=True, slots=True)
class Piece:
    """One press that a list asks for; `truth` are fields of `Simulation`."""

    plan: Path
    specimen: str
    operator: str = ""
    trial: str = ""
    notes: str = ""
    truth: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """What a person calls it."""
        return ", ".join(
            filter(None, (self.specimen, self.operator, self.trial and f"trial {self.trial}"))
        )

    def of(self, plan: Plan, batch: str) -> Plan:
        """The plan of this press, from the plan that it names."""
        told = {"specimen": self.specimen, "operator": self.operator, "batch": batch}
        tags = [f"{key}={value}" for key, value in told.items() if value]
        tags += [f"{TRIAL}{self.trial}"] if self.trial else []
        tags += [f"{SIMULATED}{key}={value}" for key, value in self.truth.items()]
        plan = tagged(plan, tags)
        notes = "\n".join(filter(None, (plan.record.notes, self.notes)))
        rig = replace(plan.rig, simulation=replace(plan.rig.simulation, **self.truth))
        return replace(plan, rig=rig, record=replace(plan.record, notes=notes))

    def key(self, plan: Plan) -> Key:
        """What its record is found by; `plan` is the one that it names."""
        return plan.name, self.specimen, self.operator or plan.record.operator, self.trial


def read_list(path: Path, plan: Path | None, *, dry_run: bool) -> list[Piece]:
    """The rows of a list in CSV, separated by comma, semicolon or tab, with a header.

    Args:
        path: the list; paths of plans in it are from its directory.
        plan: of rows that name none.
        dry_run: whether columns `simulation.…` may be there.

    Raises:
        PlanError: every problem, with line and column.
    """
    source, problems = read_source(path), list[Problem]()
    lines = [(at, line) for at, line in enumerate(source.lines, 1) if line.strip()]
    if not lines:
        raise PlanError((source.problem(1, 1, "the list is empty", "a header: specimen,notes"),))
    separator = max(",;\t", key=lines[0][1].count)
    head = list(_cells(lines[0][1], separator))
    for name, column in head:
        if name.lower() not in COLUMNS and name not in TRUTHS:
            hint = f"{guess(name, [*COLUMNS, *TRUTHS])}columns: {', '.join(COLUMNS)}"
            problems.append(source.problem(lines[0][0], column, f"unknown column {name!r}", hint))
        elif name in TRUTHS and not dry_run:
            hint = "--dry-run rehearses; leave the column out to press"
            told = f"{name} is the truth of a simulated specimen"
            problems.append(source.problem(lines[0][0], column, told, hint))
    if "specimen" not in (name.lower() for name, _ in head):
        problems.append(source.problem(lines[0][0], 1, "no column `specimen`", "name the pieces"))
    if problems:
        raise PlanError(tuple(problems))
    seen: dict[tuple[object, ...], int] = {}
    pieces = []
    for number, line in lines[1:]:
        cells = list(_cells(line, separator))
        if len(cells) > len(head):
            told = f"{len(cells)} cells, the header has {len(head)}"
            problems.append(source.problem(number, cells[len(head)][1], told, "quote the text"))
            continue
        piece = _piece(source, number, zip(head, cells, strict=False), plan, problems)
        if piece is None:
            continue
        same = (piece.plan, piece.specimen, piece.operator, piece.trial)
        if (first := seen.setdefault(same, number)) != number:
            told = f"{piece.name} is in line {first} already"
            problems.append(source.problem(number, 1, told, "tell repeats apart: column `trial`"))
        pieces.append(piece)
    if not pieces and not problems:
        problems.append(source.problem(1, 1, "no specimen below the header", "a row for each"))
    if problems:
        raise PlanError(tuple(problems))
    return pieces


def _cells(line: str, separator: str) -> Iterator[tuple[str, int]]:
    """The cells of a line with their columns, from 1."""
    starts, quoted = [1], False
    for at, mark in enumerate(line, 2):
        quoted ^= mark == '"'
        if mark == separator and not quoted:
            starts.append(at)
    texts = next(csv.reader([line], delimiter=separator))
    yield from ((text.strip(), start) for text, start in zip(texts, starts, strict=False))


def _piece(
    source: Source,
    number: int,
    cells: Iterator[tuple[tuple[str, int], tuple[str, int]]],
    plan: Path | None,
    problems: list[Problem],
) -> Piece | None:
    told: dict[str, str] = {}
    truth: dict[str, Any] = {}
    before = len(problems)
    for (name, _), (text, column) in cells:
        if not text:
            continue
        try:
            if (known := TRUTHS.get(name)) is None:
                told[COLUMNS[name.lower()]] = text
            else:
                truth[known.field] = checked(known.hint, _number(text))
        except BadInputError as error:
            message = f"{name}: {error.message}"
            problems.append(source.problem(number, column, message, error.hint))
    path = source.beside(told.pop("plan")) if "plan" in told else plan
    if "specimen" not in told:
        problems.append(source.problem(number, 1, "no specimen", "a name or a number"))
    if path is None:
        problems.append(source.problem(number, 1, "no plan", "stepload batch PLAN LIST"))
    if path is None or len(problems) > before:
        return None
    return Piece(path, truth=truth, **told)


def _number(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text


def pressed(directory: Path) -> dict[Key, Summary]:
    """The completed runs of a directory by what was pressed, the newest of each."""
    found = {}
    for row in rows(directory) if directory.is_dir() else []:
        if row.status == RunStatus.COMPLETED and not row.problem:
            run = read_summary(Path(row.path))
            trial = trial_of(run.metadata.get("tags", ""))
            found[row.plan, row.specimen, row.operator, trial] = run
    return found


def changed(plan: Plan, runs: Sequence[Summary]) -> list[str]:
    """Names of files that runs were made with and that are others in the plan now."""
    now = {sha256(source.text.encode()).hexdigest() for source in plan.sources}
    names: set[str] = set()
    for each in runs:
        about = (each.results or {}).get("run")
        files = about.get("files") if isinstance(about, dict) else None
        names |= {n for n, sha in files.items() if sha not in now} if files else set()
    return sorted(names)


def seen(runs: Sequence[Summary]) -> list[tuple[float, float]]:
    """Position of the first touch and deformation at the first level of every run, in m."""
    found = []
    for each in runs:
        told: Any = each.results or {}
        try:
            touch, level = told["measured"]["touches"][0], told["levels"][0]
            found.append((float(touch["position_m"]), float(level["deformation_m"])))
        except (KeyError, IndexError, TypeError):  # a record says what it likes
            continue
    return found
