"""The list of a batch, and what of it is pressed already, by the records on disk alone."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
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

TRUTHS = {f"simulation.{key.name}": key for key in keys(Simulation)}
"""Columns with the truth of a specimen in a dry run."""
KINDS: dict[str, Any] = {
    **dict.fromkeys(("specimen", "operator", "trial", "plan"), Name), "notes": Note,
    **{name: key.hint for name, key in TRUTHS.items()},
}  # fmt: skip
"""Every column."""
TRIAL = "trial="
"""Begin of the tag that says which repeat of a specimen a run is."""
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


def read_list(path: Path, plan: Path, *, dry_run: bool) -> list[Piece]:
    """The rows of a list in CSV, separated by comma, semicolon or tab, below a header.

    Args:
        path: the list; plans in it are named from its directory.
        plan: of rows that name none.
        dry_run: whether columns `simulation.…` may be there.

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
    for name, column in head:
        if name in TRUTHS and not dry_run:
            wrong(first, column, f"{name} is of a simulated specimen", "leave it out, or --dry-run")
        elif name not in KINDS:
            hint = f"{guess(name, KINDS)}columns: specimen, operator, trial, plan, notes"
            wrong(first, column, f"unknown column {name!r}", hint)
    names = [name for name, _ in head]
    if "specimen" not in names or len(lines) < 2 or len(set(names)) < len(names):
        wrong(first, 1, "no list", "one column `specimen`, others once each, a row for each press")
    for line, text in lines[1:] if not problems else ():
        cells, told, truth = list(_cells(text, separator)), dict[str, Any](), dict[str, Any]()
        if len(cells) > len(head):
            wrong(line, cells[len(head)][1], "more cells than the header has", "quote the text")
        for name, (value, column) in zip(names, cells, strict=False):
            try:
                if name in TRUTHS and value:
                    truth[TRUTHS[name].field] = checked(KINDS[name], _number(value))
                elif value:
                    told[name] = checked(KINDS[name], value)
            except BadInputError as error:
                wrong(line, column, f"{name}: {error.message}", error.hint)
        if "specimen" not in told:
            wrong(line, 1, "no specimen", "a name for each specimen")
            continue
        told["plan"] = source.beside(told["plan"]) if "plan" in told else plan
        piece = Piece(**told, truth=truth)
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


def _number(text: str) -> float | str:
    plain = text.replace(".", "", 1).replace("-", "", 1).isdecimal()
    return float(text) if plain else text


def pressed(directory: Path, *, dry_run: bool) -> dict[Key, Summary]:
    """The completed runs of a directory by what was pressed, the newest of each; dry runs or none.

    A rehearsal is no press: what it has done is still to be pressed.
    """
    found = {}
    for row in rows(directory) if directory.is_dir() else []:
        if row.status == RunStatus.COMPLETED and row.simulated == dry_run:
            run = read_summary(Path(row.path))
            tags = run.metadata.get("tags", "").split("\n")
            trial = next((tag[len(TRIAL) :] for tag in tags if tag.startswith(TRIAL)), "")
            found[row.plan, row.specimen, row.operator, trial] = run
    return found


def first_looks(runs: Sequence[Summary]) -> list[tuple[float, float]]:
    """Position of the first touch and deformation at the first level of every run, in m."""
    found = []
    for told in (each.results for each in runs):
        try:
            touch, level = told["measured"]["touches"][0], told["levels"][0]  # type: ignore[index]
            found.append((float(touch["position_m"]), float(level["deformation_m"])))
        except (KeyError, IndexError, TypeError):  # a record says what it likes
            continue
    return found
