"""Verbs that take results out of the program: runs, export."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stepload.cli.run_paths import RunPath, runs_directory
from stepload.errors import BadInputError
from stepload.results.terminal import AsJson, Output

if TYPE_CHECKING:
    from stepload.data.catalog import RunRow


def runs(
    directory: Annotated[
        Path | None, typer.Argument(help="Where the runs are; default: `runs`, or STEPLOAD_RUNS.")
    ] = None,
    where: Annotated[
        list[str] | None,
        typer.Option("--where", help='Only runs whose column holds a text: "payload=sphere".'),
    ] = None,
    sort: Annotated[str, typer.Option("--sort", help="A column to sort by.")] = "started",
    falling: Annotated[bool, typer.Option("--falling", help="The largest first.")] = False,
    parquet: Annotated[
        Path | None, typer.Option("--parquet", help="Write them to a Parquet file as well.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the runs of a directory: payload, specimen, date, verdict, stiffness, how they ended.

    Example: stepload runs runs --where batch=B7 --sort chord_n_per_m
    """
    from dataclasses import asdict

    from stepload.data import catalog

    output, directory = Output(as_json=as_json), directory or runs_directory()
    wanted = dict(_pair(text) for text in where or ())
    found = catalog.chosen(catalog.rows(directory), wanted)
    found = catalog.ordered(found, sort, falling=falling)
    if parquet is not None:
        catalog.write_parquet(found, parquet)
    if found:
        columns = ("run", "started", "payload", "specimen", "verdict", "chord", "95 %", "ended")
        cells = [_cells(row) for row in found]
        told = [at for at in range(len(columns)) if any(row[at] for row in cells)]
        count = "1 run" if len(found) == 1 else f"{len(found)} runs"
        output.table(
            f"{count} in {directory}",
            [columns[at] for at in told],
            [[row[at] for at in told] for row in cells],
        )
    else:
        output.line(f"no run in {directory}")
    for row in found:
        if row.problem:
            output.line(f"not read: {row.path}: {row.problem}")
    output.result({"runs": [asdict(row) for row in found]})


def _pair(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise BadInputError(f"--where {text!r}", hint='COLUMN=TEXT, such as "payload=sphere"')
    return name.strip(), value.strip()


def _cells(row: RunRow) -> list[str]:
    from stepload.units import format_quantity

    def stiffness(value: float) -> str:
        return "" if math.isnan(value) else format_quantity(value, "N/m")

    low, high = stiffness(row.low_n_per_m), stiffness(row.high_n_per_m)
    simulated = "simulated, " if row.simulated else ""
    return [
        row.run_id, row.started[:16].replace("T", " "), row.payload, row.specimen,
        row.verdict.replace("_", " "), stiffness(row.chord_n_per_m),
        f"{low} to {high}" if low and high else "", f"{simulated}{row.status}",
    ]  # fmt: skip


def export(
    run: RunPath,
    out: Annotated[Path, typer.Option("--out", help="Directory the files are written to.")],
    csv: Annotated[bool, typer.Option("--csv", help="One CSV file for each table.")] = False,
    parquet: Annotated[bool, typer.Option("--parquet", help="One Parquet file each.")] = False,
    xlsx: Annotated[bool, typer.Option("--xlsx", help="One Excel book, a sheet each.")] = False,
    as_json: AsJson = False,
) -> None:
    """Write force–deformation curve, levels, touches and raw streams for other programs.

    Example: stepload export runs/20260801-101500-demo --csv --out tables
    """
    from stepload.data.export import Format, no_curve, write_tables
    from stepload.data.run import open_run

    output = Output(as_json=as_json)
    formats = [
        format for format, wanted in zip(Format, (csv, parquet, xlsx), strict=True) if wanted
    ]
    if not formats:
        raise BadInputError("say as what: --csv, --parquet or --xlsx")
    opened = open_run(run)
    if opened.simulated:
        output.line("SIMULATED: what is exported is no measurement")
    if opened.damage:
        output.line(f"the record ends early: {opened.damage}")
    if why := no_curve(opened):
        output.line(f"no curve, levels or touches: {why}")
    written = [path for each in formats for path in write_tables(opened, out, each)]
    for path in written:
        output.line(str(path))
    output.result({"simulated": opened.simulated, "partial": opened.partial, "files": written})
