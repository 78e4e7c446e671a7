"""The verb `identify`, which evaluates existing data."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stepload.cli.run_paths import RunOrCurve
from stepload.errors import BadInputError
from stepload.results.terminal import AsJson, Output

if TYPE_CHECKING:
    from stepload.data.reevaluation import Again
    from stepload.results.stated import Stated

EVERY_S = 10.0


def identify(
    file: RunOrCurve,
    system_stiffness: Annotated[
        str | None,
        typer.Option("--system-stiffness", help='K_s to take out, such as "3.49e6 N/m".'),
    ] = None,
    system_stiffness_sigma: Annotated[
        str | None,
        typer.Option(
            "--system-stiffness-sigma", help='Its standard uncertainty, "70 kN/m", "2 %".'
        ),
    ] = None,
    msde: Annotated[
        str | None, typer.Option("--msde", help='Smooth deformation error, "0.54 um".')
    ] = None,
    smooth_length: Annotated[
        str | None,
        typer.Option("--smooth-length", help='Force that error stays alike over, "50 N".'),
    ] = None,
    force_noise: Annotated[
        str | None, typer.Option("--force-noise", help='Noise (σ) of a force sample, "0.7 N".')
    ] = None,
    position_noise: Annotated[
        str | None,
        typer.Option("--position-noise", help='Noise (σ) of a position sample, "0.2 um".'),
    ] = None,
    drift: Annotated[
        str | None,
        typer.Option("--drift", help='Drift (σ) of the travel, one cycle, "0.05 nm/s".'),
    ] = None,
    nonlinearity: Annotated[
        str | None,
        typer.Option("--nonlinearity", help='Bend of the force reading, "0.2 %" of the peak.'),
    ] = None,
    secant_force: Annotated[
        str | None, typer.Option("--secant-force", help='Force of the secant, "300 N".')
    ] = None,
    elastic_limit: Annotated[
        str | None, typer.Option("--elastic-limit", help='F_c, to flag data above it, "727 N".')
    ] = None,
    tared: Annotated[
        bool,
        typer.Option("--tared", help="A curve's force was tared in free air: it has none to see."),
    ] = False,
    payload: Annotated[
        Path | None,
        typer.Option("--payload", help="YAML of the payload: its law and F_c check the units."),
    ] = None,
    law: Annotated[
        list[str] | None,
        typer.Option("--law", help="Laws that figures may rest on: hertz,power …; auto: all."),
    ] = None,
    branch: Annotated[
        str | None,
        typer.Option("--branch", help="Chord that is the result: loading, unloading, reloading."),
    ] = None,
    kind: Annotated[str, typer.Option("--kind", help="payload or system.")] = "payload",
    every: Annotated[
        bool, typer.Option("--all", help="FILE is a directory: every record in it and below.")
    ] = False,
    processes: Annotated[
        int | None, typer.Option("--processes", min=1, help="For --all; all cores by default.")
    ] = None,
    write_to: Annotated[
        Path | None,
        typer.Option("--out", help="New directory for results.json and report.html."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Identify the contact law from a record or a CSV file; nothing is moved or changed.

    Example: stepload identify runs/20260801-101500-demo --out again
    """
    from stepload.results.data import identification_data, system_data
    from stepload.results.from_file import is_record, results_of_file, system_results_of_file
    from stepload.results.provenance import about
    from stepload.results.run_document import identification_document, system_document
    from stepload.results.stated import Stated, laws_of, with_payload
    from stepload.units import parse_quantity

    def quantity(text: str | None, unit: str) -> float | None:
        return None if text is None else parse_quantity(text, unit)

    stated = Stated(
        system_stiffness_n_per_m=quantity(system_stiffness, "N/m"),
        system_stiffness_sigma_n_per_m=_sigma(system_stiffness_sigma, system_stiffness),
        smooth_error_m=quantity(msde, "m"),
        secant_force_n=quantity(secant_force, "N"),
        elastic_limit_n=quantity(elastic_limit, "N"),
        smooth_length_n=quantity(smooth_length, "N"),
        force_noise_n=quantity(force_noise, "N"),
        position_noise_m=quantity(position_noise, "m"),
        travel_drift_m_per_s=quantity(drift, "m/s"),
        nonlinearity=quantity(nonlinearity, "%"),
        laws=laws_of(law or ()),
        branch=branch,
        tared=tared,
    )
    if payload is not None:
        stated = with_payload(payload, stated)
    out = Output(as_json=as_json)
    if every:
        if kind != "payload" or write_to is not None:
            raise BadInputError(
                "--all with --out or another --kind", hint="--all lists payloads; --json is whole"
            )
        _show_all(file, stated, processes, out)
        return
    if processes is not None:
        raise BadInputError("--processes without --all", hint="one file is one process")
    if kind == "system":
        fit, simulated = system_results_of_file(file)
        document = system_document(fit, simulated=simulated)
        data = {"simulated": simulated, **system_data(fit)}
    elif kind == "payload":
        told = results_of_file(file, stated)
        document = identification_document(told)
        data = {"simulated": told.simulated, **identification_data(told.found)}
        data |= {"notes": told.notes}
        if told.peak_force_n is not None:
            data["peak_force_n"] = told.peak_force_n
    else:
        raise BadInputError(f"--kind {kind!r}", hint="payload or system")
    out.show(document)
    if write_to is not None:
        from stepload.session.reevaluation import results_again, write_new

        whole = {**about({}, {}), **data}, document
        report = write_new(write_to, *(results_again(file, stated) if is_record(file) else whole))
        out.line(f"report: {report}")
    out.result(data)


def _sigma(text: str | None, stiffness: str | None) -> float | None:
    """σ of K_s in N/m, from a text in N/m or as a share of K_s."""
    from stepload.units import parse_quantity

    if text is None or not text.rstrip().endswith("%"):
        return None if text is None else parse_quantity(text, "N/m")
    if stiffness is None:
        raise BadInputError(
            f"--system-stiffness-sigma {text}: a share of a K_s that is not stated",
            hint="state --system-stiffness, or the uncertainty in N/m",
        )
    return parse_quantity(text, "%") * parse_quantity(stiffness, "N/m")


def _show_all(directory: Path, stated: Stated, processes: int | None, output: Output) -> None:
    """Identify every record in a directory and below, and show one row for each.

    Raises:
        BadInputError: it is no directory, or there is no record.
    """
    from stepload.data.reevaluation import identify_all
    from stepload.runner.pool import Pool

    due_s = [time.monotonic() + EVERY_S]

    def on_done(done: int, of: int) -> None:
        if time.monotonic() >= due_s[0]:
            due_s[0] = time.monotonic() + EVERY_S
            print(f"{done} of {of} records", file=sys.stderr, flush=True)

    with Pool(processes) as pool:
        found = identify_all(directory, stated, pool, on_done)
    other = [row for row in found if row.differs]
    output.table(
        f"{_counted(found)} in {directory}, identified again",
        ("run", "payload", "verdict then", "chord", "verdict now", "chord", "95 %"),
        [_cells(row) for row in found],
    )
    for row in found:
        if row.problem:
            output.line(f"not identified: {row.path}: {row.problem}")
    output.line(f"{_counted(other)} with another verdict than then")
    output.result({"runs": [asdict(row) | {"differs": row.differs} for row in found]})


def _counted(rows: Sequence[Again]) -> str:
    return "1 record" if len(rows) == 1 else f"{len(rows)} records"


def _cells(row: Again) -> tuple[str, ...]:
    from stepload.units import format_quantity

    def stiffness(value: float | None) -> str:
        return "" if value is None else format_quantity(value, "N/m")

    low, high = stiffness(row.low_n_per_m), stiffness(row.high_n_per_m)
    return (
        f"{row.run_id}{' (simulated)' if row.simulated else ''}", row.payload,
        row.verdict_then.replace("_", " "), stiffness(row.chord_then_n_per_m),
        row.verdict.replace("_", " "), stiffness(row.chord_n_per_m),
        f"{low} to {high}" if low and high else "",
    )  # fmt: skip
