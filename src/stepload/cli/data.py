"""Verbs that take results out of the program: runs, export, snippet."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from stepload.cli.options import RunOrCurve, RunPath, quantity, runs_directory
from stepload.errors import BadInputError
from stepload.report.terminal import AsJson, Output

if TYPE_CHECKING:
    from stepload.data.catalog import RunRow


def runs(
    directory: Annotated[
        Path | None, Argument(help="Where the runs are; default: `runs`, or STEPLOAD_RUNS.")
    ] = None,
    where: Annotated[
        list[str] | None, Option(help='Only runs whose column holds a text: "payload=sphere".')
    ] = None,
    sort: Annotated[str, Option(help="A column to sort by.")] = "started",
    falling: Annotated[bool, Option("--falling", help="The largest first.")] = False,
    parquet: Annotated[Path | None, Option(help="Write them to a Parquet file as well.")] = None,
    as_json: AsJson = False,
) -> None:
    """List the runs of a directory: payload, date, verdict, stiffness, end.

    Example: stepload runs runs --where batch=B7 --sort chord_n_per_m
    """
    from stepload.data import catalog
    from stepload.data.columns import write_columns

    output, directory = Output(as_json=as_json), directory or runs_directory()
    wanted = dict(_pair(text) for text in where or ())
    found = catalog.chosen(catalog.rows(directory), wanted, sort, falling=falling)
    if parquet is not None:
        columns = {name: [getattr(row, name) for row in found] for name in catalog.COLUMNS}
        write_columns(columns, parquet)
    if found:
        heads = ("run", "started", "payload", "specimen", "verdict", "chord", "95 %", "ended")
        cells = [_cells(row) for row in found]
        told = [at for at in range(len(heads)) if any(row[at] for row in cells)]
        count = "1 run" if len(found) == 1 else f"{len(found)} runs"
        rows = [[row[at] for at in told] for row in cells]
        output.table(f"{count} in {directory}", [heads[at] for at in told], rows)
    else:
        output.line(f"no run in {directory}")
    for row in found:
        if row.problem:
            output.line(f"not read: {row.path}: {row.problem}")
    output.result({"$schema": "urn:stepload:runs:1", "runs": [row.model_dump() for row in found]})


def _pair(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise BadInputError(f"--where {text!r}", hint='COLUMN=TEXT, such as "payload=sphere"')
    return name.strip(), value.strip()


def stiffness_cell(value: float | None) -> str:
    """A stiffness as it stands in a table; "" for none."""
    from stepload.units import format_quantity

    return "" if value is None or math.isnan(value) else format_quantity(value, "N/m")


def interval_cell(low: float | None, high: float | None) -> str:
    """An interval of a stiffness as it stands in a table; "" for none."""
    ends = stiffness_cell(low), stiffness_cell(high)
    return " to ".join(ends) if all(ends) else ""


def _cells(row: RunRow) -> list[str]:
    return [
        row.run_id[:6], row.started[:16].replace("T", " "), row.payload, row.specimen,
        row.verdict.replace("_", " "), stiffness_cell(row.chord_n_per_m),
        interval_cell(row.low_n_per_m, row.high_n_per_m),
        f"{'simulated, ' if row.simulated else ''}{row.status}",
    ]  # fmt: skip


def export(
    run: RunPath,
    out: Annotated[
        Path | None, Option(help="Directory for the files; default: `tables` beside the record.")
    ] = None,
    csv: Annotated[bool, Option("--csv", help="One CSV file for each table.")] = False,
    parquet: Annotated[bool, Option("--parquet", help="One Parquet file each.")] = False,
    xlsx: Annotated[bool, Option("--xlsx", help="One Excel book, a sheet each.")] = False,
    hdf5: Annotated[bool, Option("--hdf5", help="One HDF5 file of NeXus groups.")] = False,
    as_json: AsJson = False,
) -> None:
    """Write curve, levels, touches and raw streams for other programs.

    Example: stepload export runs/20260801-101500-demo --csv
    """
    from stepload.data.catalog import PART, RECORD
    from stepload.data.export import Format, tables, write_tables
    from stepload.data.run import open_run

    output = Output(as_json=as_json)
    wanted = dict(zip(Format, (csv, parquet, xlsx, hdf5), strict=True))
    if not any(wanted.values()):
        raise BadInputError("say as what: --csv, --parquet, --xlsx or --hdf5")
    opened = open_run(run)
    if opened.simulated:
        output.line("SIMULATED: what is exported is no measurement")
    if opened.damage:
        output.line(f"the record ends early: {opened.damage}")
    parts, why = tables(opened)
    if why:
        output.line(f"no curve, levels or touches: {why}")
    record = opened.path
    of_a_run = record.name in (RECORD, PART)
    out = out or record.with_name("tables" if of_a_run else f"{record.stem}-tables")
    written = [
        path for form in Format if wanted[form] for path in write_tables(opened, parts, out, form)
    ]
    for path in written:
        output.line(str(path))
    output.result({"simulated": opened.simulated, "partial": opened.partial, "files": written})


def snippet(
    file: RunOrCurve,
    simulator: Annotated[str, Option("--for", help="mujoco (MJCF) or drake (SDFormat).")],
    at: Annotated[
        float | None, quantity("--at", "N", 'Operating force, "150 N"; half of the top if none.')
    ] = None,
    stiffness: Annotated[
        str, Option(help="tangent, or chord from 10 % of that force.")
    ] = "tangent",
    mass: Annotated[
        float | None, quantity("--mass", "kg", 'MuJoCo: effective mass at the contact, "2 kg".')
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print the identified law as contact parameters of a simulator.

    Example: stepload snippet runs/20260801-101500-demo --for mujoco --mass "1 kg"
    """
    from stepload.report import snippets
    from stepload.report.conditions import Stated
    from stepload.report.from_file import results_of_file

    if simulator not in snippets.SIMULATORS:
        raise BadInputError(f"--for {simulator!r}", hint=", ".join(snippets.SIMULATORS))
    if stiffness not in snippets.KINDS:
        raise BadInputError(f"--stiffness {stiffness!r}", hint=" or ".join(snippets.KINDS))
    told = results_of_file(file, Stated())
    spring = snippets.spring_of(told.found, at_n=at, kind=stiffness, simulated=told.simulated)
    text = snippets.snippet(spring, simulator, mass_kg=mass)
    output = Output(as_json=as_json)
    output.line(text.rstrip("\n"))
    output.result({**asdict(spring), "for": simulator, "snippet": text})
