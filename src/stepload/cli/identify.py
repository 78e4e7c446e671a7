"""The verb `identify`, which evaluates existing data."""

from __future__ import annotations

import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

import stepload.cli.curves as c
from stepload.cli.data import interval_cell, stiffness_cell
from stepload.cli.options import Plastic, Rough, RunOrCurve, Surface, TipRadius, quantity
from stepload.errors import BadInputError
from stepload.report.terminal import AsJson, Output, wrapped

if TYPE_CHECKING:
    from stepload.data.reevaluation import Again
    from stepload.report.conditions import Stated

EVERY_S = 10.0


def identify(
    file: RunOrCurve,
    system_stiffness: Annotated[
        float | None, quantity("--system-stiffness", "N/m", 'K_s to take out, "3.49e6 N/m".')
    ] = None,
    system_stiffness_sigma: Annotated[
        str | None, Option(help='Its standard uncertainty, "70 kN/m", "2 %".')
    ] = None,
    msde: Annotated[
        float | None, quantity("--msde", "m", 'Smooth deformation error, "0.54 um".')
    ] = None,
    smooth_length: Annotated[
        float | None, quantity("--smooth-length", "N", 'Force it stays alike over, "50 N".')
    ] = None,
    force_noise: Annotated[
        float | None, quantity("--force-noise", "N", 'Noise (σ) of a force sample, "0.7 N".')
    ] = None,
    position_noise: Annotated[
        float | None, quantity("--position-noise", "m", 'Noise (σ) of a position, "0.2 um".')
    ] = None,
    drift: Annotated[
        float | None, quantity("--drift", "m/s", 'Drift (σ) of the travel, one cycle, "0.05 nm/s".')
    ] = None,
    nonlinearity: Annotated[
        float | None, quantity("--nonlinearity", "%", 'Bend of the force, "0.2 %" of the peak.')
    ] = None,
    secant_force: Annotated[
        float | None, quantity("--secant-force", "N", 'Force of the secant, "300 N".')
    ] = None,
    elastic_limit: Annotated[
        float | None, quantity("--elastic-limit", "N", 'F_c, to flag data above it, "727 N".')
    ] = None,
    tared: Annotated[
        bool,
        Option("--tared", help="A curve's force was tared in free air: it has none to see."),
    ] = False,
    payload: Annotated[
        Path | None, Option(help="YAML of the payload: its law and F_c check the units.")
    ] = None,
    rough: Rough = False,
    plastic: Plastic = False,
    surface: Surface = None,
    tip_radius: TipRadius = None,
    branch: Annotated[
        str | None, Option(help="Chord that is the result: loading, unloading, reloading.")
    ] = None,
    columns: c.Columns = None,
    units: c.Units = None,
    sheet: c.Sheet = None,
    decimal: c.Decimal = None,
    encoding: c.Encoding = None,
    specimen: c.Specimen = None,
    mapping: Annotated[Path | None, Option(help="YAML with these, as --look prints it.")] = None,
    look: c.Look = False,
    kind: Annotated[str, Option(help="payload or system.")] = "payload",
    every: Annotated[
        bool, Option("--all", help="FILE is a directory: every record in it and below.")
    ] = False,
    processes: Annotated[int | None, Option(min=1, help="For --all; all cores by default.")] = None,
    out: Annotated[
        Path | None, Option(help="New directory for results.json and report.html.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Identify the contact law from a record, or a curve of another machine.

    Example: stepload identify runs/20260801-101500-demo --out again
    """
    from stepload.plan.load import load_payload
    from stepload.record.curve_mapping import CurveMapping
    from stepload.report.conditions import Stated, with_payload
    from stepload.report.from_file import is_record, results_of_file, system_results_of_file
    from stepload.report.identified import identification_data
    from stepload.report.run_document import identification_document, system_document
    from stepload.report.run_results import about, system_data
    from stepload.report.tip_factors import tip_factors

    stated = Stated(
        system_stiffness_n_per_m=system_stiffness,
        system_stiffness_sigma_n_per_m=_sigma(system_stiffness_sigma, system_stiffness),
        smooth_error_m=msde,
        secant_force_n=secant_force,
        elastic_limit_n=elastic_limit,
        smooth_length_n=smooth_length,
        force_noise_n=force_noise,
        position_noise_m=position_noise,
        travel_drift_m_per_s=drift,
        nonlinearity=nonlinearity,
        branch=branch,
        tared=tared,
    )
    factors = tip_factors(
        None if payload is None else load_payload(payload), rough=rough, plastic=plastic,
        surface=surface, radius_m=tip_radius,
    )  # fmt: skip
    if payload is not None:
        stated = with_payload(payload, stated)
    output = Output(as_json=as_json)
    wanted = c.curve_mapping(mapping, columns, units, sheet, decimal, encoding, specimen)
    if is_record(file) and (look or wanted != CurveMapping()):
        raise BadInputError(f"{file}: a record of stepload", hint="these options are for curves")
    if look:
        c.show_look(output, [(file, wanted)])
        return
    if factors is not None and (every or kind != "payload"):
        raise BadInputError("--rough and --plastic are for one curve of a payload")
    if every:
        if kind != "payload" or out is not None:
            raise BadInputError(
                "--all with --out or another --kind", hint="--all lists payloads; --json is whole"
            )
        _show_all(file, stated, processes, output)
        return
    if processes is not None:
        raise BadInputError("--processes without --all", hint="one file is one process")
    if kind == "system":
        fit, simulated, reading = system_results_of_file(file, wanted)
        document = system_document(fit, simulated=simulated)
        data = {"simulated": simulated, **system_data(fit)}
    elif kind == "payload":
        told = results_of_file(file, stated, factors, wanted)
        reading = told.reading
        document = identification_document(told)
        data = {"simulated": told.simulated, **identification_data(told.found)}
        data |= {"notes": told.notes}
        if told.peak_force_n is not None:
            data["peak_force_n"] = told.peak_force_n
    else:
        raise BadInputError(f"--kind {kind!r}", hint="payload or system")
    if reading is not None:
        data["reading"] = asdict(reading)
        output.line("\n".join(wrapped(line, 2) for line in (*reading.lines(), "")))
    output.show(document)
    if out is not None:
        from stepload.session.reevaluation import results_again, write_new

        whole = {**about({}, {}), **data}, document
        report = write_new(out, *(results_again(file, stated) if is_record(file) else whole))
        output.line(f"report: {report}")
    output.result(data)


def _sigma(text: str | None, stiffness_n_per_m: float | None) -> float | None:
    """σ of K_s in N/m, from a text in N/m or as a share of K_s."""
    from stepload.units import parse_named

    flag = "--system-stiffness-sigma"
    if text is None or not text.rstrip().endswith("%"):
        return None if text is None else parse_named(flag, text, "N/m")
    if stiffness_n_per_m is None:
        raise BadInputError(
            f"{flag} {text}: a share of a K_s that is not stated",
            hint="state --system-stiffness, or the uncertainty in N/m",
        )
    return parse_named(flag, text, "%") * stiffness_n_per_m


def _show_all(directory: Path, stated: Stated, processes: int | None, output: Output) -> None:
    """Identify every record in a directory and below, and show one row for each.

    Raises:
        BadInputError: it is no directory, or there is no record.
    """
    from stepload.data.reevaluation import identify_all
    from stepload.jobs.pool import Pool

    due_s = time.monotonic() + EVERY_S

    def on_done(done: int, of: int) -> None:
        nonlocal due_s
        if time.monotonic() >= due_s:
            due_s = time.monotonic() + EVERY_S
            print(f"{done} of {of} records", file=sys.stderr, flush=True)

    with Pool(processes) as pool:
        found = identify_all(directory, stated, pool, on_done)
    output.table(
        f"{_counted(len(found))} in {directory}, identified again",
        ("run", "payload", "verdict then", "chord", "verdict now", "chord", "95 %"),
        [_cells(row) for row in found],
    )
    for row in found:
        if row.problem:
            output.line(f"not identified: {row.path}: {row.problem}")
    others = sum(row.differs for row in found)
    output.line(f"{_counted(others)} with another verdict than then")
    output.result({"runs": [asdict(row) | {"differs": row.differs} for row in found]})


def _counted(number: int) -> str:
    return "1 record" if number == 1 else f"{number} records"


def _cells(row: Again) -> tuple[str, ...]:
    return (
        f"{row.run_id}{' (simulated)' if row.simulated else ''}", row.payload,
        row.verdict_then.replace("_", " "), stiffness_cell(row.chord_then_n_per_m),
        row.verdict.replace("_", " "), stiffness_cell(row.chord_n_per_m),
        interval_cell(row.low_n_per_m, row.high_n_per_m),
    )  # fmt: skip
