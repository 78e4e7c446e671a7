"""Options of every verb that reads a curve of another machine, and how it shows what it read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

if TYPE_CHECKING:
    from stepload.record.curve_mapping import CurveMapping
    from stepload.record.curves import Curve
    from stepload.report.terminal import Output

Columns = Annotated[
    str | None, Option(help='Columns by name or number: "force=Fn (µN), position=3".')
]
Units = Annotated[str | None, Option(help='Their units: "force=kN, position=mm".')]
Sheet = Annotated[str | None, Option(help="Sheet of a workbook (.xlsx).")]
Decimal = Annotated[str | None, Option(help="Decimal mark: . or ,")]
Encoding = Annotated[str | None, Option(help="Encoding of the text, cp1252.")]
Specimen = Annotated[str | None, Option(help="Which of several tests in one file: 1, 2, … or all.")]
Look = Annotated[bool, Option("--look", help="Only show how the file is read.")]


def curve_mapping(file: Path | None, *pairs: str | None, **marks: str | None) -> CurveMapping:
    """What the options state; each replaces what the mapping file says.

    Args:
        pairs: the texts of --columns and --units.
    """
    from stepload.record.curve_mapping import CurveMapping, parse_pairs
    from stepload.report.curve_mapping import load_mapping

    found = CurveMapping() if file is None else load_mapping(file)
    given: dict[str, Any] = {key: text for key, text in marks.items() if text is not None}
    for key, text in zip(("columns", "units"), pairs, strict=True):
        if text is not None:
            new = parse_pairs(f"--{key}", text)
            kept = [each for each in getattr(found, key) if each[0] not in dict(new)]
            given[key] = (*kept, *new)
    return replace(found, **given)


def show_look(output: Output, files: Sequence[tuple[Path, Curve]]) -> None:
    """How files are read, and the mapping to keep for the next ones."""
    from stepload.report.curve_mapping import mapping_yaml
    from stepload.units import format_quantity

    data = []
    for path, curve in files:
        reading = curve.reading
        assert reading is not None
        data.append({"file": str(path), **asdict(reading)})
        rows = [
            (c.role, f"{c.number} {c.name!r}", c.unit, c.unit_from,
             *(format_quantity(x, c.role.rpartition("_")[2].upper().replace("S", "s")
                               .replace("M", "m"), 4) for x in (c.first, c.last)))
            for c in reading.columns
        ]  # fmt: skip
        columns = ("used as", "column", "unit", "unit from", "first", "last")
        output.table(str(path), columns, rows)
        for line in reading.about():
            output.line(line)
        output.line(f"\nto keep for --mapping FILE.yaml:\n{mapping_yaml(reading.mapping)}")
    output.result({"curves": data})
