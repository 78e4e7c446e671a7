"""What is confirmed once per rig, hazards read and wiring checked, and kept in the rig file."""

from __future__ import annotations

import json
from codecs import BOM_UTF8
from collections.abc import Iterable
from collections.abc import Mapping as Keys
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

from stepload.errors import BadInputError
from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.plan.places import tree_of
from stepload.plan.problems import PlanError
from stepload.plan.references import names_a_file
from stepload.plan.source import Source
from stepload.plan.tree import Mapping, Scalar
from stepload.plan.whole_file import alone_in, replace_file

PAGE = "docs/risk-assessment.md among the sources of stepload"

HAZARDS = (
    "stepload is no safety function: it runs on a computer without guarantees, and what it"
    " stops is stopped by software.",
    "An arm that presses can crush a hand. Nobody reaches between tool and plate while it is"
    " in remote control.",
    "The robot's own safety limits (force, speed, planes) are what protects people. They are"
    " set on its pendant by whoever is responsible for the cell, and tested.",
    "An emergency stop within reach of whoever starts a run is what helps when the software"
    " does not. It leaves the force on: know how the arm is freed by hand.",
    "A payload beyond its strength can break and throw splinters: goggles, a screen.",
    "The start pose must have free way behind it and in front of it: the arm moves back before it"
    " moves forth.",
    "A wrong number in the plan (strength, sign, range, stiffness) makes every limit wrong.",
)
"""Shown before the first motion of a rig; docs/risk-assessment.md has them with what to do."""
BY, ON, WIRED = "hazards_read_by", "hazards_read_on", "wiring_checked_on"

WIRING = (
    "A wrong axis or sign of the force, or a wrong approach, is stopped at the first touch, at"
    " about 1 N (R11); a push by hand on the tool (stepload setup) shows it before."
)
"""How the wiring of a rig is checked."""


def hazards_read(plan: Plan) -> bool:
    """Whether somebody has confirmed, by name and day, to have read the hazards of this rig."""
    return bool(plan.rig.hazards_read_by.strip()) and plan.rig.hazards_read_on is not None


def read_words(plan: Plan) -> str:
    """Whether, by whom and when the hazards were read, in words."""
    rig = plan.rig
    return f"read {rig.hazards_read_on}" if hazards_read(plan) else "not read yet"


def rig_argument(plan: Plan) -> str:
    """What `stepload hazards` takes for a plan's rig: profile, rig file, or the plan itself."""
    node = tree_of(plan.path)
    rig = node.entries.get("rig") if isinstance(node, Mapping) else None
    if not (isinstance(rig, Scalar) and isinstance(rig.value, str)):
        return str(plan.path)
    return str(plan.path.parent / rig.value) if names_a_file(rig.value) else rig.value


def read_by(name: str, day: date) -> dict[str, str | date]:
    """The keys of a rig that say who has read its hazards."""
    return {BY: name, ON: day}


def rows_of(keys: Keys[str, Any]) -> list[str]:
    """The lines of a rig file that hold these keys."""
    return [
        f"{key}: {json.dumps(value, ensure_ascii=False) if isinstance(value, str) else value}"
        for key, value in keys.items()
    ]


def keep(plan: Plan, keys: Keys[str, Any]) -> Path | None:
    """Write what was confirmed into the file in which the plan's rig stands.

    Returns:
        The file; None where the rig is no block of keys of a file (a profile's name alone, or
        written in braces), or has one of the keys: nothing is changed then.

    Raises:
        BadInputError: the file cannot be written, or the name is no text for a plan; it is as it
            was.
    """
    files = plan.path, _rig_file(plan.path)
    with alone_in(*(path.resolve().parent for path in files)):  # see `_keep`: what it takes back
        return _keep(plan, keys)


def _keep(plan: Plan, keys: Keys[str, Any]) -> Path | None:
    try:
        wanted = replace(load_plan(plan.path).rig, **dict(keys))
    except ValueError:  # pydantic's: a name that is too long, say
        raise _not_added(plan.path, keys) from None
    found = _rig_block(plan.path, keys)
    if found is None:
        return None
    source, line, indent = found
    path = (source.path or plan.path).resolve()
    at, end = source.start_of(line), "\r\n" if "\r\n" in source.text else "\n"
    rows = "".join(f"{indent}{row}{end}" for row in rows_of(keys))
    bom = BOM_UTF8 if source.data.startswith(BOM_UTF8) else b""
    data = bom + (source.text[:at] + rows + source.text[at:]).encode()
    _write(path, data)
    try:
        sound = load_plan(plan.path).rig == wanted
    except PlanError:
        sound = False
    if not sound:
        if path.read_bytes() == data:  # else somebody has changed it since
            _write(path, source.data)
        raise _not_added(path, keys)
    return path


def _not_added(path: Path, keys: Keys[str, Any]) -> BadInputError:
    hint = f"write them below `rig:` yourself: {'; '.join(rows_of(keys))}"
    return BadInputError(f"{path}: the lines could not be added", hint=hint)


def _rig_file(plan_path: Path) -> Path:
    """The file in which a plan's rig stands: its own, or the one it names."""
    node = tree_of(plan_path)
    rig = node.entries.get("rig") if isinstance(node, Mapping) else None
    if isinstance(rig, Scalar) and isinstance(rig.value, str) and names_a_file(rig.value):
        return plan_path.parent / rig.value
    return plan_path


def _rig_block(plan_path: Path, keys: Iterable[str]) -> tuple[Source, int, str] | None:
    """File, line of the first key (from 1) and indentation of a plan's rig."""
    rig_file = _rig_file(plan_path)
    node = tree_of(rig_file)
    if rig_file == plan_path and isinstance(node, Mapping):
        node = node.entries.get("rig", node)
    if not isinstance(node, Mapping) or not node.keys or any(key in node.keys for key in keys):
        return None
    first = next(iter(node.keys.values()))
    indent = first.source.lines[first.line - 1][: first.column - 1]
    return None if indent.strip() else (first.source, first.line, indent)


def _write(path: Path, data: bytes) -> None:
    """Replace a file's content; it is there whole, old or new, whatever happens."""
    try:
        replace_file(path, data)
    except OSError as error:
        raise BadInputError(f"cannot write {path}: {error.strerror}") from error
