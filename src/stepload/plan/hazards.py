"""What is confirmed once per rig, hazards read and wiring checked, and kept in the rig file."""

from __future__ import annotations

import json
from codecs import BOM_UTF8
from collections.abc import Mapping as Keys
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

from stepload.errors import BadInputError
from stepload.plan.compose import at
from stepload.plan.load import load_plan
from stepload.plan.model import Plan, Rig
from stepload.plan.problems import PlanError
from stepload.plan.references import names_a_file, tree_of
from stepload.plan.tree import Mapping, Node, Scalar
from stepload.plan.whole_file import replace_file

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
    path, node = _rig_of(plan.path)
    return str(node.value) if isinstance(node, Scalar) else str(path)


def _rig_of(plan_path: Path) -> tuple[Path, Node | None]:
    """The file in which a plan's rig stands, its own or the one it names, and its node there."""
    node = at(tree_of(plan_path), ("rig",))
    if isinstance(node, Scalar) and names_a_file(str(node.value)):
        path = plan_path.parent / str(node.value)
        return path, tree_of(path)
    return plan_path, node


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
    """Write what was confirmed into the file in which the plan's rig stands, before its first key.

    Returns:
        The file; None where the rig is no block of keys of a file (a profile's name alone, or
        written in braces), or has one of the keys: nothing is changed then.

    Raises:
        BadInputError: the file cannot be written, or the plan does not say so then; it is as it
            was.
    """
    _, node = _rig_of(plan.path)
    if not isinstance(node, Mapping) or not node.keys or node.keys.keys() & keys.keys():
        return None
    first = next(iter(node.keys.values()))
    source, indent = first.source, first.source.lines[first.line - 1][: first.column - 1]
    if indent.strip():
        return None
    path = (source.path or plan.path).resolve()
    at_row, end = source.start_of(first.line), "\r\n" if "\r\n" in source.text else "\n"
    rows = "".join(f"{indent}{row}{end}" for row in rows_of(keys))
    bom = BOM_UTF8 if source.data.startswith(BOM_UTF8) else b""
    try:
        wanted = replace(load_plan(plan.path).rig, **dict(keys))
        replace_file(path, bom + (source.text[:at_row] + rows + source.text[at_row:]).encode())
        if _sound(plan.path, wanted):
            return path
        replace_file(path, source.data)
    except OSError as error:
        raise BadInputError(f"cannot write {path}: {error.strerror}") from error
    except ValueError:  # pydantic's: a name that is too long, say
        pass
    hint = f"write them below `rig:` yourself: {'; '.join(rows_of(keys))}"
    raise BadInputError(f"{path}: the lines could not be added", hint=hint)


def _sound(path: Path, wanted: Rig) -> bool:
    """Whether a plan can be read and has this rig."""
    try:
        return load_plan(path).rig == wanted
    except PlanError:
        return False
