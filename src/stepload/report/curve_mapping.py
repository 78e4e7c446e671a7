"""What is stated about the files of another machine, kept as YAML for the next ones."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

from pydantic.dataclasses import dataclass

import stepload.declaration.quantities as q
from stepload.declaration.sections import CHECKED, SECTION, Contradiction
from stepload.errors import BadInputError
from stepload.plan.reader import read_file
from stepload.plan.source import read_source
from stepload.record.curve_mapping import CurveMapping, parse_pairs


@dataclass(frozen=True, config=SECTION)
class _Kept:
    """The options of the command line, as texts."""

    units: q.Tag
    """Units, force=kN, position=mm."""
    columns: q.Tag | None = None
    """Names or numbers of columns, force=Fn (µN), position=3."""
    sheet: q.Name | None = None
    """Sheet of a workbook."""
    decimal: q.Name | None = None
    """Decimal mark, "." or ","."""
    encoding: q.Name | None = None
    """Encoding of the text."""

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        for name in ("units", "columns"):
            try:
                pairs = parse_pairs(name, getattr(self, name) or "force=N, position=m")
                CurveMapping(**{name: pairs}, decimal=self.decimal or "").check()
            except BadInputError as error:
                yield name, error.message, error.hint
                continue
            roles = {role for role, _ in pairs}
            if name == "units" and not ("force" in roles and len(roles & _TRAVELS) == 1):
                yield "units", "force and travel need a unit", "units: force=kN, position=mm"


_TRAVELS = {"position", "displacement"}


def load_mapping(path: Path) -> CurveMapping:
    """Read a mapping file.

    Raises:
        PlanError: every problem with its place.
    """
    kept = read_file(_Kept, read_source(path))
    given = {each.name: text for each in fields(kept) if (text := getattr(kept, each.name))}
    pairs = {key: parse_pairs(key, given.pop(key)) for key in ("columns", "units") if key in given}
    return CurveMapping(**given, **pairs)


def mapping_yaml(mapping: CurveMapping) -> str:
    """A mapping as such a file."""
    texts = {each.name: getattr(mapping, each.name) for each in fields(mapping)}
    shown = {
        key: value if isinstance(value, str) else ", ".join(map("=".join, value))
        for key, value in texts.items()
        if value
    }
    return "\n".join(f"{k}: {json.dumps(v, ensure_ascii=False)}" for k, v in shown.items())
