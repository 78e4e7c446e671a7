"""The verb `calibrate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from stepload.cli.hazards import HazardsRead, WiringChecked, ask_before_pressing
from stepload.cli.options import DryRun, OutDirectory, Seed, run_path
from stepload.cli.run import exit_code, press
from stepload.errors import BadInputError, ExitCode
from stepload.report.terminal import AsJson, Output

CALIBRATION = "calibration.json"


def calibrate(
    files: Annotated[
        list[Path] | None,
        Argument(
            parser=run_path,
            metavar="PLAN",
            help="A plan with `identify: {kind: system}`; with --from: more runs.",
        ),
    ] = None,
    from_runs: Annotated[
        list[Path] | None,
        Option(
            "--from",
            parser=run_path,
            metavar="RUN",
            help="Runs made already (directory, record or id), to be pooled; none that stopped.",
        ),
    ] = None,
    record: Annotated[
        Path | None, Option(help=f"File for the record; the run's {CALIBRATION} if none.")
    ] = None,
    into: Annotated[
        Path | None, Option(help="Rig file of `stepload setup` that names the record then.")
    ] = None,
    valid_days: Annotated[int, Option(help="How long the record may be used.", min=1)] = 180,
    dry_run: DryRun = False,
    out: OutDirectory = None,
    seed: Seed = None,
    quiet: Annotated[bool, Option("--quiet", help="No progress.")] = False,
    hazards_read: HazardsRead = False,
    wiring_checked: WiringChecked = False,
    as_json: AsJson = False,
) -> None:
    """Measure the system stiffness K_s (26) and write its record.

    Runs a plan against a stiff flat contact, or takes runs that are there already.

    Example: stepload calibrate procedures/system-stiffness.yaml --dry-run --record ks.json
    """
    from datetime import date

    from stepload.engine.operator import Operator
    from stepload.feasibility.preflight import preflight_of
    from stepload.plan.calibration import write_calibration
    from stepload.plan.load import load_plan
    from stepload.report.calibration import from_system_runs
    from stepload.report.calibration_document import calibration_data, calibration_document
    from stepload.report.page import render
    from stepload.report.provenance import sealed
    from stepload.report.run_record import saved_run
    from stepload.session.files import write_file
    from stepload.setup.state import put_record, state_to_take_it

    output, operator = Output(as_json=as_json), Operator()
    given, made = list(files or ()), list(from_runs or ())
    code = ExitCode.OK
    if record is not None and record.suffix == ".html":
        raise BadInputError(f"--record {record}: that is where the report goes", hint="*.json")
    if into is not None:
        if dry_run:
            raise BadInputError(
                "--into goes with no dry run: its record is good for dry runs only",
                hint="leave one of the two out",
            )
        state_to_take_it(into)  # refused before anything is pressed
    if not made:
        if len(given) != 1:
            raise BadInputError(
                "give one plan to run, or runs that are there with --from",
                hint="stepload calibrate procedures/system-stiffness.yaml --record stvf.json",
            )
        plan = load_plan(given[0])
        if plan.identify.kind != "system":
            raise BadInputError(
                f"{given[0]}: identify.kind is {plan.identify.kind}: it identifies a payload",
                hint="press a stiff flat contact with `identify: {kind: system}`",
            )
        preflight = preflight_of(plan)
        if not dry_run and ask_before_pressing(preflight, hazards_read, wiring_checked):
            preflight = preflight_of(load_plan(given[0]))  # its rig file may have changed
        with operator.listening():
            finished = press(
                preflight, operator, output, dry_run=dry_run, out=out, seed=seed, quiet=quiet
            )
        code = exit_code(finished)
        if code is not ExitCode.OK or finished.data.get("system_stiffness") is None:
            output.line("no calibration record: the run has no system stiffness")
            output.result({**finished.data, "directory": finished.directory, "record": None})
            raise typer.Exit(code or ExitCode.STOPPED)
        made, given = [finished.directory], []
        record = record or finished.directory / CALIBRATION
    if record is None:
        raise BadInputError("--record is missing", hint=f"name a file, such as {CALIBRATION}")
    runs = [saved_run(path) for path in (*made, *given)]
    found = from_system_runs(runs, valid_days=valid_days)
    try:
        record.parent.mkdir(parents=True, exist_ok=True)
        write_calibration(found.record, record)
    except OSError as error:
        raise BadInputError(f"cannot write {record}: {error.strerror}") from error
    document, report = calibration_document(found, record), record.with_name(f"{record.stem}.html")
    output.show(document)
    try:
        write_file(report, render(sealed(document, record)))
        output.line(f"report: {report}")
    except OSError as error:  # the record is written: it is kept even if its picture fails
        output.line(f"report not written: {report}: {error.strerror}")
    if into is not None:
        put_record(into, record, found.record, date.today())
        output.line(f"{into} names it now")
    output.result({"record": record, **calibration_data(found)})
    raise typer.Exit(code)
