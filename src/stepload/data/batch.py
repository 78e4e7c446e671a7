"""The list of a batch, and what of it is pressed already, by the records on disk alone."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

from stepload.data.catalog import rows
from stepload.declaration.quantities import Name, Note
from stepload.declaration.sections import keys
from stepload.errors import BadInputError, guess
from stepload.plan.model import Plan, Simulation
from stepload.plan.problems import PlanError, Problem
from stepload.plan.reader import checked
from stepload.plan.source import read_source
from stepload.plan.tags import tagged
from stepload.record.outcome import RunStatus
from stepload.record.summary import Summary, read_summary
from stepload.report.batch import trial_of

COLUMNS = {"specimen": "specimen", "operator": "operator", "trial": "trial", "repeat": "trial",
           "plan": "plan", "notes": "notes"}  # fmt: skip
TRUTHS = {f"simulation.{key.name}": key for key in keys(Simulation)}
"""Columns with the truth of a specimen in a dry run."""
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
        trial = self.trial and f"trial {self.trial}"
        return ", ".join(filter(None, (self.specimen, self.operator, trial)))

    def of(self, plan: Plan, batch: str) -> Plan:
        """The plan of this press, from the plan that it names."""
        told = {"specimen": self.specimen, "operator": self.operator, "batch": batch}
        told |= {"trial": self.trial}
        told |= {f"simulation.{key}": f"{value}" for key, value in self.truth.items()}
        plan = tagged(plan, [f"{key}={value}" for key, value in told.items() if value])
        notes = "\n".join(filter(None, (plan.record.notes, self.notes)))
        rig = replace(plan.rig, simulation=replace(plan.rig.simulation, **self.truth))
        return replace(plan, rig=rig, record=replace(plan.record, notes=notes))

    def key(self, plan: Plan) -> Key:
        """What its record is found by; `plan` is the one that it names."""
        return plan.name, self.specimen, self.operator or plan.record.operator, self.trial


def read_list(path: Path, plan: Path | None, *, dry_run: bool) -> list[Piece]:
    """The rows of a list in CSV, separated by comma, semicolon or tab, below a header.

    Args:
        path: the list; plans in it are named from its directory.
        plan: of rows that name none.
        dry_run: whether columns `simulation.…` may be there.

    Raises:
        PlanError: every problem, with line and column.
    """
    source = read_source(path)
    problems, pieces, seen = list[Problem](), list[Piece](), dict[str, int]()

    def wrong(line: int, column: int, message: str, hint: str) -> None:
        problems.append(source.problem(line, column, message, hint))

    lines = [(at, line) for at, line in enumerate(source.lines, 1) if line.strip()]
    first, header = lines[0] if lines else (1, "")
    separator = max(",;\t", key=header.count)
    head = [(name.lower(), column) for name, column in _cells(header, separator)]
    for name, column in head:
        if name in TRUTHS and not dry_run:
            wrong(first, column, f"{name} is of a simulated specimen", "leave it out, or --dry-run")
        elif name not in TRUTHS and name not in COLUMNS:
            hint = f"{guess(name, [*COLUMNS, *TRUTHS])}columns: {', '.join(COLUMNS)}"
            wrong(first, column, f"unknown column {name!r}", hint)
    names = [COLUMNS.get(name, name) for name, _ in head]
    if "specimen" not in names or len(lines) < 2 or len(set(names)) < len(names):
        wrong(first, 1, "no list", "one column `specimen`, others once each, a row for each press")
    for line, text in lines[1:] if not problems else ():
        cells = list(_cells(text, separator))
        if len(cells) > len(head):
            wrong(line, cells[len(head)][1], "more cells than the header has", "quote the text")
        told = _told(zip(head, cells, strict=False), partial(wrong, line))
        told["plan"] = source.beside(told["plan"]) if "plan" in told else plan
        if "specimen" not in told or told["plan"] is None:
            lacking = "plan" if "specimen" in told else "specimen"
            wrong(line, 1, f"no {lacking}", "stepload batch PLAN LIST; a name for each specimen")
            continue
        piece = Piece(**told)
        if (same := seen.setdefault(f"{piece.plan} {piece.name}", line)) != line:
            wrong(line, 1, f"{piece.name} is in line {same}", "tell repeats apart: column `trial`")
        pieces.append(piece)
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
    try:
        texts = next(csv.reader([line], delimiter=separator))
    except csv.Error:  # a cell of more than 128 KiB
        texts = []
    yield from ((text.strip(), start) for text, start in zip(texts, starts, strict=False))


def _told(
    cells: Iterator[tuple[tuple[str, int], tuple[str, int]]],
    wrong: Callable[[int, str, str], None],
) -> dict[str, Any]:
    """Fields of a piece from the cells of a row and their header."""
    told: dict[str, Any] = {"truth": {}}
    for (name, _), (text, column) in cells:
        if not text:
            continue
        try:
            if name in COLUMNS:
                told[COLUMNS[name]] = checked(Note if name == "notes" else Name, text)
            else:
                number = text.replace(".", "", 1).replace("-", "", 1).isdecimal()
                value: Any = float(text) if number else text
                told["truth"][TRUTHS[name].field] = checked(TRUTHS[name].hint, value)
        except BadInputError as error:
            wrong(column, f"{name}: {error.message}", error.hint)
    return told


def pressed(directory: Path, *, dry_run: bool) -> dict[Key, Summary]:
    """The completed runs of a directory by what was pressed, the newest of each; dry runs or none.

    A rehearsal is no press: what it has done is still to be pressed.
    """
    found = {}
    for row in rows(directory) if directory.is_dir() else []:
        if row.status == RunStatus.COMPLETED and row.simulated == dry_run:
            run = read_summary(Path(row.path))
            trial = trial_of(run.metadata.get("tags", ""))
            found[row.plan, row.specimen, row.operator, trial] = run
    return found


def changed(plan: Plan, runs: Sequence[Summary]) -> set[str]:
    """Names of files that runs were made with and that are others in the plan now."""
    now = {sha256(source.text.encode()).hexdigest() for source in plan.sources}
    found: set[str] = set()
    for each in runs:
        about: Any = (each.results or {}).get("run")
        files = about.get("files") if isinstance(about, dict) else None
        found |= {name for name, told in files.items() if told not in now} if files else set()
    return found


def first_looks(runs: Sequence[Summary]) -> list[tuple[float, float]]:
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
