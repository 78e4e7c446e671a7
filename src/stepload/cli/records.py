"""Verbs about records: recover, replay."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from stepload.cli.options import RunPath, run_path
from stepload.errors import BadInputError, ExitCode
from stepload.report.terminal import AsJson, Output


def _broken_in(directory: Path) -> Path | None:
    """The record in a run's directory that has the name of a finished one but is not finished."""
    from stepload.record.summary import read_summary

    record = directory / "run.mcap"
    if not record.is_file():
        return None
    try:
        return record if read_summary(record).partial else None
    except BadInputError:
        return record


def recover(
    file: Annotated[
        Path,
        Argument(
            parser=run_path,
            metavar="RUN",
            help="A record or a run id, or a directory in which to look for unfinished ones.",
        ),
    ] = Path("runs"),
    out: Annotated[Path | None, Option(help="Where the repaired file goes.")] = None,
    as_json: AsJson = False,
) -> None:
    """Repair what was not finished, verify it, and identify what is there.

    Example: stepload recover runs
    """
    from stepload.session.repair import repair, repair_all

    output = Output(as_json=as_json)
    if (broken := _broken_in(file)) is not None:
        file = broken
    if file.is_dir():
        if out is not None:
            raise BadInputError("--out goes with one file", hint="name the record")
        found = repair_all(file)
        for repaired in found:
            output.line(repaired.line)
        if not found:
            output.line(f"no unfinished record in {file}")
        output.result({"records": [repaired.data for repaired in found]})
        if any(repaired.found is None for repaired in found):
            raise typer.Exit(ExitCode.BAD_INPUT)
        return
    repaired = repair(file, out)
    assert repaired.found is not None
    if not any(repaired.found.counts.values()):
        raise BadInputError(
            f"{file}: not one message in it is whole ({repaired.found.cut_bytes} bytes are not)",
            hint=f"what is left of it is {repaired.found.path}",
        )
    output.line(repaired.line)
    output.line(
        f"report: {repaired.report}" if repaired.report else f"no report: {repaired.unwritten}"
    )
    for topic, count in sorted(repaired.found.counts.items()):
        output.line(f"  {topic}: {count} messages")
    output.result(repaired.data)


def replay(
    file: RunPath,
    force_limit: Annotated[str | None, Option(help='Another F_lim, such as "250 N".')] = None,
    limit: Annotated[
        list[str] | None,
        Option(help='Another threshold, "model_tolerance_m=20 um"; names: preflight.'),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run the supervisor over a record. Exit 4: it would have tripped.

    Example: stepload replay runs/20260801-101500-demo --force-limit "250 N"
    """
    from stepload.engine.replay import replay_file
    from stepload.report.run_record import record_in

    output = Output(as_json=as_json)
    stated = {} if force_limit is None else {"force_limit_n": force_limit}
    for text in limit or ():
        name, _, value = text.partition("=")
        stated[name.strip()] = value.strip()
    judged = replay_file(record_in(file), stated)
    found = judged.replayed
    cause = found.cause
    for note in judged.notes:
        output.line(f"note: {note}")
    if cause is None:
        output.line(f"no trip in {found.ticks} ticks")
    else:
        where = found.phase.name.replace("_", " ").lower() if found.phase is not None else ""
        output.line(
            f"trip by {cause.rule} at {cause.time_s - judged.start_s:.3f} s, after {found.ticks}"
            f" ticks ({where}): {cause.message}{cause.numbers}"
        )
    output.result(
        {
            "tripped": cause is not None,
            "cause": cause._asdict() if cause else None,
            "start_s": judged.start_s,
            "phase": found.phase.name if found.phase is not None else None,
            "ticks": found.ticks,
            "notes": judged.notes,
        }
    )
    if cause is not None:
        raise typer.Exit(ExitCode.STOPPED)
