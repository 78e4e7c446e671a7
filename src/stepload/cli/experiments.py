"""Verbs that produce results: run, identify."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stepload.cli.hazards import HazardsRead, ask_hazards
from stepload.cli.paper import A4, AsPdf, PaperSize, put_on_paper, wanted_paper
from stepload.cli.plans import PayloadFile, PlanFile
from stepload.cli.run_paths import run_directory, run_path
from stepload.errors import BadInputError, ExitCode
from stepload.results.terminal import AsJson, Output

if TYPE_CHECKING:
    from stepload.engine.operator import Operator
    from stepload.envelope.envelope import Envelope
    from stepload.session.experiment import Finished

DryRun = Annotated[
    bool, typer.Option("--dry-run", help="On the simulated rig, in virtual time; moves nothing.")
]
OutDirectory = Annotated[
    Path | None, typer.Option("--out", help="Directory for the run's files (a new one).")
]
Seed = Annotated[int | None, typer.Option("--seed", min=0, help="Seed of the simulated rig.")]

Tags = Annotated[
    list[str] | None,
    typer.Option(
        "--tag",
        help="A word to find the run by; specimen=…, batch=… and operator=… set those of the plan.",
    ),
]

ResumeDirectory = Annotated[
    Path | None,
    typer.Option(
        "--resume",
        parser=run_directory,
        metavar="RUN",
        help="An interrupted run (directory, record or id); goes on after its last step.",
    ),
]

EXIT_OF_SIGNAL: dict[int, ExitCode] = {
    signal.SIGTERM: ExitCode.TERMINATED,
    signal.SIGHUP: ExitCode.HANGUP,
}


def exit_code(finished: Finished) -> ExitCode:
    """The exit code that says how a run ended."""
    from stepload.record.outcome import RunStatus

    outcome = finished.outcome
    if outcome.status is RunStatus.STOPPED:
        return ExitCode.STOPPED
    if outcome.status is RunStatus.INTERRUPTED:
        return EXIT_OF_SIGNAL.get(outcome.signal_number, ExitCode.INTERRUPTED)
    if finished.left_early:
        return EXIT_OF_SIGNAL.get(finished.left_early, ExitCode.INTERRUPTED)
    return ExitCode.BUG if finished.problems else ExitCode.OK


Verbose = Annotated[
    bool,
    typer.Option("--verbose", help="All tables, of preflight and result; the report has them too."),
]


def _show_run(finished: Finished, out: Output, *, details: bool) -> None:
    for error in finished.outcome.errors:
        out.line(f"error on the way: {error}")
    for problem in finished.problems:
        out.line(f"error: {problem}")
    if finished.document is not None:
        out.show(finished.document, details=details)
    else:
        out.line(f"{finished.outcome.why}\nno result")
    if (report := finished.directory / "report.html").exists():
        out.line(f"report: {report}")
    out.line(f"record: {finished.directory / 'run.mcap'}")


def press(
    envelope: Envelope,
    operator: Operator,
    output: Output,
    *,
    dry_run: bool,
    out: Path | None,
    seed: int | None,
    quiet: bool,
    verbose: bool = False,
    resume: Path | None = None,
    hazards_read: bool = False,
) -> Finished:
    """Run a plan with its preflight, progress and result shown; `operator` listens already."""
    from stepload.cli.keys import keys
    from stepload.cli.plans import show_preflight, show_verdict
    from stepload.cli.progress import progress
    from stepload.envelope.reason import PlanVerdict
    from stepload.results.model import SIMULATED
    from stepload.session.experiment import run_plan
    from stepload.session.unfinished import repair_all

    if dry_run:
        output.line(SIMULATED)
    if envelope.verdict is not PlanVerdict.REFUSED:
        for repaired in repair_all(out or envelope.plan.record.directory):
            output.line(repaired.line)
        if verbose:
            show_preflight(envelope, output)
        else:
            show_verdict(envelope, output, details=False)
    with keys(operator), progress(quiet=quiet) as display:
        finished = run_plan(
            envelope,
            dry_run=dry_run,
            out=out,
            seed=seed,
            resume=resume,
            hazards_read_now=hazards_read,
            operator=operator,
            on_progress=display.show,
            on_notice=display.say,
        )
    _show_run(finished, output, details=verbose)
    return finished


def run(
    plan: PlanFile,
    dry_run: DryRun = False,
    out: OutDirectory = None,
    payload: PayloadFile = None,
    seed: Seed = None,
    resume: ResumeDirectory = None,
    tag: Tags = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    verbose: Verbose = False,
    hazards_read: HazardsRead = False,
    pdf: AsPdf = False,
    paper: PaperSize = A4,
    as_json: AsJson = False,
) -> None:
    """Run a plan: preflight, press, record, identify, report.

    Ctrl+C finishes the step and unloads, twice retracts now; `p` pauses and goes on.
    """
    from stepload.engine.operator import Operator
    from stepload.envelope.envelope import envelope_of
    from stepload.plan.load import load_plan
    from stepload.plan.tags import tagged

    output, operator, on = Output(as_json=as_json), Operator(), wanted_paper(pdf, paper)
    envelope = envelope_of(tagged(load_plan(plan, payload=payload), tag or ()))
    if not dry_run and not hazards_read and ask_hazards(envelope):
        hazards_read = True  # and the rig file may have changed
        envelope = envelope_of(tagged(load_plan(plan, payload=payload), tag or ()))
    with operator.listening():
        finished = press(
            envelope, operator, output, dry_run=dry_run, out=out, seed=seed, resume=resume,
            quiet=quiet, verbose=verbose, hazards_read=hazards_read,
        )  # fmt: skip
        output.result({**finished.data, "directory": finished.directory})
    put_on_paper(finished.directory / "report.html", on, output)
    raise typer.Exit(exit_code(finished))


def pause(
    directory: Annotated[
        Path,
        typer.Argument(
            parser=run_directory, metavar="RUN", help="A run that is going on: directory or id."
        ),
    ],
    resume: Annotated[bool, typer.Option("--resume", help="Go on instead.")] = False,
    as_json: AsJson = False,
) -> None:
    """Pause a run after its step, unloaded; with --resume it tares, touches and goes on."""
    from stepload.session.control import ask

    output = Output(as_json=as_json)
    answer = ask(directory, "resume" if resume else "pause")
    where = f"cycle {answer.get('cycle', 0)}, {answer.get('phase', '')}"
    output.line(f"run {answer.get('run_id')}: {'goes on' if resume else 'pauses'} ({where})")
    output.result(answer)


def identify(
    file: Annotated[
        Path,
        typer.Argument(
            parser=run_path, metavar="FILE", help="A run (directory, record, id), or a CSV curve."
        ),
    ],
    system_stiffness: Annotated[
        str | None,
        typer.Option("--system-stiffness", help='K_s to take out, such as "3.49e6 N/m".'),
    ] = None,
    system_stiffness_sigma: Annotated[
        str | None,
        typer.Option("--system-stiffness-sigma", help='Its standard uncertainty, "70 kN/m".'),
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
    kind: Annotated[str, typer.Option("--kind", help="payload or system.")] = "payload",
    write_to: Annotated[
        Path | None,
        typer.Option("--out", help="New directory for results.json and report.html."),
    ] = None,
    pdf: AsPdf = False,
    paper: PaperSize = A4,
    as_json: AsJson = False,
) -> None:
    """Identify the contact law from a record or a CSV file; nothing is moved or changed.

    Example: stepload identify runs/20260801-101500-demo --out again
    """
    from stepload.results.about import about
    from stepload.results.data import identification_data, system_data
    from stepload.results.from_file import is_record, results_of_file, system_results_of_file
    from stepload.results.run_document import identification_document, system_document
    from stepload.results.wishes import Wishes, laws_of, wishes_of_payload
    from stepload.units import parse_quantity

    def quantity(text: str | None, unit: str) -> float | None:
        return None if text is None else parse_quantity(text, unit)

    wishes = Wishes(
        system_stiffness_n_per_m=quantity(system_stiffness, "N/m"),
        system_stiffness_sigma_n_per_m=quantity(system_stiffness_sigma, "N/m"),
        smooth_error_m=quantity(msde, "m"),
        secant_force_n=quantity(secant_force, "N"),
        elastic_limit_n=quantity(elastic_limit, "N"),
        smooth_length_n=quantity(smooth_length, "N"),
        force_noise_n=quantity(force_noise, "N"),
        position_noise_m=quantity(position_noise, "m"),
        nonlinearity=quantity(nonlinearity, "%"),
        laws=laws_of(law or ()),
        tared=tared,
    )
    if payload is not None:
        wishes = wishes_of_payload(payload, wishes)
    out, on = Output(as_json=as_json), wanted_paper(pdf, paper)
    if on and write_to is None:
        raise BadInputError("--pdf without --out", hint="name a directory for the report: --out")
    if kind == "system":
        fit, simulated = system_results_of_file(file)
        document = system_document(fit, simulated=simulated)
        data = {"simulated": simulated, **system_data(fit)}
    elif kind == "payload":
        told = results_of_file(file, wishes)
        document = identification_document(*told)
        data = {"simulated": told.simulated, **identification_data(told.found)}
        data |= {"notes": told.notes}
    else:
        raise BadInputError(f"--kind {kind!r}", hint="payload or system")
    out.show(document)
    if write_to is not None:
        from stepload.session.again import results_again, write_new

        whole = {**about({}, {}), **data}, document
        report = write_new(write_to, *(results_again(file, wishes) if is_record(file) else whole))
        out.line(f"report: {report}")
    out.result(data)
    if write_to is not None:
        put_on_paper(report, on, out)


def register(app: typer.Typer) -> None:
    """Add this room's verbs."""
    app.command()(run)
    app.command()(pause)
    app.command()(identify)
