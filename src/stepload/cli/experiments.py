"""Verbs that press: run, pause."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stepload.cli.hazards import HazardsRead, WiringChecked, ask_before_pressing
from stepload.cli.live import DEFAULT_ADDRESS, shown_live
from stepload.cli.plans import PayloadFile, PlanFile
from stepload.cli.run_paths import run_directory
from stepload.errors import ExitCode
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

EXIT_OF_SIGNAL: dict[int, ExitCode] = {
    signal.SIGTERM: ExitCode.TERMINATED,
    signal.SIGHUP: ExitCode.HANGUP,
}


def exit_code(finished: Finished) -> ExitCode:
    """The exit code for the end of a run."""
    from stepload.record.outcome import RunStatus

    outcome = finished.outcome
    if outcome.status is RunStatus.STOPPED:
        return ExitCode.STOPPED
    if outcome.status is RunStatus.INTERRUPTED:
        return EXIT_OF_SIGNAL.get(outcome.signal_number, ExitCode.INTERRUPTED)
    if finished.left_early:
        return EXIT_OF_SIGNAL.get(finished.left_early, ExitCode.INTERRUPTED)
    return ExitCode.BUG if finished.problems else ExitCode.OK


def _show_run(finished: Finished, out: Output, *, details: bool, quiet: bool) -> None:
    """A run after its end: how it ended if not as planned, the result, where the files are."""
    from stepload.record.outcome import RunStatus

    document, report = finished.document, finished.directory / "report.html"
    record = finished.directory / "run.mcap"
    for error in (*finished.outcome.errors, *finished.problems):
        out.line(f"error: {error}")
    completed = finished.outcome.status is RunStatus.COMPLETED
    if not completed or document is None or finished.outcome.safing_failed:
        _show_end(finished, out, quiet=quiet)
    if document is not None and (completed or not quiet):
        if quiet:
            out.verdict(document, whole=False)
        else:
            out.show(document, details=details)
    if not report.exists():
        out.line(f"record   {record}")
        return
    out.line(f"report   {report}")
    if not quiet:
        out.line(f"record   {record}")


def _show_end(finished: Finished, out: Output, *, quiet: bool) -> None:
    """Why a run has ended, what the arm did then, and what is usually the cause."""
    from stepload.engine.safing import first_sentence
    from stepload.explain.codes import explanations
    from stepload.results.terminal import wrapped
    from stepload.units import format_quantity as f

    outcome, envelope = finished.outcome, finished.envelope
    cause = outcome.cause
    first = first_sentence(outcome.status.value, cause, outcome.start_s, outcome.signal_number)
    if cause is None or cause.planned:
        word, text = outcome.status.value.upper(), f": {first}"
    else:
        where = f"in cycle {outcome.cycle}" if outcome.cycle else "before the first cycle"
        word = f"STOPPED by {cause.rule}"
        text = f" {where}, {cause.time_s - outcome.start_s:.1f} s: {cause.message}"
    out.line(wrapped(f"{word}{text}", 2), word=word, mood="bad")
    if quiet:
        return
    limit = f(envelope.theory.elastic_limit_n, "N")
    rest = outcome.why.removeprefix(first).strip()
    out.line(wrapped(f"  {rest} Largest force {f(outcome.peak_force_n, 'N')} of F_c = {limit}.", 2))
    about = [each.do for each in explanations() if each.group == "stop" and cause is not None
             and each.code == cause.rule and not cause.planned]  # fmt: skip
    for do in about:
        out.line(wrapped(f"  -> {do.partition('. ')[0].rstrip('.')}; report, How it ended", 5))


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
    live: str = "",
    watch: bool = False,
) -> Finished:
    """Run a plan with its preflight, progress and result shown; `operator` listens already."""
    from stepload.cli.keys import keys
    from stepload.cli.plans import show_figures, show_reasons, show_verdict
    from stepload.cli.progress import progress
    from stepload.envelope.reason import PlanVerdict
    from stepload.session.experiment import refuse_what_may_not_run, run_plan
    from stepload.session.repair import repair_all

    if not dry_run:  # before a preflight is shown in vain
        refuse_what_may_not_run(envelope, dry_run)
    if envelope.verdict is not PlanVerdict.REFUSED:
        for repaired in repair_all(out or envelope.plan.record.directory):
            output.line(repaired.line)
        if not quiet:
            show_verdict(envelope, output)
        if verbose:
            show_reasons(envelope, output)
            show_figures(envelope, output)
    with (
        progress(quiet=quiet, watch=watch) as display,
        keys(operator, display.say),
        shown_live(live, output) as follow,
    ):

        def on_record(record: Path) -> None:
            for each in (follow, display.on_record):
                if each is not None:
                    each(record)

        finished = run_plan(
            envelope,
            dry_run=dry_run,
            out=out,
            seed=seed,
            resume=resume,
            operator=operator,
            on_progress=display.show,
            on_notice=display.say,
            on_record=on_record,
        )
    _show_run(finished, output, details=verbose, quiet=quiet)
    return finished


def run(
    plan: PlanFile,
    dry_run: DryRun = False,
    out: OutDirectory = None,
    payload: PayloadFile = None,
    seed: Seed = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            "--resume",
            parser=run_directory,
            metavar="RUN",
            help="An interrupted run (directory, record or id); goes on after its last step.",
        ),
    ] = None,
    tag: Annotated[
        list[str] | None,
        typer.Option(
            "--tag",
            help="A word to find the run by; specimen=…, batch=… and operator=… set those of the "
            "plan.",
        ),
    ] = None,
    quiet: Annotated[
        bool, typer.Option("--quiet", help="Two lines: the result and the report.")
    ] = False,
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose", help="All tables, of preflight and result; the report has them too."
        ),
    ] = False,
    watch: Annotated[
        bool, typer.Option("--watch", help="Draw force, curve and margins in the terminal.")
    ] = False,
    live: Annotated[
        bool,
        typer.Option("--live", help="Show the run to Foxglove or Lichtblick while it goes on."),
    ] = False,
    live_address: Annotated[
        str,
        typer.Option("--live-address", help="Where viewers connect; loopback unless you say so."),
    ] = DEFAULT_ADDRESS,
    hazards_read: HazardsRead = False,
    wiring_checked: WiringChecked = False,
    as_json: AsJson = False,
) -> None:
    """Run a plan: preflight, press, record, identify, report.

    Ctrl+C finishes the step and unloads, twice retracts now; `p` pauses and goes on.

    Example: stepload run procedures/plastic-sphere.yaml --dry-run --watch
    """
    from stepload.engine.operator import Operator
    from stepload.envelope.envelope import envelope_of
    from stepload.plan.load import load_plan
    from stepload.plan.tags import tagged

    output, operator = Output(as_json=as_json), Operator()
    envelope = envelope_of(tagged(load_plan(plan, payload=payload), tag or ()))
    if not dry_run and ask_before_pressing(envelope, hazards_read, wiring_checked):
        # the rig file may have changed
        envelope = envelope_of(tagged(load_plan(plan, payload=payload), tag or ()))
    with operator.listening():
        finished = press(
            envelope, operator, output, dry_run=dry_run, out=out, seed=seed, resume=resume,
            quiet=quiet, verbose=verbose,
            live=live_address if live else "", watch=watch,
        )  # fmt: skip
        output.result({**finished.data, "directory": finished.directory})
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
    """Pause a run after its step, unloaded; with --resume it tares, touches and goes on.

    Example: stepload pause runs/20260801-101500-demo
    """
    from stepload.session.control import ask

    output = Output(as_json=as_json)
    answer = ask(directory, "resume" if resume else "pause")
    where = f"cycle {answer.get('cycle', 0)}, {answer.get('phase', '')}"
    output.line(f"run {answer.get('run_id')}: {'goes on' if resume else 'pauses'} ({where})")
    output.result(answer)
