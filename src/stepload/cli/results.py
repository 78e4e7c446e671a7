"""Verbs that make something of several runs: calibrate, compare."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stepload.cli.experiments import DryRun, OutDirectory, Seed, exit_code, press
from stepload.cli.output import Output
from stepload.cli.plans import AsJson
from stepload.errors import BadInputError, ExitCode

if TYPE_CHECKING:
    from stepload.calibrate import Calibration

CALIBRATION = "calibration.json"


def _show_calibration(found: Calibration, file: Path, out: Output) -> None:
    from stepload.findings.page import smooth_error
    from stepload.units import format_quantity as f

    record = found.record
    rows = [
        (
            run.name,
            f(fit.stiffness_n_per_m, "N/m"),
            f(fit.sigma_n_per_m, "N/m"),
            f(fit.msde_m, "m"),
            f"{fit.nonlinearity:.1%} ± {fit.nonlinearity_sigma:.1%}",
        )
        for run, fit in zip(found.runs, found.fits, strict=False)
    ]
    if rows:
        columns = ("run", "K_s", "standard uncertainty", "MSDE", "nonlinearity")
        out.table("system stiffness (26)", columns, rows)
    if found.pooled is not None and found.pooled.runs > 1:
        pooled = found.pooled
        out.line(
            f"{pooled.runs} runs count as {pooled.independent_runs:.1f}: their misfits correlate "
            f"by {pooled.misfit_correlation:+.2f}; they scatter {pooled.scatter:.2f} times as "
            "much as their uncertainties say"
        )
    if found.spheres is not None:
        out.line(
            f"the contacts deform {found.spheres.contact_scale:.3f} ± "
            f"{found.spheres.contact_scale_sigma:.3f} times as much as theory says"
        )
    known = smooth_error(record.smooth_error_m or 0.0, record.smooth_degrees)
    out.line(
        f"K_s = {f(record.stiffness_n_per_m, 'N/m')} ± {f(record.sigma_n_per_m, 'N/m')} "
        f"(standard uncertainty), smooth position error {known}"
    )
    out.line(
        f"for {record.rig}, pose {record.pose or 'not stated'!r}, direction {record.direction}, "
        f"valid until {record.valid_until}"
    )
    if record.simulated:
        out.line("made in a dry run: good for dry runs only")
    out.line(f"calibration record: {file}")


def calibrate(
    files: Annotated[
        list[Path] | None,
        typer.Argument(help="A plan with `identify: {kind: system}`; with --from: more runs."),
    ] = None,
    from_runs: Annotated[
        list[Path] | None,
        typer.Option("--from", help="Runs made already (run.mcap or its directory), to be pooled."),
    ] = None,
    two_spheres: Annotated[
        tuple[Path, Path] | None,
        typer.Option("--two-spheres", help="Two runs on reference spheres: difference method."),
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option("--record", help=f"File for the record; the run's {CALIBRATION} if none."),
    ] = None,
    valid_days: Annotated[
        int, typer.Option("--valid-days", help="How long the record may be used.", min=1)
    ] = 180,
    dry_run: DryRun = False,
    out: OutDirectory = None,
    seed: Seed = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    as_json: AsJson = False,
) -> None:
    """Measure the system stiffness K_s (26) and write its calibration record.

    Runs a plan against a stiff flat contact, or takes runs that are there already.
    """
    from stepload.calibrate import calibration_data, from_system_runs, from_two_spheres
    from stepload.findings.saved import saved_run
    from stepload.plan.calibration import write_calibration
    from stepload.plan.load import load_plan
    from stepload.run.operator import Operator

    output, operator = Output(as_json=as_json), Operator()
    given, made = list(files or ()), list(from_runs or ())
    code = ExitCode.OK
    if two_spheres is not None and (given or made):
        raise BadInputError("--two-spheres takes its two runs and nothing else")
    if two_spheres is None and not made:
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
        with operator.listening():
            finished = press(
                plan, operator, output, dry_run=dry_run, out=out, seed=seed, quiet=quiet
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
    if two_spheres is not None:
        one, other = (saved_run(path) for path in two_spheres)
        found = from_two_spheres(one, other, valid_days=valid_days)
    else:
        runs = [saved_run(path) for path in (*made, *given)]
        found = from_system_runs(runs, valid_days=valid_days)
    try:
        record.parent.mkdir(parents=True, exist_ok=True)
        write_calibration(found.record, record)
    except OSError as error:
        raise BadInputError(f"cannot write {record}: {error.strerror}") from error
    _show_calibration(found, record, output)
    output.result({"record": record, **calibration_data(found)})
    raise typer.Exit(code)


def register(app: typer.Typer) -> None:
    """Add this room's verbs."""
    app.command()(calibrate)
