"""Verbs that press: run, pause."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Argument, Option

from stepload.cli.hazards import HazardsRead, WiringChecked, ask_before_pressing
from stepload.cli.options import (
    Certificate,
    DryRun,
    Key,
    OutDirectory,
    PayloadFile,
    PlanFile,
    Seed,
    World,
    run_directory,
)
from stepload.errors import BadInputError, ExitCode
from stepload.report.terminal import AsJson, Output

if TYPE_CHECKING:
    from stepload.engine.operator import Operator
    from stepload.engine.tick import Engine
    from stepload.feasibility.preflight import Preflight
    from stepload.live.view import Address
    from stepload.session.experiment import Finished

Follow = Callable[[Path], None]
DEFAULT_ADDRESS = "127.0.0.1:8765"
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
    if report.exists():
        out.line(f"report   {report}")
    if not quiet or not report.exists():
        out.line(f"record   {finished.directory / 'run.mcap'}")


def _show_end(finished: Finished, out: Output, *, quiet: bool) -> None:
    """Why a run has ended, what the arm did then, and what is usually the cause."""
    from stepload.engine.safing import first_sentence
    from stepload.explain.codes import explanations
    from stepload.report.terminal import wrapped
    from stepload.units import format_quantity as f

    outcome, cause = finished.outcome, finished.outcome.cause
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
    limit = f(finished.preflight.theory.elastic_limit_n, "N")
    rest = outcome.why.removeprefix(first).strip()
    out.line(wrapped(f"  {rest} Largest force {f(outcome.peak_force_n, 'N')} of F_c = {limit}.", 2))
    if cause is not None and not cause.planned:
        for each in explanations():
            if (each.group, each.code) == ("stop", cause.rule):
                do = each.do.partition(". ")[0].rstrip(".")
                out.line(wrapped(f"  -> {do}; report, How it ended", 5))


@contextmanager
def _shown_live(address: Address | None, output: Output) -> Iterator[Follow | None]:
    """A view of the run at an address for the time of the block.

    Raises:
        BadInputError: the server cannot be started there.
    """
    if address is None:
        yield None
        return
    from stepload.live.view import live_view

    with live_view(address) as view:
        output.line(
            f"live: {view.address.url} (Foxglove or Lichtblick: open a Foxglove WebSocket"
            " connection; `stepload layout FILE` writes a layout for it)"
        )
        if not view.address.loopback:
            output.line("live: no password: everybody on this network can watch, nobody command")
        yield view.follow


def press(
    preflight: Preflight,
    operator: Operator,
    output: Output,
    *,
    dry_run: bool,
    out: Path | None,
    seed: int | None,
    quiet: bool,
    verbose: bool = False,
    resume: Path | None = None,
    live: Address | None = None,
    check: Callable[[Engine, Preflight], None] | None = None,
) -> Finished:
    """Run a plan with its preflight, progress and result shown; `operator` listens already.

    `check` looks at the run as often as it is shown.
    """
    from stepload.cli.keys import keys
    from stepload.cli.preflight import show_figures, show_reasons, show_verdict
    from stepload.cli.progress import progress
    from stepload.feasibility.reason import PlanVerdict
    from stepload.session.experiment import refuse_what_may_not_run, run_plan
    from stepload.session.repair import repair_all

    if not dry_run:  # before a preflight is shown in vain
        refuse_what_may_not_run(preflight, dry_run)
    if preflight.verdict is not PlanVerdict.REFUSED:
        for repaired in repair_all(out or preflight.plan.record.directory):
            output.line(repaired.line)
        if not quiet:
            show_verdict(preflight, output)
        if verbose:
            show_reasons(preflight, output)
            show_figures(preflight, output)

    def look(engine: Engine, preflight: Preflight) -> None:
        for each in (check, display.show):
            if each is not None:
                each(engine, preflight)

    with (
        progress(quiet=quiet) as display,
        keys(operator, display.say),
        _shown_live(live, output) as follow,
    ):
        finished = run_plan(
            preflight,
            dry_run=dry_run,
            out=out,
            seed=seed,
            resume=resume,
            operator=operator,
            on_progress=look,
            on_notice=display.say,
            on_record=follow,
        )
    _show_run(finished, output, details=verbose, quiet=quiet)
    return finished


def run(
    plan: PlanFile,
    dry_run: DryRun = False,
    out: OutDirectory = None,
    payload: PayloadFile = None,
    seed: Seed = None,
    world: World = "",
    resume: Annotated[
        Path | None,
        Option(
            parser=run_directory,
            metavar="RUN",
            help="An interrupted run (directory, record or id); goes on after its last step.",
        ),
    ] = None,
    tag: Annotated[
        list[str] | None,
        Option(help="A word to find the run by; specimen=…, batch=…, operator=… set the plan's."),
    ] = None,
    quiet: Annotated[bool, Option("--quiet", help="Two lines: the result and the report.")] = False,
    verbose: Annotated[
        bool, Option("--verbose", help="All tables, of preflight and result, as in the report.")
    ] = False,
    live: Annotated[
        bool, Option("--live", help="Show the run to Foxglove or Lichtblick while it goes on.")
    ] = False,
    live_address: Annotated[
        str, Option(help="Where viewers connect; loopback unless you say so.")
    ] = DEFAULT_ADDRESS,
    certificate: Certificate = None,
    key: Key = None,
    hazards_read: HazardsRead = False,
    wiring_checked: WiringChecked = False,
    as_json: AsJson = False,
) -> None:
    """Run a plan: preflight, press, record, identify, report.

    Ctrl+C finishes the step and unloads, twice retracts now; `p` pauses and goes on.

    Example: stepload run procedures/plastic-sphere.yaml --dry-run
    """
    from stepload.engine.operator import Operator
    from stepload.feasibility.preflight import preflight_of
    from stepload.plan.load import in_world, load_plan
    from stepload.plan.tags import tagged

    output, operator, address = Output(as_json=as_json), Operator(), None
    if world and not dry_run:
        raise BadInputError("--world names a simulator", hint="add --dry-run")
    if live:
        from stepload.live.view import address_of

        address = address_of(live_address, certificate, key)
    loaded = tagged(load_plan(plan, payload=payload), tag or ())
    preflight = preflight_of(in_world(loaded, world) if world else loaded)
    if not dry_run and ask_before_pressing(preflight, hazards_read, wiring_checked):
        # the rig file may have changed
        preflight = preflight_of(tagged(load_plan(plan, payload=payload), tag or ()))
    with operator.listening():
        finished = press(
            preflight, operator, output, dry_run=dry_run, out=out, seed=seed, resume=resume,
            quiet=quiet, verbose=verbose, live=address,
        )  # fmt: skip
        output.result({**finished.data, "directory": finished.directory})
    raise typer.Exit(exit_code(finished))


def pause(
    directory: Annotated[
        Path,
        Argument(parser=run_directory, metavar="RUN", help="A run that goes on: directory or id."),
    ],
    resume: Annotated[bool, Option("--resume", help="Go on instead.")] = False,
    as_json: AsJson = False,
) -> None:
    """Pause a run after its step, unloaded; with --resume it goes on.

    Example: stepload pause runs/20260801-101500-demo
    """
    from stepload.session.control import ask

    output = Output(as_json=as_json)
    answer = ask(directory, "resume" if resume else "pause")
    where = f"cycle {answer.get('cycle', 0)}, {answer.get('phase', '')}"
    output.line(f"run {answer.get('run_id')}: {'goes on' if resume else 'pauses'} ({where})")
    output.result(answer)
