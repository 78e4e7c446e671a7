"""The verb `batch`: specimen after specimen by a list, then a table of all."""

from __future__ import annotations

import contextlib
import signal
import sys
import termios
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from stepload.cli.options import DryRun, Seed
from stepload.errors import BadInputError, ExitCode
from stepload.report.terminal import AsJson, Output

if TYPE_CHECKING:
    from stepload.data.batch import Piece
    from stepload.plan.model import Acceptance, Plan
    from stepload.record.summary import Summary

OF_THE_SPECIMEN = {
    "R1", "R2", "R6", "R8", "R12", "R14", "not_free", "tilted", "uneven", "until", "specimen",
}  # fmt: skip
"""Stops that another specimen, or this one mounted anew, may not have; any other is the rig's."""


def batch(
    files: Annotated[
        list[Path] | None,
        Argument(
            metavar="[PLAN] [LIST]",
            help="Plan (YAML) and list (CSV: specimen, operator, trial, plan, notes); or several"
            " plans, one for each specimen.",
        ),
    ] = None,
    dry_run: DryRun = False,
    yes: Annotated[bool, Option("--yes", help="Ask nothing; only with --dry-run.")] = False,
    out: Annotated[Path | None, Option(help="Directory of the batch; default: runs/LIST.")] = None,
    report: Annotated[
        Path | None, Option(metavar="DIR", help="Press nothing: table and page of a batch.")
    ] = None,
    seed: Seed = None,
    quiet: Annotated[bool, Option("--quiet", help="Two lines for each specimen.")] = False,
    as_json: AsJson = False,
) -> None:
    """Press specimen after specimen by a list; table and control chart of all.

    Started anew it goes on where it was left.

    Example: stepload batch foot.yaml specimens.csv
    """
    from stepload.cli.hazards import ask_before_pressing
    from stepload.data.batch import Key, changed, first_looks, pressed
    from stepload.feasibility.preflight import preflight_of
    from stepload.plan.load import load_plan
    from stepload.session.experiment import refuse_what_may_not_run

    output = Output(as_json=as_json)
    if report is not None:
        either = pressed(report, dry_run=False) or pressed(report, dry_run=True)
        _show(report, list(either.values()), output)
        return
    if yes and not dry_run:
        raise BadInputError("--yes: nobody would mount the specimens", hint="add --dry-run")
    if not (dry_run or (sys.stdin and sys.stdin.isatty())):
        raise BadInputError("a batch asks for each specimen: it needs a terminal")
    name, pieces = _pieces(files or [], dry_run)
    name = out.name if out else name
    skipped, accepted, codes, first = set[Key](), set[str](), dict[Key, ExitCode](), True
    while True:  # what is there is looked up anew each time: the disk alone knows
        plans = {piece.plan: load_plan(piece.plan) for piece in pieces}
        listed = {piece.key(plans[piece.plan]): piece for piece in pieces}
        _refuse_one_name_for_two(pieces, listed)
        directory = out or plans[pieces[0].plan].record.directory / name
        done = pressed(directory, dry_run=dry_run)
        left = [key for key in listed if key not in done]
        key = next((each for each in left if each not in skipped), None)
        if key is None:
            if first and done:
                newest = max(run.metadata["started"] for run in done.values())
                output.line(f"All are pressed, the last one {newest}. Press anew: --out DIR")
            break
        plan = listed[key].of(plans[listed[key].plan], name)
        before = [run for other, run in done.items() if other[0] == plan.name]
        if others := changed(plan, before) - accepted:
            output.line(f"changed since {before[0].path.parent.name}: {', '.join(sorted(others))}")
            if yes or _ask("Enter presses the rest with what is there now, q ends: "):
                raise BadInputError("the plan has changed", hint="a batch of its own: --out DIR")
            accepted |= others
        if first:
            first, preflight = False, preflight_of(plan)
            refuse_what_may_not_run(preflight, dry_run)  # before anything is mounted in vain
            if not dry_run and ask_before_pressing(preflight, False, False):
                continue  # the rig file may have changed
        number = list(listed).index(key)
        output.line(f"\n{number + 1} of {len(listed)}: {listed[key].name}")
        answer = "" if yes else "?"
        while answer not in ("", "a", "s", "q"):
            answer = _ask("Mount it, then Enter (a: unchecked; s: skip; q: end): ")
        if answer == "q":
            break
        if yes or answer == "s":
            skipped.add(key)
        if answer == "s":
            continue
        plan = replace(plan, record=replace(plan.record, directory=directory))
        drawn = (plan.rig.simulation.seed if seed is None else seed) + number
        looks = None if answer == "a" else first_looks(before)
        codes[key], ends = _press(plan, looks, drawn if dry_run else None, output, quiet=quiet)
        if ends or (yes and codes[key] is ExitCode.INTERRUPTED):
            raise typer.Exit(codes[key])
    names, found = [listed[key].name for key in left], [done[k] for k in listed if k in done]
    if found:
        _show(directory, found, output, plans[pieces[0].plan].identify.acceptance, names)
    else:
        output.line(f"no specimen is pressed; still to be: {', '.join(names)}")
        output.result({"specimens": ()})
    raise typer.Exit(max((codes.get(key, ExitCode.OK) for key in left), default=ExitCode.OK))


def _pieces(files: Sequence[Path], dry_run: bool) -> tuple[str, list[Piece]]:
    """The name of the batch, and what is to be pressed."""
    from stepload.data.batch import Piece, read_list
    from stepload.plan.load import load_plan

    lists = [path for path in files if path.suffix.lower() == ".csv"]
    plans = [path for path in files if path not in lists]
    if not files or len(lists) > 1 or (lists and len(plans) > 1):
        raise BadInputError("name a plan and a list, or plans alone", hint="PLAN specimens.csv")
    if lists:
        return lists[0].stem, read_list(lists[0], plans[0] if plans else None, dry_run=dry_run)
    return "batch", [Piece(each, load_plan(each).record.specimen or each.stem) for each in plans]


def _refuse_one_name_for_two(pieces: Sequence[Piece], listed: Mapping[Any, Piece]) -> None:
    """Refuse presses that their records would not tell apart: one of them would be left out."""
    kept = [*listed.values()]
    if twice := [piece.name for piece in pieces if not any(piece is each for each in kept)]:
        raise BadInputError(
            f"{', '.join(twice)}: twice in one plan, by its name and its operator",
            hint="tell them apart: column `trial`, or another name of a plan",
        )


def _ask(text: str) -> str:
    """An answer at the terminal, of one letter; "q" where nobody answers any more.

    What was typed before the question does not answer it: an early Enter must not move the arm.
    """
    with contextlib.suppress(termios.error, OSError, ValueError, AttributeError):
        termios.tcflush(sys.stdin, termios.TCIFLUSH)
    print(text, end="", file=sys.stderr, flush=True)
    line = sys.stdin.readline() if sys.stdin else ""
    return line.strip().lower() if line else "q"


def _press(
    plan: Plan,
    looks: Sequence[tuple[float, float]] | None,
    seed: int | None,
    output: Output,
    *,
    quiet: bool,
) -> tuple[ExitCode, bool]:
    """Press a specimen as `run` does, dry with a seed; exit code, and whether the batch ends.

    `looks` are those at the specimens before it; None: it is not checked.
    """
    from stepload.cli.run import exit_code, press
    from stepload.engine.operator import Operator
    from stepload.feasibility.preflight import preflight_of
    from stepload.session.specimen import SpecimenCheck

    preflight, operator = preflight_of(plan), Operator()
    with operator.listening():
        finished = press(
            preflight, operator, output, dry_run=seed is not None, out=None, seed=seed,
            quiet=quiet, check=None if looks is None else SpecimenCheck(preflight, looks),
        )  # fmt: skip
    outcome = finished.outcome
    of_rig = outcome.cause is not None and outcome.cause.rule not in OF_THE_SPECIMEN
    ends = of_rig or outcome.safing_failed or outcome.signal_number not in (0, signal.SIGINT)
    if ends:
        output.line("the batch ends here: mend the rig; the same command goes on")
    return exit_code(finished), ends


def _show(
    directory: Path,
    done: Sequence[Summary],
    output: Output,
    acceptance: Acceptance | None = None,
    left: Sequence[str] = (),
) -> None:
    """Table and page of what is pressed; without a plan by the limits of the newest record."""
    from stepload.record.plain import json_text
    from stepload.report.batch import batch_of
    from stepload.report.batch_document import batch_document
    from stepload.report.page import render
    from stepload.report.run_record import plan_of, read_to_evaluate, saved_run
    from stepload.session.files import write_file

    if not done:
        raise BadInputError(f"{directory}: no completed run of a batch yet")
    if acceptance is None:
        newest = read_to_evaluate(max(done, key=lambda run: run.metadata["started"]).path)
        acceptance = plan_of(newest.metadata, newest.attachments).identify.acceptance
    runs = [saved_run(each.path) for each in done]
    notes = [f"still to be pressed: {', '.join(left)}"] if left else []
    found = batch_of(directory.name, runs, acceptance, notes)
    document, page = batch_document(found, runs), directory / "batch.html"
    output.show(document)
    write_file(page, render(document))
    write_file(directory / "batch.json", json_text(found.model_dump(), indent=1) + "\n")
    output.line(f"report   {page}")
    output.result(found.model_dump())
