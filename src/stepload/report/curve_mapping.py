"""What is stated about the files of another machine, kept as YAML for the next ones."""

from __future__ import annotations

from pathlib import Path

from stepload.errors import BadInputError
from stepload.plan.problems import PlanError
from stepload.plan.source import read_source
from stepload.plan.tree import Mapping, Place, Scalar, parse_tree
from stepload.record.curve_mapping import CurveMapping

KEPT = ("columns", "units", "sheet", "decimal", "encoding")


def load_mapping(path: Path) -> CurveMapping:
    """Read a file of these options as texts; raises PlanError with every problem at its place."""
    root, problems = parse_tree(source := read_source(path))
    options = dict[str, str | None]()
    for key, node in root.entries.items() if isinstance(root, Mapping) else ():
        text = node.text if isinstance(node, Scalar) else ""
        if key not in KEPT or not text:
            problems.append(node.place.problem(f"{key}: no text", f"keys: {', '.join(KEPT)}"))
            continue
        try:
            CurveMapping.of({key: text})
            options[key] = text
        except BadInputError as error:
            problems.append(node.place.problem(error.message, error.hint))
    roles = {name for name, _ in CurveMapping.of(options).units}
    if not problems and ("force" not in roles or not roles & {"position", "displacement"}):
        hint = 'units: "force=kN, position=mm"'
        problems.append(Place(source, 1, 1).problem("force and travel need a unit", hint))
    if problems:
        raise PlanError(tuple(problems))
    return CurveMapping.of(options)
