"""Options of every verb that reads a curve of another machine, and how it shows what it read."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

if TYPE_CHECKING:
    from stepload.record.curve_mapping import CurveMapping
    from stepload.report.terminal import Output

SI = {"time_s": "s", "position_m": "m", "displacement_m": "m", "force_n": "N", "lateral_n": "N"}

Columns = Annotated[
    str | None, Option(help='Columns by name or number: "force=Fn (µN), position=3".')
]
Units = Annotated[str | None, Option(help='Their units: "force=kN, position=mm".')]
Sheet = Annotated[str | None, Option(help="Sheet of a workbook (.xlsx).")]
Decimal = Annotated[str | None, Option(help="Decimal mark: . or ,")]
Encoding = Annotated[str | None, Option(help="Encoding of the text, cp1252.")]
Specimen = Annotated[str | None, Option(help="Which of several tests in one file: 1, 2, … or all.")]
Look = Annotated[bool, Option("--look", help="Only show how the file is read.")]


def curve_mapping(file: Path | str | None, *options: str | None) -> CurveMapping:
    """What options in the order above state; each replaces what the mapping file says."""
    from stepload.record.curve_mapping import CurveMapping
    from stepload.report.curve_mapping import load_mapping

    found = CurveMapping() if file is None else load_mapping(Path(file))
    names = ("columns", "units", "sheet", "decimal", "encoding", "specimen")
    return found.joined(CurveMapping.of(dict(zip(names, options, strict=True))))


def show_look(output: Output, files: Sequence[tuple[Path, CurveMapping]]) -> None:
    """How files are read, and the mapping to keep for the next ones."""
    from stepload.record.curves import read_curve
    from stepload.record.untrusted import untrusted
    from stepload.report.curve import machine_doubts
    from stepload.report.terminal import wrapped
    from stepload.units import format_quantity

    data = []
    for path, mapping in files:
        with untrusted(path):
            curve = read_curve(path, mapping)
        reading = curve.reading
        assert reading is not None
        data.append({"file": str(path), **asdict(reading)})
        rows = [
            (each.role, f"{each.number} {each.name!r}", each.unit, each.unit_from,
             *(format_quantity(x, SI[each.role], 4) for x in (each.lowest, each.highest)))
            for each in reading.columns
        ]  # fmt: skip
        heads = ("used as", "column", "unit", "unit from", "lowest", "highest")
        output.table(str(path), heads, rows)
        sheet = f" sheet {reading.sheet!r}" if reading.sheet else ""
        names = f"names in line {reading.names_line}" if reading.names_line else "no names"
        unused = f"not used: {', '.join(reading.unused)[:200]}" if reading.unused else ""
        system = "position: --system-stiffness takes the machine's own deflection out"
        of = f"{reading.encoding}{sheet}, {reading.delimiter!r}, decimal mark {reading.decimal}"
        lines = (f"{of}, {names}", *[*reading.lines()][1:], unused, *reading.notes,
                 *machine_doubts(curve), system * (curve.position_m is not None))  # fmt: skip
        for line in filter(None, lines):
            output.line(wrapped(line, 2))
        output.line("\nto keep for --mapping FILE.yaml:")
        for key, text in reading.mapping.texts().items():
            output.line(f"{key}: {json.dumps(text, ensure_ascii=False)}")
    output.result({"curves": data})
