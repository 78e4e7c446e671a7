"""The verb `map`: the payloads that a rig can measure, and what would extend the range."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stepload.cli.sheet import check_sheet, write_sheet
from stepload.results.terminal import AsJson, Output


def map(
    rig: Annotated[str, typer.Argument(help="Rig profile, or a rig file (YAML).")],
    payload: Annotated[
        list[Path] | None,
        typer.Option("--payload", help="Payload file, beside those that come with stepload."),
    ] = None,
    top_force: Annotated[
        str | None, typer.Option("--top-force", help='Top force with its unit: "300 N".')
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Directory for the picture and the figures.")
    ] = None,
    parquet: Annotated[
        Path | None, typer.Option("--parquet", help="Write every cell to a Parquet file.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Say which payloads a rig can measure, and what narrows their intervals.

    Example: stepload map stvf --payload procedures/payloads/plastic-sphere.yaml --out map
    """
    from stepload.data.columns import check_parquet, write_columns
    from stepload.design import map_report as report
    from stepload.design.map import make, shipped_payloads
    from stepload.plan.room_to_write import check_room
    from stepload.units import parse_quantity

    output = Output(as_json=as_json)
    if parquet is not None:
        check_parquet(parquet)
        check_room("--parquet", parquet)
    if out is not None:
        check_sheet(out, "map")
    found = make(
        rig,
        payload or [],
        shipped=shipped_payloads(),
        top_n=parse_quantity(top_force, "N") if top_force is not None else None,
        on_start=lambda cells: output.line(f"{cells} cells"),
    )
    said = report.data(found)
    output.line(f"{found.rig.name} at {found.rig.top_n:.4g} N: {found.rig.note}")
    output.tables(report.payload_table(found), report.reach_table(found))
    for sentence in said["answers"]:
        output.line(sentence)
    if out is not None:
        from stepload.design.map_picture import drawn

        output.line(write_sheet(out, "map", lambda: drawn(found), said))
    if parquet is not None:
        cells = said["cells"]
        write_columns({name: [each[name] for each in cells] for name in cells[0]}, parquet)
        output.line(f"written: {parquet}")
    output.result(said)
