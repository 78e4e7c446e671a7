"""Verbs about records: recover, replay."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stepload.cli.output import Output
from stepload.cli.plans import AsJson
from stepload.errors import ExitCode

RecordFile = Annotated[Path, typer.Argument(help="A record (run.mcap or run.mcap.part).")]


def recover(
    file: RecordFile,
    out: Annotated[Path | None, typer.Option("--out", help="Where the repaired file goes.")] = None,
    as_json: AsJson = False,
) -> None:
    """Repair a record that was not finished, verify it by reading back, and identify it."""
    from stepload.errors import SteploadError
    from stepload.findings.from_file import Wishes, identify_file
    from stepload.findings.results import identification_data
    from stepload.record.recovery import recover as repair

    output = Output(as_json=as_json)
    found = repair(file, out)
    output.line(f"repaired: {found.path}")
    output.line(f"cut: {found.cut_bytes} bytes{f' ({found.damage})' if found.damage else ''}")
    for topic, count in sorted(found.counts.items()):
        output.line(f"  {topic}: {count} messages")
    identification = None
    try:
        result, _ = identify_file(found.path, Wishes())
        identification = identification_data(result)
        output.line(
            f"identified from what is there: secant {result.fit.secant_n_per_m:.4g} N/m at "
            f"{result.fit.secant_force_n:.4g} N, {result.judgement.outcome.value}"
        )
    except SteploadError as error:
        output.line(f"nothing to identify: {error.message}")
    output.result(
        {
            "path": found.path,
            "counts": found.counts,
            "cut_bytes": found.cut_bytes,
            "damage": found.damage,
            "identification": identification,
        }
    )


def replay(
    file: RecordFile,
    force_limit: Annotated[
        str | None, typer.Option("--force-limit", help='Another F_lim, such as "250 N".')
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run the supervisor over a record: where would it have tripped? Exit 4 if it would have."""
    from stepload.findings.replayed import replay_file
    from stepload.units import parse_quantity

    output = Output(as_json=as_json)
    limit_n = None if force_limit is None else parse_quantity(force_limit, "N")
    found = replay_file(file, force_limit_n=limit_n)
    cause = found.cause
    if cause is None:
        output.line(f"no trip in {found.ticks} ticks")
    else:
        where = found.phase.name.replace("_", " ").lower() if found.phase is not None else ""
        output.line(f"trip after {found.ticks} ticks ({where}): {cause.message}")
    output.result(
        {
            "tripped": cause is not None,
            "cause": cause._asdict() if cause else None,
            "phase": found.phase.name if found.phase is not None else None,
            "ticks": found.ticks,
        }
    )
    if cause is not None:
        raise typer.Exit(ExitCode.STOPPED)


def register(app: typer.Typer) -> None:
    """Add this room's verbs."""
    app.command()(recover)
    app.command()(replay)
