"""What is stated about the files of another machine, kept as YAML for the next ones."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

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
        for each in fields(self):
            try:
                given = _given(self, each.name)
                CurveMapping(**given).check()
            except BadInputError as error:
                yield each.name, error.message, error.hint
                continue
            roles = dict(given.get("units", ())).keys()
            if each.name == "units" and not (
                "force" in roles and roles & {"position", "displacement"}
            ):
                yield "units", "force and travel need a unit", "units: force=kN, position=mm"


def _given(kept: _Kept, *names: str) -> dict[str, Any]:
    """The fields of a mapping that are written; raises BadInputError."""
    texts = {name: text for name in names if (text := getattr(kept, name)) is not None}
    pairs = {name: parse_pairs(name, texts[name]) for name in ("units", "columns") if name in texts}
    return texts | pairs


def load_mapping(path: Path) -> CurveMapping:
    """Read a mapping file.

    Raises:
        PlanError: every problem with its place.
    """
    kept = read_file(_Kept, read_source(path))
    return CurveMapping(**_given(kept, *(each.name for each in fields(kept))))


def mapping_yaml(mapping: CurveMapping) -> str:
    """A mapping as such a file."""
    texts = mapping.texts().items()
    return "\n".join(f"{key}: {json.dumps(text, ensure_ascii=False)}" for key, text in texts)
