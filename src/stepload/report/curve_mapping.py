"""What is stated about the files of another machine, kept as YAML for the next ones."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pydantic.dataclasses import dataclass

import stepload.declaration.quantities as q
from stepload.declaration.sections import CHECKED, SECTION, Contradiction
from stepload.errors import BadInputError
from stepload.plan.reader import read_file
from stepload.plan.source import read_source
from stepload.record.curve_mapping import CurveMapping


@dataclass(frozen=True, config=SECTION)
class _Kept:
    """The options of the command line, as texts."""

    units: q.Tag
    """Units, force=kN, position=mm."""
    columns: q.Tag = ""
    """Names or numbers of columns, force=Fn (µN), position=3."""
    sheet: q.Tag = ""
    """Sheet of a workbook."""
    decimal: q.Tag = ""
    """Decimal mark, "." or ","."""
    encoding: q.Tag = ""
    """Encoding of the text."""

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        for key, text in vars(self).items():
            try:
                roles = dict(CurveMapping.of({key: text}).units).keys()
            except BadInputError as error:
                yield key, error.message, error.hint
            else:
                if key == "units" and ("force" not in roles or roles <= {"force", "time"}):
                    yield key, "force and travel need a unit", "units: force=kN, position=mm"


def load_mapping(path: Path) -> CurveMapping:
    """Read a mapping file; raises PlanError with every problem at its place."""
    return CurveMapping.of(vars(read_file(_Kept, read_source(path))))
