"""The verb `map`: the payloads that a rig can measure, and what would extend the range."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stepload.cli.sheet import check_sheet, write_sheet
from stepload.results.terminal import AsJson, Output, Processes


def map(
    rig: Annotated[str, typer.Argument(help="Rig profile, or a rig file (YAML).")],
    payload: Annotated[
        list[Path] | None,
        typer.Option("--payload", help="Payload file, beside those that come with stepload."),
    ] = None,
    top_force: Annotated[
        str | None, typer.Option("--top-force", help='Top force with its unit: "300 N".')
    ] = None,
    samples: Annotated[
        int, typer.Option("--samples", min=1, help="Simulated identifications of each cell.")
    ] = 250,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of all random numbers.")] = 1,
    processes: Processes = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Directory for the picture and the figures.")
    ] = None,
    parquet: Annotated[
        Path | None, typer.Option("--parquet", help="Write every cell to a Parquet file.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Say by simulation which payloads a rig can measure, and what to buy to measure more.

    Example: stepload map stvf --payload procedures/payloads/plastic-sphere.yaml --out map
    """
    from stepload.data.columns import check_parquet, write_columns
    from stepload.design import atlas
    from stepload.design import atlas_tables as tables
    from stepload.plan.room_to_write import check_room
    from stepload.runner.pool import Pool
    from stepload.units import parse_quantity

    output = Output(as_json=as_json)
    if parquet is not None:
        check_parquet(parquet)
        check_room("--parquet", parquet)
    if out is not None:
        check_sheet(out, "map")
    with Pool(processes) as pool:
        found = atlas.make(
            rig,
            payload or [],
            shipped=atlas.shipped_payloads(),
            top_n=parse_quantity(top_force, "N") if top_force is not None else None,
            samples=samples,
            seed=seed,
            pool=pool,
            on_start=lambda cells: output.line(
                f"{cells} cells of {samples} simulated identifications each"
            ),
        )
    said = tables.data(found)
    output.line(f"{found.rig.name} at {found.rig.top_n:.4g} N: {found.rig.note}")
    output.tables(tables.payload_table(found), tables.reach_table(found))
    for sentence in said["answers"]:
        output.line(sentence)
    output.line()
    output.line(f"Drawn: {said['drawn']}.")
    output.line(f"Not drawn: {said['not_drawn']}.")
    output.line(
        f"Left out: {said['left_out']}. Of {said['checked']} runs that were put through the whole "
        f"pipeline too, {said['agreed']} have the same verdict; the headlines of those IDENTIFIED "
        f"differ by {said['largest_difference']:.1%} at most."
    )
    output.line(
        f"Of {said['identified']} runs called IDENTIFIED the headline of "
        f"{said['identified_and_false']} is further than 1/t from the truth, the interval of "
        f"{said['interval_true']} holds it."
    )
    if out is not None:
        from stepload.design import atlas_picture as picture

        output.line(write_sheet(out, "map", lambda: picture.drawn(found), said))
    if parquet is not None:
        cells = said["cells"]
        write_columns({name: [each[name] for each in cells] for name in cells[0]}, parquet)
        output.line(f"written: {parquet}")
    output.result(said)
