"""The list of a batch, and what of it is pressed already, by the records on disk alone."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stepload.data.catalog import rows
from stepload.declaration.quantities import Name
from stepload.errors import BadInputError, guess
from stepload.plan.model import Plan
from stepload.plan.problems import PlanError, Problem
from stepload.plan.reader import checked
from stepload.plan.source import read_source
from stepload.plan.tags import tagged
from stepload.record.outcome import RunStatus
from stepload.record.summary import Summary, read_summary

COLUMNS = ("specimen", "operator", "trial", "plan")
TRIAL = "trial="
"""Begin of the tag that says which repeat of a specimen a run is."""
Key = tuple[str, str, str, str]
"""Plan, specimen, operator and trial: what tells one press from another."""


@dataclass(frozen=True, slots=True)
class Piece:
    """One press that a list asks for."""

    plan: Path
    specimen: str
    operator: str = ""
    trial: str = ""

    @property
    def name(self) -> str:
        """What a person calls it."""
        trial = self.trial and f"trial {self.trial}"
        return ", ".join(filter(None, (self.specimen, self.operator, trial)))

    def of(self, plan: Plan, batch: str) -> Plan:
        """The plan of this press, from the plan that it names."""
        told = {"specimen": self.specimen, "operator": self.operator, "batch": batch}
        told |= {"trial": self.trial}
        return tagged(plan, [f"{key}={value}" for key, value in told.items() if value])

    def key(self, plan: Plan) -> Key:
        """What its record is found by; `plan` is the one that it names."""
        return plan.name, self.specimen, self.operator or plan.record.operator, self.trial


def read_list(path: Path, plan: Path) -> list[Piece]:
    """The rows of a list in CSV, separated by comma, semicolon or tab, below a header.

    Plans in it are named from its directory; `plan` is that of rows that name none.

    Raises:
        PlanError: every problem, with line and column.
    """
    source = read_source(path)
    problems, pieces = list[Problem](), dict[tuple[object, ...], tuple[int, Piece]]()

    def wrong(line: int, column: int, message: str, hint: str) -> None:
        problems.append(source.problem(line, column, message, hint))

    lines = [(at, line) for at, line in enumerate(source.lines, 1) if line.strip()]
    first, header = lines[0] if lines else (1, "specimen")
    separator = max(",;\t", key=header.count)
    head = [(name.lower(), column) for name, column in _cells(header, separator)]
    names = [name for name, _ in head]
    for name, column in head:
        if name not in COLUMNS:
            hint = f"{guess(name, COLUMNS)}columns: {', '.join(COLUMNS)}"
            wrong(first, column, f"unknown column {name!r}", hint)
    if "specimen" not in names or len(lines) < 2 or len(set(names)) < len(names):
        wrong(first, 1, "no list", "one column `specimen`, others once each, a row for each press")
    for line, text in lines[1:] if not problems else ():
        cells, told = list(_cells(text, separator)), dict[str, Any]()
        if len(cells) > len(head):
            wrong(line, cells[len(head)][1], "more cells than the header has", "quote the text")
        for name, (value, column) in zip(names, cells, strict=False):
            try:
                told |= {name: checked(Name, value)} if value else {}
            except BadInputError as error:
                wrong(line, column, f"{name}: {error.message}", error.hint)
        if "specimen" not in told:
            wrong(line, 1, "no specimen", "a name for each specimen")
            continue
        told["plan"] = source.beside(told["plan"]) if "plan" in told else plan
        piece = Piece(**told)
        same, _ = pieces.setdefault((piece.plan, piece.name), (line, piece))
        if same != line:
            wrong(line, 1, f"{piece.name} is in line {same}", "tell repeats apart: column `trial`")
    if problems:
        raise PlanError(tuple(problems))
    return [piece for _, piece in pieces.values()]


def _cells(line: str, separator: str) -> Iterator[tuple[str, int]]:
    """The cells of a line with their columns, from 1."""
    cell = rf'(^|{separator})(?: *"((?:[^"]|"")*)" *(?={separator}|$)|([^{separator}]*))'
    for found in re.finditer(cell, line):
        quoted = found[2]
        text = found[3] if quoted is None else quoted.replace('""', '"')
        yield text.strip(), found.end(1) + 1


def pressed(directory: Path, *, dry_run: bool) -> dict[Key, Summary]:
    """The completed runs of a directory by what was pressed, the newest of each; dry runs or none.

    A rehearsal is no press: what it has done is still to be pressed.
    """
    found = {}
    for row in rows(directory) if directory.is_dir() else []:
        if row.status == RunStatus.COMPLETED and row.simulated == dry_run:
            run = read_summary(Path(row.path))
            tags = run.metadata.get("tags", "").split("\n")
            trial = next((tag[len(TRIAL) :] for tag in reversed(tags) if tag.startswith(TRIAL)), "")
            found[row.plan, row.specimen, row.operator, trial] = run
    return found
