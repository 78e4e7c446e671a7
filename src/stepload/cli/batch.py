"""The verb `batch`: specimen after specimen by a list, then a table of all."""

from __future__ import annotations

import contextlib
import signal
import sys
import termios
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from stepload.cli.options import DryRun, PlanFile
from stepload.errors import BadInputError, ExitCode
from stepload.report.terminal import AsJson, Output

OF_THE_SPECIMEN = {
    "R1", "R2", "R6", "R8", "R12", "R14", "not_free", "tilted", "uneven", "until", "specimen",
}  # fmt: skip
"""Stops that another specimen, or this one mounted anew, may not have; any other is the rig's."""


def batch(
    plan: PlanFile,
    specimens: Annotated[
        Path, Argument(metavar="LIST", help="CSV: specimen, operator, trial, plan.")
    ],
    dry_run: DryRun = False,
    out: Annotated[Path | None, Option(help="Directory of the batch; default: runs/LIST.")] = None,
    quiet: Annotated[bool, Option("--quiet", help="Two lines for each specimen.")] = False,
    as_json: AsJson = False,
) -> None:
    """Press specimen after specimen by a list; table and control chart of all.

    Started anew it goes on where it was left.

    Example: stepload batch foot.yaml specimens.csv
    """
    from stepload.cli.hazards import ask_before_pressing
    from stepload.cli.run import exit_code, press
    from stepload.data.batch import Key, pressed, read_list
    from stepload.engine.operator import Operator
    from stepload.feasibility.preflight import preflight_of
    from stepload.plan.load import load_plan
    from stepload.record.plain import json_text
    from stepload.report.batch import batch_document, batch_of
    from stepload.report.page import render
    from stepload.report.run_record import saved_run
    from stepload.session.experiment import refuse_what_may_not_run
    from stepload.session.files import write_file
    from stepload.session.specimen import SpecimenCheck

    output, name = Output(as_json=as_json), out.name if out else specimens.stem
    if not (dry_run or (sys.stdin and sys.stdin.isatty())):
        raise BadInputError("a batch asks for each specimen: it needs a terminal")
    pieces = read_list(specimens, plan)
    plans = {piece.plan: load_plan(piece.plan) for piece in pieces}
    listed = {piece.key(plans[piece.plan]): piece for piece in pieces}
    if twice := [each.name for each in pieces if not any(each is kept for kept in listed.values())]:
        raise BadInputError(
            f"{specimens}: {', '.join(twice)}: two rows are one press, by plan, operator and trial",
            hint="tell them apart: column `trial`, or another name of a plan",
        )
    directory = out or plans[pieces[0].plan].record.directory / name
    skipped, codes, asked = set[Key](), dict[Key, ExitCode](), False
    while True:  # the disk alone knows what is pressed
        done = pressed(directory, dry_run=dry_run)
        left = [key for key in listed if key not in done]
        if (key := next((each for each in left if each not in skipped), None)) is None:
            if done and not asked:
                newest = max(run.metadata["started"] for run in done.values())
                output.line(f"All are pressed, the last one {newest}. Press anew: --out DIR")
            break
        piece, number = listed[key], list(listed).index(key)
        made = piece.of(plans[piece.plan], name)
        if not asked:
            asked, preflight = True, preflight_of(made)
            refuse_what_may_not_run(preflight, dry_run)  # before anything is mounted in vain
            if not dry_run and ask_before_pressing(preflight, False, False):
                plans = {each: load_plan(each) for each in plans}  # the rig file may have changed
                continue
        output.line(f"\n{number + 1} of {len(listed)}: {piece.name}")
        answer = "" if dry_run else _ask("Mount it, then Enter (s: skip; q: end): ")
        if answer == "q":
            break
        if dry_run or answer == "s":
            skipped.add(key)
        if answer == "s":
            continue
        made = replace(made, record=replace(made.record, directory=directory))
        operator, preflight = Operator(), preflight_of(made)
        seed = made.rig.simulation.seed + number if dry_run else None
        with operator.listening():
            finished = press(
                preflight, operator, output, dry_run=dry_run, out=None, seed=seed,
                quiet=quiet, check=SpecimenCheck(),
            )  # fmt: skip
        outcome, codes[key] = finished.outcome, exit_code(finished)
        of_rig = outcome.cause is not None and outcome.cause.rule not in OF_THE_SPECIMEN
        ends = of_rig or outcome.safing_failed or outcome.signal_number not in (0, signal.SIGINT)
        if ends:
            output.line("the batch ends here: mend the rig; the same command goes on")
        if ends or (dry_run and codes[key] is ExitCode.INTERRUPTED):
            raise typer.Exit(codes[key])
    names, runs = [listed[key].name for key in left], [done[k] for k in listed if k in done]
    if runs:
        saved, limits = [saved_run(each.path) for each in runs], plans[pieces[0].plan].identify
        found = batch_of(
            directory.name,
            saved,
            limits.acceptance,
            [f"still to be pressed: {', '.join(names)}"] if names else [],
        )
        document, page = batch_document(found, saved), directory / "batch.html"
        output.show(document)
        write_file(page, render(document))
        write_file(directory / "batch.json", json_text(found.model_dump(), indent=1) + "\n")
        output.line(f"report   {page}")
        output.result(found.model_dump())
    else:
        output.line(f"no specimen is pressed; still to be: {', '.join(names)}")
        output.result({"specimens": ()})
    raise typer.Exit(max((codes.get(key, ExitCode.OK) for key in left), default=ExitCode.OK))


def _ask(text: str) -> str:
    """A letter of an answer at the terminal, "" for Enter; "q" where nobody answers any more.

    What was typed before the question does not answer it, nor does a word: neither moves the arm.
    """
    while True:
        with contextlib.suppress(termios.error, OSError, ValueError, AttributeError):
            termios.tcflush(sys.stdin, termios.TCIFLUSH)
        print(text, end="", file=sys.stderr, flush=True)
        try:
            line = sys.stdin.readline() if sys.stdin else ""
        except KeyboardInterrupt:
            print(file=sys.stderr)
            return "q"
        answer = line.strip().lower()
        if not line or answer in ("", "s", "q"):
            return answer if line else "q"
